#include "registration/rigid_starts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>

#include "registration/surface_sample.hpp"
#include "support/eigen_points.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"
#include "tracking/quiet_nanoflann.hpp"

namespace dynmesh {
namespace {

using Field = std::span<const Vector3<double>>;
using Motion = Eigen::Isometry3d;

/// Points with unit normals, of which some may as well be the opposite.
struct OrientedPoints {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;
  std::vector<std::uint8_t> undecided;

  void add(const Vector3<double>& point, const Vector3<double>& normal, bool is_undecided) {
    points.push_back(to_eigen(point));
    normals.push_back(to_eigen(normal));
    undecided.push_back(is_undecided ? 1 : 0);
  }
};

/// About n of the numbers below `count`, evenly spread, always the same.
std::vector<std::size_t> some_of(std::size_t count, int n) {
  const double step = std::max(1.0, static_cast<double>(count) / n);
  std::vector<std::size_t> chosen;
  for (double at = 0; at < static_cast<double>(count); at += step) {
    chosen.push_back(static_cast<std::size_t>(at));
  }
  return chosen;
}

OrientedPoints some_of_surface(std::span<const Triangle> faces, Field x, int n) {
  const SurfaceSample sample = sample_surface(faces, x, static_cast<std::size_t>(n));
  OrientedPoints some;
  for (std::size_t i = 0; i < sample.points.size(); ++i) {
    some.add(sample.points[i], sample.normals[i], false);
  }
  return some;
}

OrientedPoints some_of_scan(const PointScan& scan, int n) {
  OrientedPoints some;
  for (const std::size_t i : some_of(scan.size(), n)) {
    some.add(scan.point(i), scan.normal(i), scan.is_undecided(i));
  }
  return some;
}

Eigen::Vector3d centre_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

/// A surface in six dimensions, with a search tree.
class SixDimensions {
 public:
  SixDimensions(const OrientedPoints& surface, double normal_length) : surface_(surface) {
    const Eigen::Vector3d centre = centre_of(surface.points);
    double size = 0;
    for (const auto& point : surface.points) {
      size += (point - centre).norm() / static_cast<double>(surface.points.size());
    }
    normal_length_ = normal_length * size;
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
      rows_.push_back(row(surface.points[i], surface.normals[i]));
    }
    tree_.buildIndex();
  }

  struct Nearest {
    std::size_t number = 0;
    double squared_distance = 0;
  };
  [[nodiscard]] Nearest nearest(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                bool is_undecided) const {
    Nearest best = find(row(point, normal));
    if (is_undecided) {
      const Nearest other = find(row(point, -normal));
      if (other.squared_distance < best.squared_distance) best = other;
    }
    return best;
  }
  [[nodiscard]] const OrientedPoints& surface() const { return surface_; }

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return rows_.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t c) const { return rows_[i][c]; }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }

 private:
  using Row = std::array<double, 6>;
  using Tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, SixDimensions>,
                                          SixDimensions, 6, std::uint32_t>;

  [[nodiscard]] Row row(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d n = normal_length_ * normal;
    return {point.x(), point.y(), point.z(), n.x(), n.y(), n.z()};
  }
  [[nodiscard]] Nearest find(const Row& query) const {
    std::uint32_t number = 0;
    double squared = 0;
    nanoflann::KNNResultSet<double, std::uint32_t> result(1);
    result.init(&number, &squared);
    tree_.findNeighbors(result, query.data(), {});
    return {number, squared};
  }

  const OrientedPoints& surface_;
  double normal_length_ = 0;
  std::vector<Row> rows_;
  Tree tree_{6, *this, nanoflann::KDTreeSingleIndexAdaptorParams(8)};
};

