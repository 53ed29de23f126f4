#include "surface_fit/surface_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "surface_fit/cloth.hpp"

namespace dynmesh {
namespace {

/// Moves a frame, and returns the largest distance that a vertex moved.
double move_by(const Eigen::Isometry3d& motion, std::span<Vector3<double>> frame) {
  double largest = 0;
  for (auto& x : frame) {
    const Eigen::Vector3d moved = motion * to_eigen(x);
    largest = std::max(largest, (moved - to_eigen(x)).squaredNorm());
    x = from_eigen(moved);
  }
  return std::sqrt(largest);
}

/// X + share (X - Y) replaces X, and X replaces Y.
void carry_on(std::span<Vector3<double>> x, std::span<Vector3<double>> y, double share) {
  for (std::size_t v = 0; v < x.size(); ++v) {
    const auto now = x[v];
    x[v] = now + share * (now - y[v]);
    y[v] = now;
  }
}

}  // namespace

SurfaceTracking::SurfaceTracking(std::vector<Triangle> faces, const Topology& topology,
                                 Workers& workers, Field first_frame,
                                 const TrackingConstants& constants, const TrainingFrames& training,
                                 bool has_uncertainty, double epsilon)
    : constants_(constants),
      faces_(std::move(faces)),
      mean_edge_(mean_edge_length(topology.cells, first_frame)),
      materials_(find_materials(faces_, topology, first_frame, constants_)),
      shape_(faces_, topology, workers, constants_, first_frame, mean_edge_, materials_, training,
             has_uncertainty, epsilon),
      matches_(faces_, topology, workers, constants_, first_frame, mean_edge_, materials_,
               shape_.rotations().clusters()),
      all_slide_(std::ranges::all_of(materials_, &Material::slides)),
      any_slides_(std::ranges::any_of(materials_, &Material::slides)),
      last_(first_frame.begin(), first_frame.end()),
      before_(last_),
      x_(last_),
      observed_(last_.size()) {}

SurfaceTracking::Found SurfaceTracking::track(const PointScan& measurement,
                                              std::span<const Landmark> landmarks,
                                              int fewest_iterations, double times_weight) {
  shape_.begin_frame();
  matches_.begin(measurement);
  begin_where_points_are();
  factored_weight_ = 0;
  const int iterations = approach(fewest_iterations);
  std::vector<Vector3<double>> before = x_;
  for (int left = iterations; left-- > 0;) {
    if (!iterate(left, times_weight * constants_.last_weight, landmarks)) break;
    // The last iteration begins where the one before it ended.
    if (left > 1) carry_on(x_, before, constants_.prediction);
  }
  shape_.keep_rows(matches_.rows(), x_);
  Found found = observe();
  found.iterations = iterations;
  return found;
}

/// Begins with the frame that the last two lead to, or with the last one if it is clearly nearer to
/// the points: a step that brought the surface to where it was all the time leads past it.
void SurfaceTracking::begin_where_points_are() {
  const Search search = {.is_sparse = !any_slides_, .scale = constants_.radius / 2};
  const auto distance_from = [&](Field x) {
    matches_.find(x, search);
    return matches_.distance_of(constants_.far_share);
  };
  const double distance_of_last = distance_from(last_);
  std::ranges::copy(last_, x_.begin());
  auto before = before_;
  carry_on(x_, before, constants_.prediction);
  constexpr double far = 1;  // in mean edges, as of points
  if (distance_from(x_) > distance_of_last + far) {
    std::ranges::copy(last_, x_.begin());
  }
}

/// Moves X as a whole to the points until it lies still, and returns how many iterations are left:
/// the farther the points are, the more slowly their weight grows.
int SurfaceTracking::approach(int fewest_iterations) {
  const Search search = {
      .walked = constants_.radius, .is_sparse = !any_slides_, .scale = constants_.radius / 2};
  for (int step = 0; step < constants_.most_iterations; ++step) {
    const Matches::Rows& rows = matches_.find(x_, search);
    // Cloth bends while it moves, which its planes cannot tell from a rigid motion along it.
    if (all_slide_ || rows.size() < constants_.fewest) break;
    if (move_by(fit_to_planes(rows, x_), x_) < constants_.resolution * mean_edge_) break;
  }
  if (any_slides_) return constants_.most_iterations;
  const double distance = matches_.distance_of(constants_.far_share);
  const double wanted = fewest_iterations + constants_.iterations_per_edge * distance;
  return static_cast<int>(std::min<double>(std::ceil(wanted), constants_.most_iterations));
}

/// Matches the points with X, and then finds X for these and the landmarks; `left` iterations are
/// to follow. Returns false if there are neither.
bool SurfaceTracking::iterate(int left, double last_weight, std::span<const Landmark> landmarks) {
  const double weight =
      std::max(constants_.first_weight, last_weight * std::pow(constants_.weight_growth, -left));
  const bool arrives = left < constants_.final_iterations;
  const Matches::Rows& rows = matches_.find(x_, {.walked = constants_.resolution,
                                                 .weight = weight,
                                                 .looks_farther = !arrives,
                                                 .is_sparse = !any_slides_ && !arrives});
  if (!(weight < constants_.factored_growth * factored_weight_)) {
    const double growth = std::min(constants_.factored_growth, last_weight / weight);
    shape_.factorize(rows, landmarks, std::sqrt(growth));
    factored_weight_ = weight;
  }
  return shape_.take(rows, landmarks, left == 1 ? constants_.first_weight / weight : 0, x_);
}

/// Which vertices have a measured point in the end, and how far the points are.
SurfaceTracking::Found SurfaceTracking::observe() {
  matches_.follow(x_);
  std::ranges::fill(observed_, std::uint8_t{0});
  matches_.for_each_near([&](const Place& place) {
    for (std::size_t s = 0; s < 3; ++s) {
      if (place.shares[s] > 0) observed_[place.corners[s]] = 1;
    }
  });
  return {x_, observed_, 0, matches_.agreements()};
}

void SurfaceTracking::remember(Field completed, bool moves) {
  std::ranges::copy(moves ? Field(last_) : completed, before_.begin());
  std::ranges::copy(completed, last_.begin());
  shape_.remember(last_);
}

void SurfaceTracking::place(Field frame) {
  shape_.begin_frame();
  remember(frame, false);
}

SurfaceTracking::Found SurfaceTracking::compare_last(const PointScan& measurement) {
  std::ranges::copy(last_, x_.begin());
  matches_.begin(measurement);
  matches_.find(x_, {.scale = constants_.radius / 2});
  return observe();
}

void SurfaceTracking::bend(std::span<const Landmark> landmarks, int steps) {
  std::ranges::copy(last_, x_.begin());
  shape_.factorize({}, landmarks, 1);
  std::vector<Landmark> moving(landmarks.begin(), landmarks.end());
  for (int step = 0; step < steps; ++step) {
    const double share = static_cast<double>(step + 1) / steps;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const auto& start = last_[landmarks[i].vertex];
      moving[i].target = start + share * (landmarks[i].target - start);
    }
    shape_.take({}, moving, 0, x_);
  }
  const std::vector<Vector3<double>> bent = x_;
  place(bent);
  forget_shape();
}

void SurfaceTracking::write_memory(Writer& writer) const {
  writer.write(before_);
  shape_.write_memory(writer);
}

void SurfaceTracking::read_memory(Reader& reader, Field last) {
  std::ranges::copy(last, last_.begin());
  reader.read(before_);
  if (!are_in_range(before_)) {
    refuse_state("does not contain a valid last frame but one");
  }
  shape_.read_memory(reader, last_);
}

}  // namespace dynmesh
