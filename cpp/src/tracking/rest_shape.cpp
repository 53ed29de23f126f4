#include "tracking/rest_shape.hpp"

#include <algorithm>
#include <utility>

#include "detail/blend.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

// No coefficient is kept that the points do not determine: the shape of the last frame keeps hidden
// parts as they were, and modes that keep them as well would confirm what was found wrongly.
RestShape::RestShape(const Cells& cells, Workers& workers, bool is_trained, Modes modes,
                     Field first_shape)
    : cells_(cells),
      is_trained_(is_trained),
      fit_(ShapeFit::Of::rest, cells, workers, 0, std::move(modes)),
      first_(first_shape.begin(), first_shape.end()),
      shape_(first_),
      generations_(is_trained ? cells.size() : 0),
      known_(is_trained ? cells.size() : 0),
      kx_(known_.size()),
      wanted_(known_.size()),
      steps_(known_.size()),
      k_steps_(known_.size()) {
  std::size_t n = 0;
  known_fields(*this, [&](const auto& visited) { n += numbers_of(visited).size(); });
  remembered_.resize(n);
  remember();
}

void RestShape::fit(const Surface& surface, ShapeSystem& system, const Rotations& rotations) {
  const Anchors& anchors = surface.anchors;
  if (!fit_.exists() || anchors.number == 0) return;
  for (std::size_t v = 0; v < known_.size(); ++v) {
    known_[v] = anchors.weights[v] > 0 ? 1 : 0;
    wanted_[v] = {surface.shape[v], first_[v] - surface.shape[v], {}};
  }
  generations_.classify(cells_, known_);
  rotations.turn(wanted_, wanted_);
  system.apply(surface.x, 1, kx_);
  system.solve_terms(wanted_, surface.x, kx_, anchors);
  system.keep_steps(steps_);
  system.apply(steps_, k_steps_);
  const ResidualField residuals = {anchors,  surface.x,       kx_, wanted_, steps_,
                                   k_steps_, surface.rounding};
  const FittedModes found = fit_.find(residuals, system, rotations, generations_);
  prior_weight_ = found.prior_weight;
  prior_share_ = found.prior_share;
  set_shape();
}

void RestShape::recall() {
  begin_frame();
  const auto is_share = [](double x) { return x >= 0 && x <= 1; };
  if (!is_share(prior_weight_) || !is_share(prior_share_)) {
    refuse_state("does not contain a valid rest shape");
  }
}

void RestShape::remember() {
  auto number = remembered_.begin();
  known_fields(*this, [&](const auto& visited) {
    number = std::ranges::copy(numbers_of(visited), number).out;
  });
}

void RestShape::begin_frame() {
  if (!is_trained()) return;
  auto number = remembered_.begin();
  known_fields(*this, [&](auto& visited) {
    for (double& x : numbers_of(visited)) x = *number++;
  });
  fit_.recall();
  set_shape();
}

void RestShape::set_shape() {
  std::ranges::copy(first_, shape_.begin());
  if (prior_weight_ == 0) return;
  for (std::size_t v = 0; v < shape_.size(); ++v) {
    shape_[v] = first_[v] + prior_weight_ * fit_.added().shape[v];
  }
}

}  // namespace dynmesh
