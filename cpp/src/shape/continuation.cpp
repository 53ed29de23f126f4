#include "shape/continuation.hpp"

#include <algorithm>
#include <cstddef>

#include "base/geometry.hpp"
#include "shape/constants.hpp"

namespace dynmesh {
namespace {

/// Sums over some of the rows beside a vertex.
struct Beside {
  Vector3 sum;
  double squares = 0;
  double count = 0;
};

template <class IsCounted>
Beside beside(std::span<const Index> cell, Field differences, const IsCounted& is_counted) {
  Beside found;
  for (const Index j : cell) {
    if (!is_counted(j)) continue;
    found.sum = found.sum + differences[at(j)];
    found.squares += squared_norm(differences[at(j)]);
    ++found.count;
  }
  return found;
}

}  // namespace

void continue_into_holes(const Cells& cells, const Generations& generations,
                         std::span<Vector3> found, std::span<Vector3> shape) {
  const auto generation = generations.of_vertices();
  const auto is_known = [&](Index v) { return generation[at(v)] == Generations::anchor; };
  const auto is_row_known = [&](Index v) {
    return is_known(v) && std::ranges::all_of(cells[at(v)], is_known);
  };
  const auto n_vertices = static_cast<Index>(shape.size());
  const auto each_at_rim = [&](const auto& visit) {
    for (Index v = 0; v < n_vertices; ++v) {
      if (is_known(v) && !is_row_known(v)) visit(v);
    }
  };
  const std::span<Vector3> differences = found;
  for (std::size_t v = 0; v < shape.size(); ++v) differences[v] = found[v] - shape[v];

  // How alike the differences of neighbouring rows are: their intraclass correlation. Those of
  // noise are not.
  double common = 0, all = 0;
  each_at_rim([&](Index v) {
    const Beside rows = beside(cells[at(v)], differences, is_row_known);
    if (rows.count < 2) return;
    common += (squared_norm(rows.sum) - rows.squares) / (rows.count - 1);
    all += rows.squares;
  });
  if (!(common > 0)) return;
  const auto& constants = continuation_constants;
  const double share = constants.largest_share * std::min(1.0, common / all / constants.alike);

  const auto continue_to = [&](Index v, const auto& is_nearer) {
    const Beside rows = beside(cells[at(v)], differences, is_nearer);
    differences[at(v)] =
        rows.count > 0 ? constants.kept_per_ring / rows.count * rows.sum : Vector3{};
    shape[at(v)] = shape[at(v)] + share * differences[at(v)];
  };
  each_at_rim([&](Index v) { continue_to(v, is_row_known); });
  for (const Index v : generations.satellites()) {
    continue_to(v, [&, own = generation[at(v)]](Index j) { return generation[at(j)] < own; });
  }
}

}  // namespace dynmesh
