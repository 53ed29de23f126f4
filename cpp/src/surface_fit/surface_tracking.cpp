#include "surface_fit/surface_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "surface_fit/cloth.hpp"
#include "surface_fit/joint_motion.hpp"
#include "surface_fit/lost_components.hpp"

namespace dynmesh {
namespace {

constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

/// X + share (X - Y) replaces X, and X replaces Y.
void carry_on(std::span<Vector3> x, std::span<Vector3> y, double share) {
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
                                 bool has_uncertainty, double epsilon,
                                 std::vector<Material> materials)
    : constants_(constants),
      faces_(std::move(faces)),
      model_(topology, faces_, first_frame, training, epsilon, workers),
      materials_(materials.empty() ? find_materials(faces_, topology, first_frame, constants_)
                                   : std::move(materials)),
      shape_(model_, faces_, workers, constants_, materials_, has_uncertainty),
      matches_(faces_, topology, workers, constants_, first_frame, model_.mean_edge, materials_,
               model_.clusters()),
      all_slide_(std::ranges::all_of(materials_, &Material::slides)),
      any_slides_(std::ranges::any_of(materials_, &Material::slides)),
      points_at_first_(any_slides_ ? all : constants_.points_of_vertex * first_frame.size()),
      rigid_points_(
          std::min(points_at_first_, constants_.rigid_points * topology.report.components)),
      x_(first_frame.begin(), first_frame.end()),
      observed_(first_frame.size()) {}

void SurfaceTracking::begin(Memory& memory) const {
  memory.tracking.before = memory.last;
  shape_.begin(memory);
}

SurfaceTracking::Found SurfaceTracking::fit(const Memory& memory, const PointScan& measurement,
                                            const Guides& guides, Memory& next) {
  return observe(find(memory, measurement, guides, next));
}

int SurfaceTracking::find(const Memory& memory, const PointScan& measurement, const Guides& guides,
                          Memory& next) {
  start(memory, measurement, next);
  predict(memory, measurement);
  int iterations = approach(memory, guides.fewest_iterations);
  if (find_lost()) iterations = approach(memory, guides.fewest_iterations);
  std::vector<Vector3> before = x_;
  for (int left = iterations; left-- > 0;) {
    if (!iterate(left, left == 1, constants_.settled, guides, memory, next)) break;
    // The last iteration begins where the one before it ended.
    if (left > 1) carry_on(x_, before, constants_.prediction);
  }
  return iterations;
}

std::span<Vector3> SurfaceTracking::start(const Memory& memory, const PointScan& measurement,
                                          Memory& next) {
  next.q = memory.q;
  next.fit = memory.fit;
  shape_.find_rest_shape(memory.fit);
  matches_.begin(measurement);
  factored_weight_ = 0;
  return x_;
}

SurfaceTracking::Found SurfaceTracking::settle(const Memory& memory, int most_iterations,
                                               int iterations, Memory& next) {
  matches_.look(x_);
  double largest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_iterations && !lies_still(largest); ++i) {
    const std::vector<Vector3> before = x_;
    iterate(0, i == 0, constants_.whole_settled, {}, memory, next);
    largest = 0;
    for (std::size_t v = 0; v < x_.size(); ++v) {
      largest = std::max(largest, squared_norm(x_[v] - before[v]));
    }
  }
  if (most_iterations == 0 && shape_.has_errors()) {
    matches_.find(x_, {.walked = constants_.resolution, .weight = constants_.last_weight});
  } else if (most_iterations == 0) {
    matches_.locate(x_, constants_.resolution);
  }
  return observe(iterations);
}

/// Begins with the frame that the last two lead to, or with the last one if it is clearly nearer to
/// the points: a step that brought the surface to where it was all the time leads past it.
void SurfaceTracking::predict(const Memory& memory, const PointScan& measurement) {
  // Nothing is walked: where a point begins would depend on the order of the points.
  const Search search = {.points = rigid_points_, .scale = constants_.radius / 2};
  const auto distance_from = [&](Field x) {
    matches_.find(x, search);
    return matches_.distance_of(constants_.far_share);
  };
  std::vector<Vector3> led_to = memory.last;
  auto before = memory.tracking.before;
  carry_on(led_to, before, constants_.prediction);
  matches_.look(led_to);
  const double distance_of_last = distance_from(memory.last);
  constexpr double far = 1;  // in mean edges, as of points
  const bool stays = distance_from(led_to) > distance_of_last + far;
  x_ = stays ? memory.last : led_to;
  if (model_.topology.report.components > 1) predict_components(memory, led_to, measurement);
}

/// (components,) the numbers of the groups of those that ties hold together, from 0 on.
std::vector<std::size_t> SurfaceTracking::find_groups(const Memory& memory) {
  LearnedTies& ties = shape_.ties();
  ties.set_weights(memory.departures);
  std::vector<std::size_t> group(model_.topology.report.components);
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (std::size_t t = 0; t < ties.between().size(); ++t) {
    const Tie& tie = ties.between()[t];
    const std::size_t a = group[at(model_.topology.component[tie.i])];
    const std::size_t b = group[at(model_.topology.component[tie.j])];
    if (a != b && ties.holds(t)) std::ranges::replace(group, std::max(a, b), std::min(a, b));
  }
  return group;
}

/// Lets the components that ties hold together begin where their points show them: where they were,
/// where all are led to, or where the rigid motion of each leads, as they may move farther in a
/// frame than they are long.
void SurfaceTracking::predict_components(const Memory& memory, Field led_to,
                                         const PointScan& measurement) {
  std::vector<std::vector<Index>> members(model_.topology.report.components);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    members[at(model_.topology.component[v])].push_back(static_cast<Index>(v));
  }
  std::vector<Vector3> moved_on(x_.size());
  for (const auto& vertices : members) {
    const RigidMotion motion = fit_rigid_motion(vertices, memory.tracking.before, memory.last);
    for (const Index v : vertices) moved_on[at(v)] = motion.apply(memory.last[at(v)]);
  }
  const auto group = find_groups(memory);
  std::vector<std::vector<Index>> together(members.size());
  for (std::size_t c = 0; c < members.size(); ++c) {
    auto& vertices = together[group[c]];
    vertices.insert(vertices.end(), members[c].begin(), members[c].end());
  }
  const auto seen = matches_.seen();
  const auto choose = [&](std::span<const Index> vertices) {
    std::vector<Index> chosen;
    for (const Index v : vertices) {
      if (seen[at(v)] != 0) chosen.push_back(v);
    }
    if (chosen.empty()) return;
    const std::size_t every = 1 + chosen.size() / constants_.vertices_of_start;
    const auto distance_from_points = [&](Field x) {
      double sum = 0;
      double n = 0;
      for (std::size_t i = 0; i < chosen.size(); i += every) {
        const double distance = measurement.distance(x[at(chosen[i])]) / model_.mean_edge;
        sum += std::min(distance, constants_.radius);
        n += 1;
      }
      return sum / n;
    };
    double least = distance_from_points(x_) - constants_.own_start;
    Field best = {};
    for (const Field start : {Field(moved_on), led_to, Field(memory.last)}) {
      const double distance = distance_from_points(start);
      if (!(distance < least)) continue;
      least = distance;
      best = start;
    }
    if (best.empty()) return;
    for (const Index v : vertices) x_[at(v)] = best[at(v)];
  };
  if (measurement.size() == 0) return;
  for (const auto& vertices : together) choose(vertices);
}

