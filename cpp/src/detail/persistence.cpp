#include "detail/persistence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {

void Persistence::allocate(std::size_t n_vertices) {
  for (auto* of : {&residuals_, &newest_, &turned_}) of->resize(n_vertices);
  are_seen_.resize(n_vertices);
}

void Persistence::reset() {
  std::ranges::fill(residuals_, Vector3<double>{});
  pass();
  sums_ = {};
}

void Persistence::pass() { std::ranges::fill(are_seen_, std::uint8_t{0}); }

void Persistence::learn(std::span<const Vector3<double>> kx, std::span<const Vector3<double>> shape,
                        const Cells& cells, const Generations& generations,
                        const Rotations& rotations) {
  const auto generation = generations.of_vertices();
  const auto is_known = [&](std::size_t v) { return generation[v] == Generations::anchor; };
  std::ranges::transform(kx, shape, newest_.begin(),
                         [](const auto& found, const auto& wanted) { return found - wanted; });
  rotations.turn_back(newest_, turned_);
  Sums newest;
  for (std::size_t v = 0; v < turned_.size(); ++v) {
    const bool is_seen =
        is_known(v) && std::ranges::all_of(cells[static_cast<Index>(v)], [&](Index n) {
          return is_known(static_cast<std::size_t>(n));
        });
    if (is_seen && are_seen_[v] != 0) {
      newest.product += dot(turned_[v], residuals_[v]);
      newest.square += (squared_norm(turned_[v]) + squared_norm(residuals_[v])) / 2;
    }
    are_seen_[v] = is_seen ? 1 : 0;
  }
  std::swap(residuals_, turned_);
  if (!std::isfinite(newest.product) || !std::isfinite(newest.square)) return;
  sums_.product = constants_.kept * sums_.product + newest.product;
  sums_.square = constants_.kept * sums_.square + newest.square;
}

double Persistence::value() const {
  if (!(sums_.square > 0)) return constants_.first_persistence;
  return std::clamp(sums_.product / sums_.square, 0.0, constants_.largest_persistence);
}

void Persistence::recall(std::size_t v, const OfVertex& remembered) {
  residuals_[v] = remembered.residual;
  are_seen_[v] = remembered.was_seen ? 1 : 0;
}

}  // namespace dynmesh
