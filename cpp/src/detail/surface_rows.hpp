/// Measured points that a surface is drawn to, each at a place on one of its triangles.
#pragma once

#include <algorithm>
#include <array>
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

  /// The corner with the largest share.
  [[nodiscard]] std::uint32_t nearest_corner() const {
    return corners[static_cast<std::size_t>(std::ranges::max_element(shares) - shares.begin())];
  }
  [[nodiscard]] Vector3<double> on(std::span<const Vector3<double>> field) const {
    return shares[0] * field[corners[0]] + shares[1] * field[corners[1]] +
           shares[2] * field[corners[2]];
  }
};

/// The rows of a frame, and those of each vertex, so that threads can add them up vertex by vertex.
class SurfaceRows {
 public:
  std::vector<SurfaceRow> rows;

  /// Sorts the rows by vertices. Call it whenever they have changed.
  void index(std::size_t n_vertices) {
    ends_.assign(n_vertices + 1, 0);
    entries_.resize(3 * rows.size());
    along_.resize(rows.size());
    for (const SurfaceRow& row : rows) {
      for (const std::uint32_t v : row.corners) ++ends_[v + 1];
    }
    for (std::size_t v = 0; v < n_vertices; ++v) ends_[v + 1] += ends_[v];
    next_.assign(ends_.begin(), ends_.end() - 1);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      for (std::size_t s = 0; s < 3; ++s) {
        entries_[next_[rows[r].corners[s]]++] = {static_cast<std::uint32_t>(r),
                                                 static_cast<std::uint32_t>(s)};
      }
    }
  }

  [[nodiscard]] bool empty() const { return rows.empty(); }

  /// Prepares `at` for half of the negative gradient at X.
  void compare(std::span<const Vector3<double>> x, Workers& workers) {
    workers.for_each_in_chunks(rows.size(), [&](std::size_t r) {
      const SurfaceRow& row = rows[r];
      along_[r] = row.weight * dot(row.normal, row.point - row.on(x));
    });
  }
  /// Prepares `at` for half of the product of the energy's Hessian with a step.
  void multiply(std::span<const Vector3<double>> steps, Workers& workers) {
    workers.for_each_in_chunks(rows.size(), [&](std::size_t r) {
      const SurfaceRow& row = rows[r];
      along_[r] = row.weight * dot(row.normal, row.on(steps));
    });
  }
  /// What was prepared, at a vertex.
  [[nodiscard]] Vector3<double> at(std::size_t vertex) const {
    Vector3<double> sum;
    for (std::uint32_t e = ends_[vertex]; e < ends_[vertex + 1]; ++e) {
      const SurfaceRow& row = rows[entries_[e].row];
      sum = sum + (row.shares[entries_[e].corner] * along_[entries_[e].row]) * row.normal;
    }
    return sum;
  }
  /// The sum of weights times shares at a vertex.
  [[nodiscard]] double weight_at(std::size_t vertex) const {
    double sum = 0;
    for (std::uint32_t e = ends_[vertex]; e < ends_[vertex + 1]; ++e) {
      const SurfaceRow& row = rows[entries_[e].row];
      sum += row.weight * row.shares[entries_[e].corner];
    }
    return sum;
  }

  /// Calls `visit(row, share)` for each row that touches a vertex.
  template <class Visit>
  void for_each_at(std::size_t vertex, const Visit& visit) const {
    for (std::uint32_t e = ends_[vertex]; e < ends_[vertex + 1]; ++e) {
      visit(rows[entries_[e].row], rows[entries_[e].row].shares[entries_[e].corner]);
    }
  }

 private:
  struct Entry {
    std::uint32_t row, corner;
  };

  std::vector<std::uint32_t> ends_, next_;
  std::vector<Entry> entries_;
  std::vector<double> along_;
};

}  // namespace dynmesh
