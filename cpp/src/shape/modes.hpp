/// Modes: how the shape of each part of the surface varies.
#pragma once

#include <algorithm>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "shape/constants.hpp"

namespace dynmesh {

/// The number of modes of a part. Parts with fewer modes are filled up with zeros.
constexpr int modes_of_part = 16;

/// The parts that hold each vertex, with weights. Vertex i has the entries offsets[i] to
/// offsets[i + 1] - 1. Part 0 is global: it holds every vertex with weight 1. The weights of the
/// others add up to 1 at every vertex that a seed reaches, and do not reach across components.
struct SurfaceParts {
  Index n_parts = 1;
  std::vector<Index> offsets = {0};  ///< (k + 1,)
  std::vector<Index> parts;          ///< of the entries
  std::vector<double> weights;       ///< of the entries

  /// k
  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
};

/// Seeds are chosen on the frame by farthest points, the first of them farthest from the mean of
/// all vertices. The weight of a seed decreases with the shortest distance along the edges.
SurfaceParts divide_surface(const Cells& cells, Field frame,
                            Index local_parts = training_constants.local_parts);

/// Sums over the vertices. They are added up in chunks, which do not depend on the number of
/// threads, and are short, so that sums of float are as accurate as their terms. Allocates memory
/// only in the constructor.
template <class Real>
class VertexSums {
 public:
  VertexSums(std::size_t n_vertices, std::size_t most_sums)
      : k_(static_cast<Index>(n_vertices)),
        n_chunks_((k_ + chunk - 1) / chunk),
        partial_sums_(at(n_chunks_) * most_sums) {}

  /// Computes `n_sums` of them: `add(sums, first, last)` adds the terms of the vertices `first` to
  /// `last` - 1, and `take(j, sum)` takes the results.
  template <class Add, class Take>
  void find(std::size_t n_sums, Workers& workers, const Add& add, const Take& take) {
    workers.share(n_chunks_, workers.are_worth_it(k_), [&](Index i) {
      Real* sums = &partial_sums_[at(i) * n_sums];
      std::fill_n(sums, n_sums, Real{});
      add(sums, i * chunk, std::min(k_, (i + 1) * chunk));
    });
    for (std::size_t j = 0; j < n_sums; ++j) {
      double sum = 0;
      for (std::size_t i = 0; i < at(n_chunks_); ++i) {
        sum += static_cast<double>(partial_sums_[i * n_sums + j]);
      }
      take(j, sum);
    }
  }

 private:
  static constexpr Index chunk = 256;

  Index k_;
  Index n_chunks_;
  std::vector<Real> partial_sums_;  // of each chunk
};

/// Buffers of products with modes, for one thread of calls at a time.
struct ModeSums {
  ModeSums(std::size_t n_vertices, std::size_t n_coefficients)
      : coefficients(n_coefficients), of_vertices(n_vertices, 2 * n_coefficients) {}

  std::vector<float> coefficients;
  VertexSums<float> of_vertices;  ///< one or two for each coefficient
};

/// Modes as combinations of shapes: mode j of part p is the sum over l of the shape in `slots[l]`
/// times factors[(p * n + l) * modes_of_part + j], and times the weights of the part.
struct ModeFactors {
  std::span<const float> shapes;   ///< of each vertex, x of all slots, then y, then z
  std::span<const Index> slots;    ///< (n,)
  std::span<const float> factors;  ///< (parts, n, modes_of_part)
};

/// A shape, as a field of detail in the axes of frame 0, is m_0 + B a. The columns of B are modes,
/// up to 16 for each part; a coefficient of one is a standard deviation over the training sequence.
///
/// Coefficients are arrays of `n_coefficients()` numbers. Those beyond the modes of a part belong
/// to modes of zero and have no effect.
class Modes {
 public:
  /// No modes.
  Modes() = default;
  /// None yet, to be set by `form`.
  Modes(SurfaceParts parts, double mean_edge);

  /// Sets the modes, of which `size` are not 0, to combinations of shapes, which are in `unit()`.
  void form(const ModeFactors& combinations, std::size_t size, Workers& workers);

  [[nodiscard]] const SurfaceParts& parts() const { return parts_; }
  /// A power of two near the mean edge length.
  [[nodiscard]] double unit() const { return unit_; }

  /// The number of modes, all parts together.
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t n_coefficients() const { return n_coefficients_; }
  /// The number of shapes, whose squared coefficients are at most this; 0 without.
  [[nodiscard]] std::size_t n_frames() const { return n_frames_; }

  /// combined = B a.
  void combine(std::span<const double> coefficients, std::span<Vector3> combined, ModeSums& sums,
               Workers& workers) const;
  /// projected = B^T field and, with weights, squares_j = sum of weights_i |B_j(i)|^2.
  void project(Field field, std::span<double> projected, std::span<const double> weights,
               std::span<double> squares, ModeSums& sums, Workers& workers) const;

 private:
  SurfaceParts parts_;
  std::size_t size_ = 0;
  std::size_t n_coefficients_ = 0;
  std::size_t n_frames_ = 0;
  double unit_ = 1;
  // Of each entry of the parts, x of all modes, then y, then z, in this unit, so that their squares
  // are in the range of float.
  std::vector<float> values_;
};

}  // namespace dynmesh
