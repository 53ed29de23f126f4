/// The modes of a rehearsal: how the shape of each part of the surface varied in it.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "detail/surface_parts.hpp"
#include "kernels/kernels.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// A shape, as a field of detail in the axes of frame 0, is m_0 + B a. The columns of B are modes,
/// up to 16 for each part; a coefficient of one is a standard deviation over the rehearsal.
///
/// Coefficients are arrays of `n_coefficients()` numbers. Those beyond the modes of a part belong
/// to modes of zero and have no effect.
class Modes {
 public:
  using Field = std::span<const Vector3<double>>;

  /// No modes.
  Modes() = default;
  /// Computes the modes of `shapes`: for each vertex, the deviations from m_0 in all frames of the
  /// rehearsal, (k, n_frames).
  Modes(const SurfaceParts& parts, std::span<const Vector3<double>> shapes, std::size_t n_frames,
        const RehearsalConstants& constants);

  /// Modes of zero, to be set by `form`.
  explicit Modes(const SurfaceParts& parts);

  /// Sets the modes at vertices `first` to `last` - 1 to combinations of shapes.
  void form(const ShapeData& shapes, const CombinationData& combinations, Index first, Index last,
            Workers& workers);
  void set_size(std::size_t size) { size_ = size; }

  /// The number of modes, all parts together.
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t n_coefficients() const { return n_coefficients_; }
  /// The share of the variance over the rehearsal that the global modes hold, 0 to 1.
  [[nodiscard]] double variance_held() const { return variance_held_; }

  /// combined = B a.
  void combine(std::span<const double> coefficients, std::span<Vector3<double>> combined,
               Workers& workers);
  /// projected = B^T field.
  void project(Field field, std::span<double> projected, Workers& workers);
  /// The same, and squares_j = sum of weights_i |B_j(i)|^2.
  void project_and_weigh(Field field, std::span<const double> weights, std::span<double> projected,
                         std::span<double> squares, Workers& workers);

 private:
  [[nodiscard]] ModeData data() const { return {offsets_.data(), parts_.data(), values_.data()}; }
  template <class Kernel>
  void add_up(std::size_t n_sums, Workers& workers, const Kernel& kernel);
  void reduce(std::size_t first, std::size_t n_sums, std::span<double> sums) const;

  std::size_t size_ = 0;
  std::size_t n_coefficients_ = 0;
  double variance_held_ = 0;
  std::vector<Index> offsets_;
  std::vector<Index> parts_;
  std::vector<float> values_;
  std::vector<float> coefficients_;  // as float
  std::vector<float> partial_sums_;  // of each chunk of vertices, one or two for each coefficient
};

}  // namespace dynmesh
