#include "tracking/alignment.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "support/eigen_points.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"
#include "support/symmetric_eigen.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/rigid_step.hpp"
#include "tracking/robust_size.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh {
namespace {

using Field = std::span<const Vector3<double>>;
using Cloud = std::vector<Vector3<double>>;
using Motion = Eigen::Isometry3d;

Vector3<double> moved(const Motion& motion, const Vector3<double>& point) {
  return from_eigen(motion * to_eigen(point));
}

/// Returns about n points, evenly chosen by their numbers, always the same.
Cloud some_of(Field points, int n) {
  const double step = static_cast<double>(points.size() - 1) / (n - 1);
  Cloud chosen;
  std::size_t next = 0;
  for (int i = 0; i < n; ++i) {
    const auto number = i + 1 < n ? static_cast<std::size_t>(i * step) : points.size() - 1;
    if (number < next) continue;
    chosen.push_back(points[number]);
    next = number + 1;
  }
  return chosen;
}

/// Some points with their search tree and, if they are given, normals.
class Sample {
 public:
  Sample(Field points, Field normals, int n) {
    scan_.points = some_of(points, n);
    scan_.normals = normals.empty() ? Cloud(scan_.points.size()) : some_of(normals, n);
    scan_.index();
  }

  [[nodiscard]] const Cloud& points() const { return scan_.points; }
  [[nodiscard]] const Cloud& normals() const { return scan_.normals; }
  [[nodiscard]] PointScan::Nearest nearest(const Vector3<double>& position) const {
    constexpr double everywhere = std::numeric_limits<double>::infinity();
    constexpr double any_normal = -2;
    return scan_.find(position, {}, everywhere, any_normal);
  }

 private:
  PointScan scan_;
};

/// The share of the points that, after a motion, have one of the others within a distance is
/// `share`; returns that distance.
double distance_of(Field points, double share, const Motion& motion, const Sample& others) {
  std::vector<double> distances;
  for (const auto& point : points) {
    distances.push_back(std::sqrt(others.nearest(moved(motion, point)).squared_distance));
  }
  return quantile(std::move(distances), share);
}

/// How far the surface is from the scan after a motion; see Alignment.
double distance_between(const Sample& surface, const Motion& motion, const Sample& scan,
                        const AlignmentConstants& constants) {
  return std::min(distance_of(scan.points(), 0.5, motion.inverse(), surface),
                  distance_of(surface.points(), constants.seen, motion, scan));
}

struct Surface {
  Cloud points;
  Cloud normals;
};

/// The vertices and, for coarse meshes, the centres of the triangles, with unit normals.
Surface surface_of(std::span<const Triangle> faces, Field frame) {
  Surface surface = {{frame.begin(), frame.end()}, Cloud(frame.size())};
  find_vertex_normals(faces, frame, surface.normals);
  for (const Triangle& face : faces) {
    const auto& a = frame[static_cast<std::size_t>(face[0])];
    const auto& b = frame[static_cast<std::size_t>(face[1])];
    const auto& c = frame[static_cast<std::size_t>(face[2])];
    surface.points.push_back((1.0 / 3) * (a + b + c));
    surface.normals.push_back(from_eigen(to_eigen(cross(b - a, c - a)).normalized()));
  }
  return surface;
}

/// Points of the surface after a motion, and the points of the scan whose nearest ones they are,
/// with the normals of the surface there.
struct Pairs {
  Cloud ours;
  std::vector<SurfaceRow> theirs;  ///< at the places of `ours`
};

/// The nearest pairs. The others, a fixed share, are dropped.
Pairs pairs_of(const Sample& surface, const Motion& motion, const Sample& scan,
               const AlignmentConstants& constants) {
  struct Pair {
    double squared_distance = 0;
    std::size_t ours = 0;
    std::size_t theirs = 0;
  };
  const Motion back = motion.inverse();
  std::vector<Pair> found;
  for (std::size_t i = 0; i < scan.points().size(); ++i) {
    const auto nearest = surface.nearest(moved(back, scan.points()[i]));
    found.push_back({nearest.squared_distance, nearest.index, i});
  }
  std::ranges::stable_sort(found, {}, &Pair::squared_distance);
  const auto share = static_cast<std::size_t>(constants.kept * static_cast<double>(found.size()));
  found.resize(std::min(found.size(), std::max<std::size_t>(share, 3)));
  Pairs pairs;
  for (const Pair& pair : found) {
    const auto place = static_cast<std::uint32_t>(pairs.ours.size());
    const Eigen::Vector3d normal = motion.linear() * to_eigen(surface.normals()[pair.ours]);
    pairs.theirs.push_back(
        {{place, place, place}, {1, 0, 0}, from_eigen(normal), scan.points()[pair.theirs], 1});
    pairs.ours.push_back(moved(motion, surface.points()[pair.ours]));
  }
  return pairs;
}

/// Improves a motion such that points come near points.
Motion drawn_to_points(const Sample& surface, Motion motion, const Sample& scan,
                       const AlignmentConstants& constants) {
  for (int step = 0; step < constants.coarse_steps; ++step) {
    const Pairs pairs = pairs_of(surface, motion, scan, constants);
    std::vector<Vector3<double>> theirs;
    for (const SurfaceRow& row : pairs.theirs) theirs.push_back(row.point);
    motion = to_eigen(fit_rigid_motion<double>(pairs.ours, theirs)) * motion;
  }
  return motion;
}

struct Placed {
  Motion motion;
  double distance = 0;
};

/// Improves a motion such that points come near planes. The distance is the mean one from them.
Placed drawn_to_planes(const Sample& surface, Motion motion, const Sample& scan,
                       const AlignmentConstants& constants) {
  for (int step = 0; step < constants.fine_steps; ++step) {
    const Pairs pairs = pairs_of(surface, motion, scan, constants);
    const SmallMotion small = fit_to_planes(pairs.theirs, pairs.ours, constants.caution);
    motion = Eigen::Translation3d(to_eigen(small.centre + small.shift)) * rotation_of(small) *
             Eigen::Translation3d(-to_eigen(small.centre)) * motion;
  }
  const Pairs pairs = pairs_of(surface, motion, scan, constants);
  double sum = 0;
  for (std::size_t i = 0; i < pairs.ours.size(); ++i) {
    sum += std::abs(dot(pairs.theirs[i].point - pairs.ours[i], pairs.theirs[i].normal));
  }
  return {motion, sum / static_cast<double>(pairs.ours.size())};
}

/// The principal axes as rows, right-handed.
Eigen::Matrix3d principal_axes(Field points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& point : points) mean += to_eigen(point) / static_cast<double>(points.size());
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> covariance = Eigen::Matrix3d::Zero();
  for (const auto& point : points) {
    const Eigen::Vector3d arm = to_eigen(point) - mean;
    covariance += arm * arm.transpose();
  }
  std::array<double, 3> values{};
  symmetric_eigen({covariance.data(), 9}, values);
  Eigen::Matrix3d axes = covariance;
  if (axes.determinant() < 0) axes.row(2) *= -1;
  return axes;
}

