#include "registration/rigid_starts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"
#include "base/rigid_motion.hpp"
#include "base/statistics.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {
namespace {

using Motion = Eigen::Isometry3d;

Eigen::Vector3d centre_of(Field points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& point : points) sum += to_eigen(point);
  return sum / static_cast<double>(points.size());
}

/// A motion of the template, and the mean distance of the nearest pairs after it.
struct RigidStart {
  Motion motion = Motion::Identity();
  double distance = 0;
};

/// Places of a surface and points of a scan, with a search tree of the places in six dimensions.
class Pairing {
 public:
  /// `scan` must outlive this object.
  Pairing(SurfaceSample surface, const PointScan& scan)
      : surface_(std::move(surface)), scan_(scan) {
    const Eigen::Vector3d centre = centre_of(surface_.points);
    double size = 0;
    for (const auto& point : surface_.points) size += (to_eigen(point) - centre).norm();
    normal_length_ =
        rigid_start_constants.normal * size / static_cast<double>(surface_.points.size());
    std::vector<Row> rows;
    for (std::size_t i = 0; i < surface_.points.size(); ++i) {
      rows.push_back(row(to_eigen(surface_.points[i]), to_eigen(surface_.normals[i])));
    }
    tree_.emplace(std::move(rows));
  }

  /// Whether the surface has no area.
  [[nodiscard]] bool empty() const { return tree_->empty(); }

  /// Brings the centre of the surface to that of the points.
  [[nodiscard]] Motion centred(const Eigen::Matrix3d& rotation) const {
    Motion motion = Motion::Identity();
    motion.linear() = rotation;
    motion.translation() = centre_of(scan_.points) - rotation * centre_of(surface_.points);
    return motion;
  }

  /// Improves a motion with the nearest pairs. Points are drawn to points or, which lets surfaces
  /// slide into place, to planes (Chen and Medioni 1991).
  [[nodiscard]] RigidStart improved(RigidStart start, bool to_planes) const {
    for (int step = 0;; ++step) {
      auto pairs = nearest_pairs(start.motion);
      const auto n =
          static_cast<std::size_t>(rigid_start_constants.kept * static_cast<double>(pairs.size()));
      std::ranges::nth_element(pairs, pairs.begin() + static_cast<std::ptrdiff_t>(n), {},
                               &Pair::squared);
      pairs.resize(std::max<std::size_t>(n, 3));
      start.distance = 0;
      for (const Pair& pair : pairs) {
        start.distance += std::sqrt(pair.squared) / static_cast<double>(pairs.size());
      }
      if (step == rigid_start_constants.steps) return start;
      start.motion = to_planes ? drawn_to_planes(start.motion, pairs) : drawn_to_points(pairs);
    }
  }

 private:
  using Row = PointTree<6>::Point;
  struct Pair {
    std::uint32_t place = 0;
    std::size_t point = 0;
    double squared = 0;
  };

  [[nodiscard]] Row row(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d n = normal_length_ * normal;
    return {point.x(), point.y(), point.z(), n.x(), n.y(), n.z()};
  }
  [[nodiscard]] std::vector<Pair> nearest_pairs(const Motion& motion) const {
    const Motion back = motion.inverse();
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < scan_.size(); ++i) {
      const Eigen::Vector3d point = back * to_eigen(scan_.points[i]);
      const Eigen::Vector3d normal = back.linear() * to_eigen(scan_.normals[i]);
      Pair best = {0, i, std::numeric_limits<double>::infinity()};
      for (const double side : {1.0, -1.0}) {
        if (side < 0 && !scan_.is_undecided(i)) break;
        const auto [place, squared] = tree_->nearest(row(point, side * normal));
        if (squared < best.squared) best = {place, i, squared};
      }
      pairs.push_back(best);
    }
    return pairs;
  }

  [[nodiscard]] Motion drawn_to_points(const std::vector<Pair>& pairs) const {
    std::vector<Vector3> ours, theirs;
    for (const Pair& pair : pairs) {
      ours.push_back(surface_.points[pair.place]);
      theirs.push_back(scan_.points[pair.point]);
    }
    return to_eigen(fit_rigid_motion(ours, theirs));
  }
  [[nodiscard]] Motion drawn_to_planes(const Motion& motion, const std::vector<Pair>& pairs) const {
    std::vector<Vector3> ours;
    std::vector<SurfaceRow> rows;
    for (const Pair& pair : pairs) {
      const auto i = static_cast<std::uint32_t>(ours.size());
      const Eigen::Vector3d normal = motion.linear() * to_eigen(surface_.normals[pair.place]);
      ours.push_back(from_eigen(motion * to_eigen(surface_.points[pair.place])));
      rows.push_back({{0, {i, i, i}}, from_eigen(normal), scan_.points[pair.point], 1});
    }
    return fit_to_planes(rows, ours) * motion;
  }

  SurfaceSample surface_;
  const PointScan& scan_;
  double normal_length_ = 0;
  std::optional<PointTree<6>> tree_;
};

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

