#include "tracking/rest_shape.hpp"

#include <algorithm>
#include <utility>

#include "detail/blend.hpp"
#include "detail/surface_parts.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

RestShape::RestShape(const Cells& cells, Workers& workers, const DetailConstants& constants,
                     TrainingFrames training)
    : cells_(cells),
      workers_(workers),
      constants_(constants),
      training_(std::move(training)),
      shape_fit_(cells, workers, constants.training),
      before_{0, 0, std::vector<double>(shape_fit_size())},
      first_(cells.size()),
      shape_(cells.size()),
      generations_(is_trained() ? cells.size() : 0),
      known_(is_trained() ? cells.size() : 0),
      kx_(known_.size()),
      wanted_(3 * known_.size()),
      steps_(3 * known_.size()),
      k_steps_(3 * known_.size()) {}

Modes RestShape::learn(const DetailOperator& k, Field first_frame, double mean_edge,
                       const Rounding& rounding) const {
  if (!is_trained()) return {};
  const auto parts = divide_surface(cells_, first_frame, constants_.training);
  const auto shapes = training_shapes(training_, k, cells_, first_frame, mean_edge,
                                      constants_.largest_stiff_angle, workers_);
  return Modes(parts, shapes, training_.size(), constants_.training,
               scale_of(training_, rounding, mean_edge));
}

void RestShape::reset(Modes modes) {
  shape_fit_.reset(std::move(modes));
  prior_weight_ = 0;
  prior_share_ = 0;
}

void RestShape::set_first(Field first_shape) {
  std::ranges::copy(first_shape, first_.begin());
  std::ranges::copy(first_shape, shape_.begin());
}

void RestShape::fit(const Surface& surface, ShapeSystem& system, Rotations& rotations) {
  const Anchors& anchors = surface.anchors;
  if (!shape_fit_.exists() || anchors.number == 0) return;
  for (std::size_t v = 0; v < known_.size(); ++v) {
    known_[v] = anchors.weights[v] > 0 ? 1 : 0;
    wanted_[3 * v] = surface.shape[v];
    wanted_[3 * v + 1] = first_[v] - surface.shape[v];
    wanted_[3 * v + 2] = {};
  }
  generations_.classify(cells_, known_);
  std::ranges::copy(rotations.turn(wanted_), wanted_.begin());
  system.apply(surface.x, 1, kx_);
  const Field steps = system.solve<3>(
      [&](std::size_t v, std::size_t field) {
        return field == 0 ? wanted_[3 * v] - kx_[v] : wanted_[3 * v + field];
      },
      surface.x, anchors);
  std::ranges::copy(steps, steps_.begin());
  system.apply(steps_, 3, k_steps_);
  const ResidualField residuals = {anchors,  surface.x,       kx_, wanted_, steps_,
                                   k_steps_, surface.rounding};
  const ShapeFit::Found found = shape_fit_.find(residuals, system, rotations, generations_);
  prior_weight_ = found.prior_weight;
  prior_share_ = found.prior_share;
  set_shape();
}

RestShape::Memory RestShape::memory() const {
  return {prior_weight_, prior_share_, is_trained() ? shape_fit_.memory() : std::vector<double>{}};
}

bool RestShape::accepts(const Memory& memory) const {
  const auto is_share = [&](double x) { return x >= 0 && x <= (is_trained() ? 1 : 0); };
  return is_share(memory.prior_weight) && is_share(memory.prior_share) &&
         memory.shape_fit.size() == shape_fit_size() &&
         (!is_trained() || shape_fit_.accepts(memory.shape_fit));
}

void RestShape::recall(const Memory& memory) {
  prior_weight_ = memory.prior_weight;
  prior_share_ = memory.prior_share;
  if (!is_trained()) return;
  shape_fit_.recall(memory.shape_fit);
  set_shape();
}

void RestShape::begin_frame() {
  if (!is_trained()) return;
  before_.prior_weight = prior_weight_;
  before_.prior_share = prior_share_;
  shape_fit_.store(before_.shape_fit);
}

void RestShape::undo_frame() {
  if (is_trained()) recall(before_);
}

void RestShape::set_shape() {
  std::ranges::copy(first_, shape_.begin());
  if (prior_weight_ == 0) return;
  for (std::size_t v = 0; v < shape_.size(); ++v) {
    shape_[v] = first_[v] + prior_weight_ * shape_fit_.shape()[v];
  }
}

}  // namespace dynmesh
