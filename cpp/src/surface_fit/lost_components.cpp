#include "surface_fit/lost_components.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"
#include "base/rigid_motion.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {
namespace {

constexpr std::size_t most_places = 6;
constexpr int alignment_steps = 15;
/// The share of a component that must have points where it is found.
constexpr double least_share = 0.6;

/// Points with normals of unit length, or of 0 where that is not known.
struct OrientedPoints {
  std::vector<Vector3> points;
  std::vector<Vector3> normals;
};

/// The points that are far from a surface.
OrientedPoints unexplained_of(const MatchedPoints& points) {
  OrientedPoints far;
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    if (!points.is_far(points.places[i])) continue;
    const auto& [position, normal, is_undecided] = points.points[i];
    far.points.push_back(position);
    far.normals.push_back(is_undecided ? Vector3{} : normal);
  }
  return far;
}

/// The shifts that bring the middle of a component to clusters of points of about its size.
std::vector<Vector3> shifts_to(const OrientedPoints& unexplained, const Vector3& middle,
                               double size, std::size_t fewest) {
  std::vector<std::size_t> order(unexplained.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto distance = [&](std::size_t i) { return squared_norm(unexplained.points[i] - middle); };
  std::ranges::stable_sort(order, {}, distance);
  std::vector<Vector3> shifts;
  while (!order.empty() && shifts.size() < most_places) {
    const auto nearest = unexplained.points[order.front()];
    Vector3 sum;
    std::size_t n = 0;
    std::erase_if(order, [&](std::size_t i) {
      const bool is_near = squared_norm(unexplained.points[i] - nearest) <= 4 * size * size;
      if (is_near) sum = sum + unexplained.points[i];
      n += is_near ? 1 : 0;
      return is_near;
    });
    if (n >= fewest) shifts.push_back((1 / static_cast<double>(n)) * sum - middle);
  }
  return shifts;
}

/// A part, among points.
class Placing {
 public:
  Placing(const OrientedPoints& part, const OrientedPoints& unexplained, double mean_edge,
          const TrackingConstants& constants)
      : part_(part),
        unexplained_(unexplained),
        mean_edge_(mean_edge),
        constants_(constants),
        tree_(arrays_of(unexplained.points)) {}

  /// Moves the part from `motion` to the points around it.
  [[nodiscard]] Eigen::Isometry3d aligned(Eigen::Isometry3d motion) const {
    for (int step = 0; step < alignment_steps; ++step) {
      std::vector<Vector3> x;
      std::vector<SurfaceRow> rows;
      for (std::size_t i = 0; i < part_.points.size(); ++i) {
        x.push_back(from_eigen(motion * to_eigen(part_.points[i])));
        const auto nearest = tree_.nearest(array_of(x.back()));
        if (!agrees(motion, i, nearest.number)) continue;
        const auto v = static_cast<std::uint32_t>(i);
        const double ratio = std::sqrt(nearest.squared) / (constants_.radius * mean_edge_ / 2);
        SurfaceRow row;
        row.corners = {v, v, v};
        row.normal = from_eigen(motion.linear() * to_eigen(part_.normals[i]));
        row.point = unexplained_.points[nearest.number];
        row.weight = 1 / (1 + ratio * ratio);
        rows.push_back(row);
      }
      if (rows.size() < constants_.fewest) break;
      motion = fit_to_planes(rows, x) * motion;
    }
    return motion;
  }

  /// The share of the part that has a point, of the same side, within a mean edge.
  [[nodiscard]] double share(const Eigen::Isometry3d& motion) const {
    double n = 0;
    for (std::size_t i = 0; i < part_.points.size(); ++i) {
      const auto nearest = tree_.nearest(array_of(from_eigen(motion * to_eigen(part_.points[i]))));
      n += nearest.squared < mean_edge_ * mean_edge_ && agrees(motion, i, nearest.number) ? 1 : 0;
    }
    return n / static_cast<double>(part_.points.size());
  }

 private:
  [[nodiscard]] bool agrees(const Eigen::Isometry3d& motion, std::size_t i,
                            std::uint32_t point) const {
    const auto& measured = unexplained_.normals[point];
    const Eigen::Vector3d normal = motion.linear() * to_eigen(part_.normals[i]);
    return squared_norm(measured) == 0 || normal.dot(to_eigen(measured)) > constants_.agreement;
  }

  const OrientedPoints& part_;
  const OrientedPoints& unexplained_;
  double mean_edge_;
  const TrackingConstants& constants_;
  PointTree<3> tree_;
};

/// Erases the points that lie within a mean edge of the part.
void erase_explained(const OrientedPoints& part, const Eigen::Isometry3d& motion, double mean_edge,
                     OrientedPoints& unexplained) {
  std::vector<Vector3> moved;
  for (const Vector3& point : part.points) moved.push_back(from_eigen(motion * to_eigen(point)));
  const PointTree<3> tree(arrays_of(moved));
  OrientedPoints left;
  for (std::size_t i = 0; i < unexplained.points.size(); ++i) {
    if (tree.nearest(array_of(unexplained.points[i])).squared < mean_edge * mean_edge) continue;
    left.points.push_back(unexplained.points[i]);
    left.normals.push_back(unexplained.normals[i]);
  }
  unexplained = std::move(left);
}

/// The motion of a part to where most of it has points, which are then erased, or nothing.
std::optional<Eigen::Isometry3d> motion_to_points(const OrientedPoints& part,
                                                  OrientedPoints& unexplained, double mean_edge,
                                                  const TrackingConstants& constants) {
  if (part.points.empty() || unexplained.points.size() < constants.fewest) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const auto n = static_cast<double>(part.points.size());
  for (const Vector3& point : part.points) middle += to_eigen(point) / n;
  double square = 0;
  for (const Vector3& point : part.points) square += (to_eigen(point) - middle).squaredNorm() / n;
  const Placing placing(part, unexplained, mean_edge, constants);
  std::optional<Eigen::Isometry3d> best;
  double largest = least_share;
  for (const Vector3& shift :
       shifts_to(unexplained, from_eigen(middle), std::sqrt(square), constants.fewest)) {
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    motion.translation() = to_eigen(shift);
    motion = placing.aligned(motion);
    const double share = placing.share(motion);
    if (!(share > largest)) continue;
    largest = share;
    best = motion;
  }
  if (best) erase_explained(part, *best, mean_edge, unexplained);
  return best;
}

}  // namespace

