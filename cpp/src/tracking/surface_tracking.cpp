#include "tracking/surface_tracking.hpp"

#include <algorithm>
#include <utility>

#include "support/geometry.hpp"
#include "tracking/cloth.hpp"
#include "tracking/first_scan.hpp"
#include "tracking/rigid_step.hpp"

namespace dynmesh {

SurfaceTracking::SurfaceTracking(std::vector<Triangle> faces, const Topology& topology,
                                 Workers& workers, const TrackingConstants& constants,
                                 TrainingFrames training, bool has_uncertainty, double epsilon)
    : constants_(constants),
      faces_(std::move(faces)),
      topology_(topology),
      correspondences_(faces_, topology, workers, constants_),
      shape_(topology, workers, constants_, std::move(training), has_uncertainty, epsilon),
      is_cloth_(topology.cells.size()),
      last_(topology.cells.size()),
      before_(topology.cells.size()),
      x_(topology.cells.size()),
      observed_(topology.cells.size()) {}

void SurfaceTracking::reset(Field first_frame) {
  const double mean_edge = mean_edge_length(topology_.cells, first_frame);
  const auto is_cloth = find_cloth(faces_, topology_.component, first_frame, constants_);
  auto boundary = correspondences_.prepare(first_frame, is_cloth);
  shape_.reset(faces_, first_frame, mean_edge, is_cloth);
  // Nothing below can throw.
  correspondences_.reset(std::move(boundary), is_cloth);
  mean_edge_ = mean_edge;
  std::ranges::copy(is_cloth, is_cloth_.begin());
  is_all_cloth_ = std::ranges::count(is_cloth, 0) == 0;
  std::ranges::copy(first_frame, last_.begin());
  std::ranges::copy(first_frame, before_.begin());
  is_first_ = true;
}

SurfaceTracking::Found SurfaceTracking::track(const Measurement& measurement) {
  shape_.begin_frame();
  try {
    correspondences_.begin(measurement, mean_edge_);
    predict();
    const bool aligned =
        is_first_ && measurement.size() > 0 &&
        move_to_first_scan(measurement, correspondences_, constants_, mean_edge_, x_);
    correspondences_.find_visible(x_);
    const Search rigid =
        rigid_search(constants_.rigid_radius, constants_.rigid_scale, x_.size(), constants_);
    // Cloth bends while it moves, which its planes cannot tell from a rigid motion along it.
    const int rigid_steps = is_all_cloth_ ? 0 : constants_.rigid_steps;
    for (int step = 0; step < rigid_steps; ++step) {
      rigid_step(correspondences_, rigid, constants_, x_);
    }
    // The first step is repeated until nearly all measured points are explained.
    int steps = 1;
    while (nonrigid_step(0, true) > constants_.lost_share && steps < constants_.most_searches) {
      correspondences_.find_visible(x_);
      ++steps;
    }
    for (int i = 1; i < constants_.iterations; ++i, ++steps) {
      const double progress = static_cast<double>(i) / (constants_.iterations - 1);
      nonrigid_step(progress, 2 * i < constants_.iterations, i == constants_.fitting_iteration);
    }
    shape_.keep_planes(correspondences_.found(), x_);
    Found found = observe();
    found.iterations = steps;
    found.aligned = aligned;
    return found;
  } catch (...) {
    shape_.undo_frame();
    throw;
  }
}

/// X = V + prediction (V - V'), from the last two frames.
void SurfaceTracking::predict() {
  for (std::size_t v = 0; v < x_.size(); ++v) {
    x_[v] = last_[v] + constants_.prediction * (last_[v] - before_[v]);
  }
}

/// Finds correspondences for X, and then X for these. Returns the share of the measured points that
/// no vertex explains, in early steps.
double SurfaceTracking::nonrigid_step(double progress, bool is_early, bool fits_modes) {
  const double weight = constants_.weight_at(progress);
  const double cloth_weight = constants_.cloth_weight_at(progress);
  const Search of_bodies = {is_early ? constants_.wide_radius : constants_.narrow_radius,
                            constants_.scale,
                            constants_.side,
                            weight,
                            1,
                            constants_.kept_distance};
  const Search of_cloth = {is_early ? constants_.wide_radius : constants_.narrow_cloth_radius,
                           constants_.scale, constants_.side, cloth_weight};
  const auto found = correspondences_.find(x_, of_bodies, of_cloth);
  correspondences_.draw_out_of_free_space(x_, cloth_weight);
  const double lost =
      is_early ? correspondences_.draw_towards_unexplained(x_, weight, cloth_weight) : 0;
  const auto reaches = correspondences_.find_reaches(x_);
  const NonrigidStep::Measured measured = {found, reaches, weight, cloth_weight};
  if (!shape_.take(measured, fits_modes, x_)) return 0;
  // The surface turns while it moves, and cloth slides as its triangles do. The first points are
  // too wrong for more than one step.
  const int fits = progress == 0     ? 1
                   : reaches.empty() ? constants_.rotation_fits
                                     : constants_.cloth_rotation_fits;
  for (int fit = 1; fit < fits; ++fit) shape_.take(measured, false, x_);
  return lost;
}

/// Which vertices have a measured point in the end.
SurfaceTracking::Found SurfaceTracking::observe() {
  const auto found =
      correspondences_.find(x_, {constants_.observed_distance, constants_.scale, constants_.side, 1,
                                 1, constants_.observed_distance});
  auto agreements = correspondences_.compare(x_);
  for (std::size_t v = 0; v < observed_.size(); ++v) {
    observed_[v] = shape_.moved()[v] != 0 && found[v].weight > 0 ? 1 : 0;
  }
  return {x_, observed_, 0, std::move(agreements)};
}

void SurfaceTracking::remember(Field completed, bool moves) {
  std::ranges::copy(moves ? Field(last_) : completed, before_.begin());
  std::ranges::copy(completed, last_.begin());
  if (moves) is_first_ = false;
  shape_.remember(last_);
}

void SurfaceTracking::place(Field frame) {
  std::ranges::copy(frame, last_.begin());
  std::ranges::copy(frame, before_.begin());
  is_first_ = false;
  shape_.remember(last_);
}

std::size_t SurfaceTracking::memory_size() const {
  return sizeof(std::uint8_t) + before_.size() * 3 * sizeof(double) + shape_.memory_size();
}

void SurfaceTracking::write_memory(Writer& writer) const {
  writer.write(static_cast<std::uint8_t>(is_first_ ? 1 : 0));
  writer.write(before_);
  shape_.write_memory(writer);
}

SurfaceTracking::Memory SurfaceTracking::read_memory(Reader& reader) const {
  Memory memory;
  const auto is_first = reader.read<std::uint8_t>();
  memory.is_first = is_first != 0;
  memory.before.resize(before_.size());
  reader.read(memory.before);
  if (is_first > 1 || !std::ranges::all_of(memory.before, is_in_range<double>)) {
    refuse_state("does not contain a valid last frame but one");
  }
  memory.shape = shape_.read_memory(reader);
  return memory;
}

void SurfaceTracking::recall(const Memory& memory, Field last) {
  std::ranges::copy(last, last_.begin());
  std::ranges::copy(memory.before, before_.begin());
  is_first_ = memory.is_first;
  shape_.recall(memory.shape, last_);
}

}  // namespace dynmesh