/// Rotations to begin with: the 24 of a cube, and the four between the principal axes, which have
/// no direction.
std::vector<Eigen::Matrix3d> first_rotations(Field surface, Field scan) {
  std::vector<Eigen::Matrix3d> rotations;
  std::array<int, 3> axes = {0, 1, 2};
  do {
    for (const double x : {1.0, -1.0}) {
      for (const double y : {1.0, -1.0}) {
        for (const double z : {1.0, -1.0}) {
          Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
          turn(0, axes[0]) = x;
          turn(1, axes[1]) = y;
          turn(2, axes[2]) = z;
          if (turn.determinant() > 0) rotations.push_back(turn);
        }
      }
    }
  } while (std::ranges::next_permutation(axes).found);
  const Eigen::Matrix3d ours = principal_axes(surface);
  const Eigen::Matrix3d theirs = principal_axes(scan);
  // The axes of the first four are not exchanged: they are the identity and three half turns.
  for (std::size_t i = 0; i < 4; ++i) {
    rotations.emplace_back(theirs.transpose() * rotations[i] * ours);
  }
  return rotations;
}

/// The motion after which the surface is nearest to the scan. `whole` and `many` are of the same
/// surface and scan as the points.
Motion best_motion(const Surface& surface, Field scan, const Sample& whole, const Sample& many,
                   const AlignmentConstants& constants) {
  const Sample some(surface.points, surface.normals, constants.coarse_surface);
  const Sample few(scan, {}, constants.coarse_scan);
  const Eigen::Vector3d middle = to_eigen(median_of(some.points()));
  const Eigen::Vector3d aim = to_eigen(median_of(few.points()));
  std::vector<Placed> tried;
  for (const auto& turn : first_rotations(some.points(), few.points())) {
    Motion motion = Motion::Identity();
    motion.linear() = turn;
    motion.translation() = aim - turn * middle;
    motion = drawn_to_points(some, motion, few, constants);
    tried.push_back({motion, distance_between(some, motion, few, constants)});
  }
  std::ranges::stable_sort(tried, {}, &Placed::distance);
  tried.resize(static_cast<std::size_t>(constants.candidates));
  for (auto& candidate : tried) {
    candidate = drawn_to_planes(whole, candidate.motion, many, constants);
  }
  return std::ranges::min_element(tried, {}, &Placed::distance)->motion;
}

void store(const Motion& motion, Alignment& found) {
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 3; ++column) {
      found.rotation[static_cast<std::size_t>(3 * row + column)] = motion.linear()(row, column);
    }
    found.shift[static_cast<std::size_t>(row)] = motion.translation()[row];
  }
}

}  // namespace

Alignment align(std::span<const Triangle> faces, Field first_frame, double mean_edge, Field scan,
                const AlignmentConstants& constants) {
  const Surface surface = surface_of(faces, first_frame);
  const Sample whole(surface.points, surface.normals, constants.fine_surface);
  const Sample many(scan, {}, constants.fine_scan);
  const double sampled_size = size_of(some_of(first_frame, constants.fine_surface));
  const double size = size_of(first_frame) / mean_edge;
  const double within = std::min(constants.within, constants.within_share * size);
  const double far = std::max(constants.far, constants.far_share * size);

  Alignment found;
  found.mean_edge = mean_edge;
  found.ratio = sampled_size > 0 ? size_of(many.points()) / sampled_size : 1;
  found.other_unit =
      !(found.ratio < constants.other_unit && found.ratio > 1 / constants.other_unit);
  found.before = distance_between(whole, Motion::Identity(), many, constants) / mean_edge;
  found.after = found.before;
  found.lies_in_scan = found.before <= within && !found.other_unit;
  found.matches = found.lies_in_scan;
  if (found.lies_in_scan || found.other_unit) return found;

  const Motion motion = best_motion(surface, scan, whole, many, constants);
  store(motion, found);
  found.after = distance_between(whole, motion, many, constants) / mean_edge;
  found.matches = found.after <= std::min(within, far);
  return found;
}

}  // namespace dynmesh