bool find_lost(std::span<const std::uint8_t> is_placed, const MatchedPoints& points,
               const Visibility& visibility, Field normals, const Topology& topology,
               const TrackingConstants& constants, std::span<Vector3> x) {
  OrientedPoints unexplained = unexplained_of(points);
  std::vector<std::vector<std::size_t>> seen(is_placed.size());
  for (std::size_t v = 0; v < x.size(); ++v) {
    const std::size_t component = at(topology.component[v]);
    if (is_placed[component] == 0 && visibility.is_seen[v] != 0) seen[component].push_back(v);
  }
  std::vector<std::size_t> order(seen.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t c) { return seen[c].size(); });
  bool any = false;
  for (const std::size_t component : order) {
    OrientedPoints part;
    const std::size_t every = 1 + seen[component].size() / constants.vertices_of_search;
    for (std::size_t i = 0; i < seen[component].size(); i += every) {
      part.points.push_back(x[seen[component][i]]);
      part.normals.push_back(normals[seen[component][i]]);
    }
    const auto motion = motion_to_points(part, unexplained, points.mean_edge, constants);
    if (!motion) continue;
    any = true;
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (at(topology.component[v]) == component) x[v] = from_eigen(*motion * to_eigen(x[v]));
    }
  }
  return any;
}

}  // namespace dynmesh