/// The angle between two rotations, in degrees.
double angle_between(const Motion& a, const Motion& b) {
  const Eigen::Matrix3d turn = a.linear().transpose() * b.linear();
  return Eigen::AngleAxisd(turn).angle() * 180 / std::numbers::pi;
}

/// Few places of a surface and few points, which are compared from any rotation.
class CoarsePairing {
 public:
  CoarsePairing(std::span<const Triangle> faces, Field surface, const PointScan& sample)
      : points_(some_of(sample)),
        pairing_(sample_surface(faces, surface, rigid_start_constants.coarse_places), points_) {}

  /// Whether the surface has no area.
  [[nodiscard]] bool empty() const { return pairing_.empty(); }
  [[nodiscard]] RigidStart in_place() const { return pairing_.improved({}, false); }
  [[nodiscard]] std::vector<RigidStart> turned() const {
    constexpr int n = rigid_start_constants.rotations;
    std::vector<RigidStart> starts;
    for (int i = 0; i < n; ++i) {
      starts.push_back(pairing_.improved({pairing_.centred(spread_rotation(i, n))}, false));
    }
    return starts;
  }

 private:
  static PointScan some_of(const PointScan& sample) {
    constexpr std::size_t n = rigid_start_constants.coarse_points;
    const std::size_t step = (sample.size() + n - 1) / n;
    std::vector<std::size_t> few;
    for (std::size_t i = step - 1; i < sample.size(); i += step) few.push_back(i);
    return part_of(sample, few);
  }

  PointScan points_;
  Pairing pairing_;
};

/// The best starts whose rotations differ, at most so many.
std::vector<RigidStart> best_of(std::vector<RigidStart> starts, std::size_t most) {
  std::ranges::stable_sort(starts, {}, &RigidStart::distance);
  std::vector<RigidStart> best;
  for (const RigidStart& start : starts) {
    const bool is_new = std::ranges::all_of(best, [&](const RigidStart& other) {
      return angle_between(start.motion, other.motion) > rigid_start_constants.least_angle;
    });
    if (is_new) best.push_back(start);
    if (best.size() == most) break;
  }
  return best;
}

}  // namespace

/// In each face, the places follow the R2 sequence (Roberts 2018).
SurfaceSample sample_surface(std::span<const Triangle> faces, Field x, std::size_t n) {
  constexpr double first_step = 0.7548776662466927;
  constexpr double second_step = 0.5698402909980532;
  std::vector<double> ends;  // the area up to each face
  double total = 0;
  std::vector<Vector3> normals;
  for (const Triangle& face : faces) {
    const auto normal = normal_of(face, x);
    normals.push_back(unit_of(normal));
    ends.push_back(total += std::sqrt(squared_norm(normal)));
  }
  SurfaceSample sample;
  if (!(total > 0)) return sample;
  for (std::size_t i = 0; i < n; ++i) {
    const auto number = static_cast<double>(i);
    const double area = (number + 0.5) / static_cast<double>(n) * total;
    const auto found =
        static_cast<std::size_t>(std::ranges::upper_bound(ends, area) - ends.begin());
    const std::size_t f = std::min(found, faces.size() - 1);
    const double root = std::sqrt(std::fmod(number * first_step, 1.0));
    const double along = std::fmod(number * second_step, 1.0);
    const std::array<double, 3> weights = {1 - root, root * (1 - along), root * along};
    Vector3 point;
    for (std::size_t c = 0; c < 3; ++c) point = point + weights[c] * x[at(faces[f][c])];
    sample.points.push_back(point);
    sample.normals.push_back(normals[f]);
    sample.vertices.push_back(
        faces[f][static_cast<std::size_t>(std::ranges::max_element(weights) - weights.begin())]);
  }
  return sample;
}

