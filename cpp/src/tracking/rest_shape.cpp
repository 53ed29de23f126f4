#include "tracking/rest_shape.hpp"

#include <algorithm>
#include <utility>

#include "detail/blend.hpp"
#include "detail/surface_parts.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

RestShape::RestShape(const Cells& cells, Workers& workers, const DetailConstants& constants,
                     Take<double> take)
    : cells_(cells),
      workers_(workers),
      constants_(constants),
      take_(std::move(take)),
      pose_(cells, workers, constants.rehearsal),
      before_{0, 0, std::vector<double>(pose_size())},
      first_(cells.size()),
      shape_(cells.size()),
      generations_(is_rehearsed() ? cells.size() : 0),
      known_(is_rehearsed() ? cells.size() : 0),
      kx_(known_.size()),
      wanted_(3 * known_.size()),
      steps_(3 * known_.size()),
      k_steps_(3 * known_.size()) {}

Modes RestShape::learn(const DetailOperator& k, Field first_frame, double mean_edge,
                       const Rounding& rounding) const {
  if (!is_rehearsed()) return {};
  const auto parts = divide_surface(cells_, first_frame, constants_.rehearsal);
  const auto shapes = rehearsed_shapes<double>(take_, k, cells_, first_frame, mean_edge,
                                               constants_.largest_stiff_angle, workers_);
  return Modes(parts, shapes, take_.size(), constants_.rehearsal,
               scale_of<double>(take_, rounding, mean_edge));
}

void RestShape::reset(Modes modes) {
  pose_.reset(std::move(modes));
  trust_ = 0;
  explained_ = 0;
}

void RestShape::set_first(Field first_shape) {
  std::ranges::copy(first_shape, first_.begin());
  std::ranges::copy(first_shape, shape_.begin());
}

void RestShape::pose(const Surface& surface, ShapeSystem& system, Rotations& rotations) {
  const Anchors& anchors = surface.anchors;
  if (!pose_.exists() || anchors.number == 0) return;
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
  const Pose::Found found = pose_.find(residuals, system, rotations, generations_);
  trust_ = found.trust;
  explained_ = found.explained;
  set_shape();
}

RestShape::Memory RestShape::memory() const {
  return {trust_, explained_, is_rehearsed() ? pose_.memory() : std::vector<double>{}};
}

bool RestShape::accepts(const Memory& memory) const {
  const auto is_share = [&](double x) { return x >= 0 && x <= (is_rehearsed() ? 1 : 0); };
  return is_share(memory.trust) && is_share(memory.explained) &&
         memory.pose.size() == pose_size() && (!is_rehearsed() || pose_.accepts(memory.pose));
}

void RestShape::recall(const Memory& memory) {
  trust_ = memory.trust;
  explained_ = memory.explained;
  if (!is_rehearsed()) return;
  pose_.recall(memory.pose);
  set_shape();
}

void RestShape::begin_frame() {
  if (!is_rehearsed()) return;
  before_.trust = trust_;
  before_.explained = explained_;
  pose_.store(before_.pose);
}

void RestShape::undo_frame() {
  if (is_rehearsed()) recall(before_);
}

void RestShape::set_shape() {
  std::ranges::copy(first_, shape_.begin());
  if (trust_ == 0) return;
  for (std::size_t v = 0; v < shape_.size(); ++v) {
    shape_[v] = first_[v] + trust_ * pose_.shape()[v];
  }
}

}  // namespace dynmesh
