#include "surface_fit/prediction.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

/// (components,) the numbers of the groups of those that ties hold together, from 0 on.
std::vector<std::size_t> groups_of(const Topology& topology, const WeightedTies& ties) {
  std::vector<std::size_t> group(topology.report.components);
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (std::size_t t = 0; t < ties.between().size(); ++t) {
    const Tie& tie = ties.between()[t];
    const std::size_t a = group[at(topology.component[tie.i])];
    const std::size_t b = group[at(topology.component[tie.j])];
    if (a != b && ties.hold[t] != 0) std::ranges::replace(group, std::max(a, b), std::min(a, b));
  }
  return group;
}

/// Moves each component as it moved in the last frame.
std::vector<Vector3> moved_on(const Memory& memory,
                              const std::vector<std::vector<Index>>& components) {
  std::vector<Vector3> x(memory.last.size());
  for (const auto& vertices : components) {
    const RigidMotion motion = fit_rigid_motion(vertices, memory.tracking.before, memory.last);
    for (const Index v : vertices) x[at(v)] = motion.apply(memory.last[at(v)]);
  }
  return x;
}

/// Lets the components that ties hold together begin where their points show them: where they were,
/// where all are led to, or where the rigid motion of each leads, as they may move farther in a
/// frame than they are long.
void predict_components(const Memory& memory, Field led_to, const ShapeModel& model,
                        const TrackingConstants& constants, const WeightedTies& ties,
                        const PointScan& scan, Prediction& prediction) {
  std::vector<std::vector<Index>> components(model.topology.report.components);
  for (std::size_t v = 0; v < prediction.x.size(); ++v) {
    components[at(model.topology.component[v])].push_back(static_cast<Index>(v));
  }
  const auto moved = moved_on(memory, components);
  const auto group = groups_of(model.topology, ties);
  std::vector<std::vector<Index>> together(components.size());
  for (std::size_t c = 0; c < components.size(); ++c) {
    auto& vertices = together[group[c]];
    vertices.insert(vertices.end(), components[c].begin(), components[c].end());
  }
  const auto choose = [&](std::span<const Index> vertices) {
    std::vector<Index> chosen;
    for (const Index v : vertices) {
      if (prediction.visibility.is_seen[at(v)] != 0) chosen.push_back(v);
    }
    if (chosen.empty()) return;
    const std::size_t every = 1 + chosen.size() / constants.vertices_of_start;
    const auto distance_from_points = [&](Field x) {
      double sum = 0;
      double n = 0;
      for (std::size_t i = 0; i < chosen.size(); i += every) {
        const double distance = scan.distance(x[at(chosen[i])]) / model.mean_edge;
        sum += std::min(distance, constants.radius);
        n += 1;
      }
      return sum / n;
    };
    double least = distance_from_points(prediction.x) - constants.own_start;
    Field best = {};
    for (const Field start : {Field(moved), led_to, Field(memory.last)}) {
      const double distance = distance_from_points(start);
      if (!(distance < least)) continue;
      least = distance;
      best = start;
    }
    if (best.empty()) return;
    for (const Index v : vertices) prediction.x[at(v)] = best[at(v)];
  };
  for (const auto& vertices : together) choose(vertices);
}

}  // namespace

void extrapolate(std::span<Vector3> x, std::span<Vector3> before, double share) {
  for (std::size_t v = 0; v < x.size(); ++v) {
    const auto now = x[v];
    x[v] = now + share * (now - before[v]);
    before[v] = now;
  }
}

Prediction predict(const Memory& memory, const ShapeModel& model,
                   const TrackingConstants& constants, std::size_t n_points,
                   const WeightedTies& ties, SurfaceMatcher& matcher, MatchedPoints& points) {
  std::vector<Vector3> led_to = memory.last;
  auto before = memory.tracking.before;
  extrapolate(led_to, before, constants.prediction);
  Prediction prediction{{}, matcher.visibility_of(led_to, *points.scan)};
  // Nothing is walked: where a point begins would depend on the order of the points.
  const MatchOptions options = {.points = n_points, .scale = constants.radius / 2};
  const auto distance_from = [&](Field x) {
    const auto rows = matcher.match(x, prediction.visibility, options, points);
    return matcher.distance_of(constants.far_share, rows);
  };
  constexpr double far = 1;  // in mean edges, as of points
  const double distance = distance_from(led_to);
  const bool stays = distance > far && distance > distance_from(memory.last) + far;
  prediction.x = stays ? memory.last : led_to;
  if (model.topology.report.components > 1 && points.scan->size() > 0) {
    predict_components(memory, led_to, model, constants, ties, *points.scan, prediction);
  }
  return prediction;
}

}  // namespace dynmesh
