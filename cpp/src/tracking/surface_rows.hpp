/// Measured points that a surface is drawn to, each at a place on one of its triangles.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "support/geometry.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// A term w (n . (sum_s b_s X_s - q))^2 of the energy of positions X.
struct SurfaceRow {
  std::array<std::uint32_t, 3> corners{};
  std::array<double, 3> shares{1, 0, 0};  ///< b
  Vector3<double> normal;                 ///< n
  Vector3<double> point;                  ///< q
  double weight = 0;                      ///< w
  double distance = 0;                    ///< of q from its place when it was found, in mean edges
  bool is_end = false;                    ///< whether the place is on the boundary of cloth

  [[nodiscard]] Vector3<double> on(std::span<const Vector3<double>> field) const {
    return shares[0] * field[corners[0]] + shares[1] * field[corners[1]] +
           shares[2] * field[corners[2]];
  }
};

/// The rows of a frame. Products with the matrix of their energy are found many times for the same
/// rows, so they have a copy in single precision, by rows and by vertices: this matrix is then
/// rounded, but symmetric and positive semidefinite.
class SurfaceRows {
 public:
  using Field = std::span<const Vector3<double>>;

  std::vector<SurfaceRow> rows;

  /// Copies the rows for `add_product`. Call it whenever they have changed.
  void index(std::size_t n_vertices) {
    copies_.clear();
    ends_.assign(n_vertices + 1, 0);
    for (const SurfaceRow& row : rows) {
      const auto normal = std::sqrt(row.weight) * row.normal;
      Copy& copy = copies_.emplace_back();
      for (std::size_t s = 0; s < 3; ++s) {
        copy.corners[s] = row.corners[s];
        copy.parts[s] = {static_cast<float>(row.shares[s] * normal.x),
                         static_cast<float>(row.shares[s] * normal.y),
                         static_cast<float>(row.shares[s] * normal.z)};
        ++ends_[row.corners[s] + 1];
      }
    }
    for (std::size_t v = 0; v < n_vertices; ++v) ends_[v + 1] += ends_[v];
    entries_.resize(3 * rows.size());
    auto next = ends_;
    for (std::uint32_t r = 0; r < copies_.size(); ++r) {
      for (std::size_t s = 0; s < 3; ++s) {
        entries_[next[copies_[r].corners[s]]++] = {r, copies_[r].parts[s]};
      }
    }
    along_.resize(rows.size());
  }

  [[nodiscard]] bool empty() const { return rows.empty(); }

  /// Adds half of the negative gradient at X.
  void add_forces(Field x, std::span<Vector3<double>> forces) const {
    for (const SurfaceRow& row : rows) {
      const auto force = row.weight * dot(row.normal, row.point - row.on(x)) * row.normal;
      for (std::size_t s = 0; s < 3; ++s) {
        forces[row.corners[s]] = forces[row.corners[s]] + row.shares[s] * force;
      }
    }
  }

  /// Adds half of the product of the energy's Hessian with a step: (k,).
  void add_product(Field step, std::span<Vector3<double>> product, Workers& workers) {
    workers.for_each_in_chunks(copies_.size(), [&](std::size_t r) {
      const Copy& copy = copies_[r];
      double sum = 0;
      for (std::size_t s = 0; s < 3; ++s)
        sum += dot(in_double(copy.parts[s]), step[copy.corners[s]]);
      along_[r] = sum;
    });
    workers.for_each_in_chunks(product.size(), [&](std::size_t v) {
      Vector3<double> sum = product[v];
      for (std::uint32_t e = ends_[v]; e < ends_[v + 1]; ++e) {
        sum = sum + along_[entries_[e].row] * in_double(entries_[e].part);
      }
      product[v] = sum;
    });
  }

 private:
  struct Copy {
    std::array<std::uint32_t, 3> corners;
    std::array<Vector3<float>, 3> parts;  // sqrt(w) b_s n
  };
  struct Entry {
    std::uint32_t row;
    Vector3<float> part;
  };

  std::vector<Copy> copies_;
  std::vector<Entry> entries_;  // those of vertex v from ends_[v] to ends_[v + 1] - 1
  std::vector<std::uint32_t> ends_;
  std::vector<double> along_;
};

}  // namespace dynmesh