double size_of_surface(std::span<const Triangle> faces, Field x) {
  const auto points = sample_surface(faces, x, rigid_start_constants.places).points;
  return points.empty() ? 0 : size_of(points);
}

PointScan part_of(const PointScan& scan, std::span<const std::size_t> numbers) {
  PointScan part;
  for (const std::size_t i : numbers) {
    part.points.push_back(scan.points[i]);
    part.normals.push_back(scan.normals[i]);
    part.undecided.push_back(scan.is_undecided(i) ? 1 : 0);
  }
  part.sensors = scan.sensors;
  for (const std::size_t i : numbers) {
    if (!scan.sensor_numbers.empty()) part.sensor_numbers.push_back(scan.sensor_numbers[i]);
  }
  return part;
}

double area_of(std::span<const Triangle> faces, Field x) {
  double sum = 0;
  for (const Triangle& face : faces) sum += std::sqrt(squared_norm(normal_of(face, x))) / 2;
  return sum;
}

double area_around(const PointScan& scan, std::size_t i) {
  // Four neighbours lie within the spacing, on average.
  const double squared = scan.squared_spacing(i);
  return std::isfinite(squared) ? std::numbers::pi * squared / 4 : 0;
}

/// Each point stands for the area around it, stray ones for no more than most others.
PointScan sample_scan(const PointScan& scan, std::size_t n) {
  constexpr double not_stray = 0.9;
  std::vector<double> areas(scan.size(), 1.0);
  if (scan.size() > n) {
    for (std::size_t i = 0; i < areas.size(); ++i) areas[i] = scan.squared_spacing(i);
    const double largest = quantile(areas, not_stray);
    for (double& area : areas) area = largest > 0 ? std::min(area, largest) : 1;
  }
  const double total = std::accumulate(areas.begin(), areas.end(), 0.0);
  const double share = static_cast<double>(n) / total;
  std::vector<std::size_t> chosen;
  double end = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double begin = std::exchange(end, end + areas[i]);
    if (std::floor(end * share) > std::floor(begin * share)) chosen.push_back(i);
  }
  return part_of(scan, chosen);
}

std::vector<Eigen::Isometry3d> rigid_starts(std::span<const Triangle> faces, Field surface,
                                            const PointScan& sample) {
  constexpr const RigidStartConstants& c = rigid_start_constants;
  const Pairing fine(sample_surface(faces, surface, c.places), sample);
  if (fine.empty()) return {Eigen::Isometry3d::Identity()};
  const RigidStart in_place = fine.improved({}, true);
  auto starts = best_of(CoarsePairing(faces, surface, sample).turned(), 2 * c.starts);
  for (RigidStart& start : starts) start = fine.improved(start, true);
  starts.insert(starts.begin(), in_place);
  std::vector<Eigen::Isometry3d> best;
  for (const RigidStart& start : best_of(std::move(starts), c.starts)) {
    best.push_back(start.motion);
  }
  return best;
}

double gain_of_turning(std::span<const Triangle> faces, Field surface, const PointScan& sample) {
  const CoarsePairing pairing(faces, surface, sample);
  if (pairing.empty()) return 1;
  const RigidStart in_place = pairing.in_place();
  double turned = std::numeric_limits<double>::infinity();
  for (const RigidStart& start : pairing.turned()) {
    if (angle_between(start.motion, in_place.motion) > rigid_start_constants.least_angle) {
      turned = std::min(turned, start.distance);
    }
  }
  return turned > 0 && in_place.distance > 0 ? std::pow(in_place.distance / turned, 2) : 1;
}

}  // namespace dynmesh
