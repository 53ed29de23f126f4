#include "surface_fit/rest_shape.hpp"

#include <algorithm>
#include <utility>

#include "base/geometry.hpp"
#include "base/stored_numbers.hpp"
#include "shape/blend.hpp"
#include "shape/detail_operator.hpp"

namespace dynmesh {

// No coefficient is kept that the points do not determine: the shape of the last frame keeps hidden
// parts as they were, and modes that keep them as well would confirm what was found wrongly.
RestShape::RestShape(const Cells& cells, Workers& workers, bool is_trained, Modes modes,
                     Field first_shape)
    : is_trained_(is_trained),
      fit_(ShapeFit::Of::rest, cells, workers, 0, std::move(modes)),
      first_(first_shape.begin(), first_shape.end()),
      shape_(first_) {}

void RestShape::fit(Field x, Field shape, const Anchors& anchors, double rounding,
                    ShapeSystem& system, const Rotations& rotations) {
  if (!fit_.exists() || anchors.number == 0) return;
  std::vector<ShapeTerms> wanted(x.size()), steps(x.size()), k_steps(x.size());
  std::vector<Vector3<double>> kx(x.size());
  for (std::size_t v = 0; v < x.size(); ++v) wanted[v] = {shape[v], first_[v] - shape[v], {}};
  rotations.turn(wanted, wanted);
  system.apply(x, 1, kx);
  system.solve_terms(wanted, x, kx, anchors);
  system.keep_steps(steps);  // the next solutions overwrite them
  system.apply(steps, k_steps);
  const FittedModes found =
      fit_.find({anchors, x, kx, wanted, steps, k_steps, rounding}, system, rotations);
  prior_weight_ = found.prior_weight;
  prior_share_ = found.prior_share;
  set_shape();
}

void RestShape::recall() {
  if (!is_trained()) return;
  const auto is_share = [](double x) { return x >= 0 && x <= 1; };
  if (!is_share(prior_weight_) || !is_share(prior_share_)) {
    refuse_state("does not contain a valid rest shape");
  }
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
