#include "tracking/surface_tracking.hpp"

#include <algorithm>
#include <utility>

#include "support/geometry.hpp"
#include "tracking/cloth.hpp"
#include "tracking/rigid_step.hpp"

namespace dynmesh {

SurfaceTracking::SurfaceTracking(std::vector<Triangle> faces, const Topology& topology,
                                 Workers& workers, const TrackingConstants& constants,
                                 TrainingFrames training, bool has_uncertainty, double epsilon)
    : constants_(constants),
      faces_(std::move(faces)),
      topology_(topology),
      matches_(faces_, topology, workers, constants_),
      shape_(topology, workers, constants_, std::move(training), has_uncertainty, epsilon),
      last_(topology.cells.size()),
      before_(topology.cells.size()),
      x_(topology.cells.size()),
      observed_(topology.cells.size()) {}

void SurfaceTracking::reset(Field first_frame) {
  const double mean_edge = mean_edge_length(topology_.cells, first_frame);
  const auto is_cloth = find_cloth(faces_, topology_.component, first_frame, constants_);
  shape_.reset(faces_, first_frame, mean_edge, is_cloth);
  matches_.reset(first_frame, mean_edge, is_cloth, shape_.clusters());
  mean_edge_ = mean_edge;
  is_all_cloth_ = std::ranges::count(is_cloth, 0) == 0;
  any_cloth_ = std::ranges::count(is_cloth, 1) > 0;
  std::ranges::copy(first_frame, last_.begin());
  std::ranges::copy(first_frame, before_.begin());
}

SurfaceTracking::Found SurfaceTracking::track(const PointScan& measurement) {
  shape_.begin_frame();
  try {
    predict();
    matches_.begin(measurement);
    const int iterations = approach();
    for (int i = 0; i < iterations; ++i) {
      iterate(iterations - i - 1, i > 0 && any_cloth_ ? constants_.cloth_fits : 1);
    }
    Found found = observe(measurement);
    found.iterations = iterations;
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

/// Moves X as a whole to the points, unless few are near, and returns how many iterations are left:
/// the farther the points are, the more slowly their weight grows.
int SurfaceTracking::approach() {
  const Search search = {constants_.wide_radius, 1, 1, constants_.rigid_scale};
  const SurfaceRows* rows = &matches_.find(x_, search);
  // Cloth bends while it moves, which its planes cannot tell from a rigid motion along it.
  for (int step = 0; step < constants_.rigid_steps && !is_all_cloth_; ++step) {
    if (rows->rows.size() < constants_.least_rigid) break;
    move_by(fit_to_planes(rows->rows, x_, constants_.rigid_caution), x_);
    rows = &matches_.find(x_, search);
  }
  const double distance = matches_.distance_of(constants_.far_share);
  return std::clamp(static_cast<int>(std::ceil(constants_.fewest_iterations +
                                               constants_.iterations_per_edge * distance)),
                    any_cloth_ ? constants_.fewest_cloth_iterations : constants_.fewest_iterations,
                    constants_.most_iterations);
}

/// Matches the points with X, and then finds X for these; `left` iterations are to follow.
void SurfaceTracking::iterate(int left, int fits) {
  const double weight = constants_.weight_before(left);
  SurfaceRows& rows = matches_.find(
      x_, {constants_.radius_before(left), weight, constants_.cloth_weights * weight});
  shape_.factorize(rows, {});
  const bool fits_modes = left == 1;
  for (int fit = 0; fit < fits; ++fit) {
    if (!shape_.take(rows, {}, fits_modes && fit == 0 ? constants_.mode_weight / weight : 0, x_))
      return;
  }
  if (left == 0) shape_.keep_rows(rows, x_);
}

/// Which vertices have a measured point in the end, and how far the points are.
SurfaceTracking::Found SurfaceTracking::observe(const PointScan& measurement) {
  std::ranges::fill(observed_, std::uint8_t{0});
  const auto& rows =
      matches_.find(x_, {constants_.observed_distance, 1, 1, constants_.rigid_scale});
  for (const SurfaceRow& row : rows.rows) {
    for (std::size_t s = 0; s < 3; ++s) {
      if (row.shares[s] > 0) observed_[row.corners[s]] = 1;
    }
  }
  auto agreements = compare(measurement, matches_.nearest(), matches_.normals(),
                            matches_.is_sheet(), mean_edge_, constants_);
  return {x_, observed_, 0, std::move(agreements)};
}

void SurfaceTracking::remember(Field completed, bool moves) {
  std::ranges::copy(moves ? Field(last_) : completed, before_.begin());
  std::ranges::copy(completed, last_.begin());
  shape_.remember(last_);
}

void SurfaceTracking::place(Field frame) {
  std::ranges::copy(frame, last_.begin());
  std::ranges::copy(frame, before_.begin());
  shape_.remember(last_);
}

std::size_t SurfaceTracking::memory_size() const {
  return before_.size() * 3 * sizeof(double) + shape_.memory_size();
}

void SurfaceTracking::write_memory(Writer& writer) const {
  writer.write(before_);
  shape_.write_memory(writer);
}

SurfaceTracking::Memory SurfaceTracking::read_memory(Reader& reader) const {
  Memory memory;
  memory.before.resize(before_.size());
  reader.read(memory.before);
  if (!std::ranges::all_of(memory.before, is_in_range<double>)) {
    refuse_state("does not contain a valid last frame but one");
  }
  memory.shape = shape_.read_memory(reader);
  return memory;
}

void SurfaceTracking::recall(const Memory& memory, Field last) {
  std::ranges::copy(last, last_.begin());
  std::ranges::copy(memory.before, before_.begin());
  shape_.recall(memory.shape, last_);
}

}  // namespace dynmesh
