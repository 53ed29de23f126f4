/// Surfaces that are smooth between given vertices.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "linear/masked_factor.hpp"

namespace dynmesh {

/// L = D - R, eq. (2), with `weight(i, j)` in the place of the ones of R.
template <class Weight>
SparseMatrix laplacian(const Cells& cells, const Weight& weight) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  const auto k = static_cast<Index>(cells.size());
  for (Index i = 0; i < k; ++i) {
    double degree = 0;
    for (const Index j : cells[i]) {
      entries.emplace_back(i, j, -weight(i, j));
      degree += weight(i, j);
    }
    entries.emplace_back(i, i, degree);
  }
  SparseMatrix result(k, k);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}
inline SparseMatrix laplacian(const Cells& cells) {
  return laplacian(cells, [](Index, Index) { return 1.0; });
}

/// Sets `values` where `is_free` so that these rows of `energy` times the values are 0: the minimum
/// of a quadratic energy with the other values fixed. `factor` is that of the energy. Each
/// component must have a fixed value.
inline void interpolate(const SparseMatrix& energy, MaskedFactor& factor,
                        std::span<const std::uint8_t> is_free, std::span<Vector3> values) {
  factor.factorize(is_free);
  const auto order = factor.order();
  if (order.empty()) return;
  std::vector<Vector3> solution;
  for (const Index v : order) {
    Vector3 pull;  // of the fixed values
    for (SparseMatrix::InnerIterator e(energy, v); e; ++e) {
      if (is_free[e.row()] == 0) pull = pull - e.value() * values[e.row()];
    }
    solution.push_back(pull);
  }
  factor.solve(solution, 1);
  for (std::size_t r = 0; r < order.size(); ++r) values[order[r]] = solution[r];
}

}  // namespace dynmesh