/// Improves a motion by iterative closest points.
RigidStart improved(const SixDimensions& surface, Motion motion, const OrientedPoints& scan,
                    int steps, double kept) {
  struct Pair {
    SixDimensions::Nearest nearest;
    std::size_t scanned;
  };
  std::vector<Pair> pairs;
  RigidStart start;
  for (int step = 0;; ++step) {
    const Motion back = motion.inverse();
    pairs.clear();
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const Eigen::Vector3d normal = back.linear() * scan.normals[i];
      pairs.push_back({surface.nearest(back * scan.points[i], normal, scan.undecided[i] != 0), i});
    }
    const auto n = static_cast<std::size_t>(kept * static_cast<double>(pairs.size()));
    const auto distance = [](const Pair& pair) { return pair.nearest.squared_distance; };
    std::ranges::stable_sort(pairs, {}, distance);
    pairs.resize(std::min(pairs.size(), std::max<std::size_t>(n, 3)));
    start.distance = 0;
    std::vector<Vector3<double>> ours;
    std::vector<Vector3<double>> theirs;
    for (const Pair& pair : pairs) {
      start.distance += std::sqrt(distance(pair)) / static_cast<double>(pairs.size());
      ours.push_back(from_eigen(surface.surface().points[pair.nearest.number]));
      theirs.push_back(from_eigen(scan.points[pair.scanned]));
    }
    start.motion = motion;
    if (step == steps) return start;
    motion = to_eigen(fit_rigid_motion<double>(ours, theirs));
  }
}

/// The quaternions of a super-Fibonacci spiral.
Eigen::Matrix3d spread_rotation(int number, int count) {
  constexpr double psi = 1.533751168755204288118041;
  const double s = number + 0.5;
  const double inner = std::sqrt(s / count);
  const double outer = std::sqrt(1 - s / count);
  const double alpha = 2 * std::numbers::pi * s / std::numbers::sqrt2;
  const double beta = 2 * std::numbers::pi * s / psi;
  return Eigen::Quaterniond(outer * std::cos(beta), inner * std::sin(alpha),
                            inner * std::cos(alpha), outer * std::sin(beta))
      .toRotationMatrix();
}

/// The best starts that differ, after the fine steps.
std::vector<RigidStart> best_of(std::vector<RigidStart> starts, const RigidStartConstants& c) {
  std::ranges::stable_sort(starts, {}, &RigidStart::distance);
  std::vector<RigidStart> best;
  for (const RigidStart& start : starts) {
    const bool is_new = std::ranges::all_of(
        best, [&](const RigidStart& other) { return differ(start.motion, other.motion, c); });
    if (is_new) best.push_back(start);
    if (best.size() == static_cast<std::size_t>(c.starts)) break;
  }
  return best;
}

}  // namespace

bool differ(const Motion& a, const Motion& b, const RigidStartConstants& constants) {
  const Eigen::Matrix3d turn = a.linear().transpose() * b.linear();
  return Eigen::AngleAxisd(turn).angle() * 180 / std::numbers::pi > constants.least_angle;
}

std::vector<RigidStart> rigid_starts(std::span<const Triangle> faces, Field surface,
                                     const PointScan& scan, const RigidStartConstants& c) {
  std::vector<RigidStart> starts;
  {
    const OrientedPoints ours = some_of_surface(faces, surface, c.coarse_surface);
    const OrientedPoints theirs = some_of_scan(scan, c.coarse_scan);
    const SixDimensions space(ours, c.coarse_normal);
    const Eigen::Vector3d middle = centre_of(ours.points);
    const Eigen::Vector3d aim = centre_of(theirs.points);
    for (int i = 0; i < c.rotations; ++i) {
      Motion motion = Motion::Identity();
      motion.linear() = spread_rotation(i, c.rotations);
      motion.translation() = aim - motion.linear() * middle;
      starts.push_back(improved(space, motion, theirs, c.coarse_steps, c.kept));
    }
  }
  starts = best_of(std::move(starts), c);
  const OrientedPoints ours = some_of_surface(faces, surface, c.fine_surface);
  const OrientedPoints theirs = some_of_scan(scan, c.fine_scan);
  const SixDimensions space(ours, c.fine_normal);
  for (RigidStart& start : starts) {
    start = improved(space, start.motion, theirs, c.fine_steps, c.kept);
  }
  return best_of(std::move(starts), c);
}

RigidStart start_in_place(std::span<const Triangle> faces, Field surface, const PointScan& scan,
                          const RigidStartConstants& c) {
  const OrientedPoints ours = some_of_surface(faces, surface, c.fine_surface);
  const SixDimensions space(ours, c.fine_normal);
  return improved(space, Motion::Identity(), some_of_scan(scan, c.fine_scan), c.fine_steps, c.kept);
}

}  // namespace dynmesh