/// What ties keep while components move rigidly: the differences of the last frame, and a share of
/// those of frame 0, since the points of many frames may tell little of some directions.
std::vector<Vector3> SurfaceTracking::wanted_differences(const Memory& memory) {
  std::vector<Vector3> differences;
  for (const Tie& tie : shape_.ties().between()) {
    const auto last = memory.last[tie.i] - memory.last[tie.j];
    const auto first = LearnedTies::kept(tie, memory.q);
    differences.push_back(last + constants_.tie_pull * (first - last));
  }
  return differences;
}

/// Moves the components of X rigidly to the points until they lie still, first as one, then each to
/// its own points. Returns how many iterations are left: the farther the points are, the more
/// slowly their weight grows.
int SurfaceTracking::approach(const Memory& memory, int fewest_iterations) {
  const Search search = {
      .walked = constants_.radius, .points = rigid_points_, .scale = constants_.radius / 2};
  LearnedTies& ties = shape_.ties();
  auto differences = wanted_differences(memory);
  const double reach = constants_.radius * model_.mean_edge;
  const auto is_near = [&](const Tie& tie) { return squared_norm(tie.kept) <= reach * reach; };
  double stiffness = std::ranges::any_of(ties.between(), is_near) ? constants_.first_stiffness : 1;
  for (int step = 0; step < constants_.most_iterations; ++step) {
    const Matches::Rows& rows = matches_.find(x_, search);
    // Cloth bends while it moves, which its planes cannot tell from a rigid motion along it.
    if (all_slide_ || rows.size() < constants_.fewest) break;
    ties.set_weights(ties.departed(x_, differences, memory.departures));
    const double moved = move_jointly(rows, ties.between(), reach, stiffness, model_.topology,
                                      constants_, x_, differences);
    if (stiffness == 1 && lies_still(moved)) break;
    stiffness = std::max(1.0, stiffness / constants_.stiffness_growth);
  }
  matches_.look(x_);
  if (any_slides_) return constants_.most_iterations;
  const double distance = matches_.distance_of(constants_.far_share);
  const double wanted = fewest_iterations + constants_.iterations_per_edge * distance;
  return static_cast<int>(std::min<double>(std::ceil(wanted), constants_.most_iterations));
}

