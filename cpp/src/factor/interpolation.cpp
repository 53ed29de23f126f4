#include "factor/interpolation.hpp"

#include <vector>

namespace dynmesh {

void interpolate(const SparseMatrix& energy, MaskedFactor& factor,
                 std::span<const std::uint8_t> is_free, std::span<Vector3<double>> values) {
  factor.factorize(is_free);
  const auto order = factor.order();
  if (order.empty()) return;
  std::vector<Vector3<double>> solution;
  for (const Index v : order) {
    Vector3<double> pull;  // of the fixed values
    for (SparseMatrix::InnerIterator e(energy, v); e; ++e) {
      if (is_free[e.row()] == 0) pull = pull - e.value() * values[e.row()];
    }
    solution.push_back(pull);
  }
  factor.solve(solution, 1);
  for (std::size_t r = 0; r < order.size(); ++r) values[order[r]] = solution[r];
}

}  // namespace dynmesh