/// (components,) 1 for those that have their points, of which sensors should see nothing, or that
/// are tied to another one with points, and so are where this holds them.
std::vector<std::uint8_t> SurfaceTracking::find_placed() const {
  const auto is_measured = matches_.find_measured();
  auto is_placed = is_measured;
  const auto ties = shape_.ties().between();
  for (std::size_t t = 0; t < ties.size(); ++t) {
    const std::size_t a = at(model_.topology.component[ties[t].i]);
    const std::size_t b = at(model_.topology.component[ties[t].j]);
    if (is_measured[a] == is_measured[b] || !shape_.ties().holds(t)) continue;
    is_placed[a] = is_placed[b] = 1;
  }
  return is_placed;
}

/// Moves the components that are lost to points that no component explains, the largest first.
/// Returns whether any was found.
bool SurfaceTracking::find_lost() {
  const auto is_lost = [](std::uint8_t is_placed) { return is_placed == 0; };
  if (std::ranges::none_of(find_placed(), is_lost)) return false;
  matches_.locate(x_, constants_.resolution);
  const auto is_placed = find_placed();
  OrientedPoints unexplained = matches_.unexplained();
  std::vector<std::vector<std::size_t>> seen(is_placed.size());
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const std::size_t component = at(model_.topology.component[v]);
    if (is_placed[component] == 0 && matches_.seen()[v] != 0) seen[component].push_back(v);
  }
  std::vector<std::size_t> order(seen.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t c) { return seen[c].size(); });
  bool any = false;
  for (const std::size_t component : order) {
    OrientedPoints part;
    const std::size_t every = 1 + seen[component].size() / constants_.vertices_of_search;
    for (std::size_t i = 0; i < seen[component].size(); i += every) {
      part.points.push_back(x_[seen[component][i]]);
      part.normals.push_back(matches_.normals()[seen[component][i]]);
    }
    const auto motion = found_among(part, unexplained, model_.mean_edge, constants_);
    if (!motion) continue;
    any = true;
    for (std::size_t v = 0; v < x_.size(); ++v) {
      if (at(model_.topology.component[v]) != component) continue;
      x_[v] = from_eigen(*motion * to_eigen(x_[v]));
    }
  }
  if (any) matches_.look(x_);
  return any;
}

/// Matches the points with X, and then finds X for these and the landmarks; `left` iterations are
/// to follow. Returns false if there are neither.
bool SurfaceTracking::iterate(int left, bool fits_modes, double settled, const Guides& guides,
                              const Memory& memory, Memory& next) {
  const double last_weight = guides.times_weight * constants_.last_weight;
  const double weight =
      std::max(constants_.first_weight, last_weight * std::pow(constants_.weight_growth, -left));
  const bool arrives = left < constants_.final_iterations;
  const Matches::Rows& rows = matches_.find(x_, {.walked = constants_.resolution,
                                                 .weight = weight,
                                                 .looks_farther = !arrives,
                                                 .points = arrives ? all : points_at_first_});
  shape_.turn_to(x_, memory.departures, next);
  if (!(weight < constants_.factored_growth * factored_weight_)) {
    const double growth = std::min(constants_.factored_growth, last_weight / weight);
    shape_.factorize(rows, guides.landmarks, std::sqrt(growth));
    factored_weight_ = weight;
  }
  const double mode_weights = fits_modes ? constants_.first_weight / weight : 0;
  return shape_.take({rows, guides.landmarks, guides.yields_beyond, settled, mode_weights},
                     memory.m, x_, next);
}

SurfaceTracking::Found SurfaceTracking::observe(int iterations) {
  shape_.prepare_errors(matches_.rows(), x_);
  return compared(iterations);
}

/// Which vertices have a measured point after so many iterations, and how far the points are.
SurfaceTracking::Found SurfaceTracking::compared(int iterations) {
  matches_.follow(x_);
  std::ranges::fill(observed_, std::uint8_t{0});
  matches_.for_each_near([&](const Place& place) {
    for (std::size_t s = 0; s < 3; ++s) {
      if (place.shares[s] > 0) observed_[place.corners[s]] = 1;
    }
  });
  // What few points lie at a component that should have many is not observed.
  const auto is_measured = matches_.find_measured();
  const auto is_placed = find_placed();
  std::vector<std::vector<std::size_t>> lost(is_placed.size());
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const std::size_t component = at(model_.topology.component[v]);
    if (is_measured[component] == 0) observed_[v] = 0;
    if (is_placed[component] == 0) lost[component].push_back(v);
  }
  const auto largest = std::ranges::max_element(lost, {}, &std::vector<std::size_t>::size);
  return {x_, observed_, iterations, matches_.agreements(), *largest};
}

void SurfaceTracking::remember(const Memory& memory, bool moves, Memory& next) {
  std::ranges::copy(moves ? memory.last : next.last, next.tracking.before.begin());
  shape_.remember(next.last, next);
}

void SurfaceTracking::place(Field frame, Memory& memory) {
  for (auto* of : {&memory.last, &memory.tracking.before}) std::ranges::copy(frame, of->begin());
  shape_.remember(memory.last, memory);
}

SurfaceTracking::Found SurfaceTracking::compare(Field frame, const PointScan& measurement) {
  std::ranges::copy(frame, x_.begin());
  matches_.begin(measurement);
  matches_.look(x_);
  matches_.locate(x_, 0);
  return compared(0);
}

void SurfaceTracking::bend(const Guides& guides, int steps, Memory& memory) {
  x_ = memory.last;
  Memory bent = memory;
  shape_.factorize({}, guides.landmarks, 1);
  std::vector<Landmark> moving(guides.landmarks.begin(), guides.landmarks.end());
  for (int step = 0; step < steps; ++step) {
    const double share = static_cast<double>(step + 1) / steps;
    for (std::size_t i = 0; i < moving.size(); ++i) {
      const auto& start = memory.last[moving[i].vertex];
      moving[i].target = start + share * (guides.landmarks[i].target - start);
    }
    shape_.turn_to(x_, memory.departures, bent);
    shape_.take({{}, moving, guides.yields_beyond, constants_.settled}, memory.m, x_, bent);
  }
  place(x_, memory);
  forget_shape(memory);
}

}  // namespace dynmesh
