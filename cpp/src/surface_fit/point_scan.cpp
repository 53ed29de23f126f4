#include "surface_fit/point_scan.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

/// How many points determine a local plane at least, the one in question included, and how many at
/// most where they are denser than the mesh. Fewer follow the noise, more round off edges.
constexpr std::size_t plane_points = 12;
constexpr std::size_t most_plane_points = 96;

/// Points whose variance across a line is a smaller share of that along it lie on this line.
constexpr double collinear = 0.2;

struct Plane {
  Vector3 normal;          ///< of unit length; 0 if there is no plane
  double uncertainty = 0;  ///< the standard deviation of its direction, in radians
};

/// The plane that fits the points best; none if they lie on a line, as the points of one line of a
/// line scanner do: across it, only noise or its bends would determine the plane.
Plane plane_of(const std::vector<Vector3>& points, std::span<const std::uint32_t> chosen) {
  Vector3 mean;
  for (const auto i : chosen) mean = mean + points[i];
  mean = (1 / static_cast<double>(chosen.size())) * mean;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto i : chosen) {
    const auto arm = points[i] - mean;
    const Eigen::Vector3d a(arm.x, arm.y, arm.z);
    covariance += a * a.transpose();
  }
  const double size = covariance.trace();
  if (!(size > 0) || !std::isfinite(size)) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance / size);
  const auto& spread = solver.eigenvalues();
  if (!(spread[1] > collinear * spread[2])) return {};
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  const double freedom = std::max(1.0, static_cast<double>(chosen.size()) - 3);
  return {{normal.x(), normal.y(), normal.z()}, std::sqrt(spread[0] / spread[1] / freedom)};
}

/// A number of 20 bits with two zeros before each of them.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 32U) & 0x1f00000000ffffU;
  bits = (bits | bits << 16U) & 0x1f0000ff0000ffU;
  bits = (bits | bits << 8U) & 0x100f00f00f00f00fU;
  bits = (bits | bits << 4U) & 0x10c30c30c30c30c3U;
  return (bits | bits << 2U) & 0x1249249249249249U;
}

/// The numbers of the points by the bits of their three coordinates in turn. A cell is a millionth
/// of the largest extent, so that the order does not hang on a few points far away.
std::vector<std::uint32_t> order_along_curve(Field points) {
  constexpr double cells = 1U << 20U;
  Eigen::AlignedBox3d box;
  for (const auto& p : points) box.extend(to_eigen(p));
  const double largest = points.empty() ? 0 : box.sizes().maxCoeff();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(points.size());
  for (const auto& p : points) {
    const Eigen::Vector3d place = (to_eigen(p) - box.min()) / largest * cells;
    const auto bits = [&](Eigen::Index axis) {
      return spread(place[axis] >= 0 ? static_cast<std::uint64_t>(std::min(place[axis], cells - 1))
                                     : 0);  // without any extent, it is NaN
    };
    keys.emplace_back(bits(0) | bits(1) << 1U | bits(2) << 2U,
                      static_cast<std::uint32_t>(keys.size()));
  }
  std::ranges::sort(keys);
  std::vector<std::uint32_t> order(keys.size());
  std::ranges::transform(keys, order.begin(), [](const auto& key) { return key.second; });
  return order;
}

}  // namespace

const PointTree<3>& PointScan::tree() const {
  std::call_once(search_->begun, [&] { search_->tree.emplace(arrays_of(points)); });
  return *search_->tree;
}

std::span<const std::uint32_t> PointScan::along_curve() const {
  std::call_once(search_->ordered, [&] { search_->order = order_along_curve(points); });
  return search_->order;
}

void PointScan::estimate_normals(double radius, Workers& workers) {
  normals.resize(points.size());
  undecided.resize(points.size());
  // Copies of few points determine no plane.
  const auto place = [](const Vector3& p) { return std::array{p.x, p.y, p.z}; };
  auto distinct = points;
  std::ranges::sort(distinct, {}, place);
  const auto is_copy = [&](const auto& a, const auto& b) { return place(a) == place(b); };
  distinct.erase(std::unique(distinct.begin(), distinct.end(), is_copy), distinct.end());
  const PointTree<3> tree(arrays_of(distinct));
  workers.for_each_in_chunks(points.size(), [&](std::size_t i) {
    std::array<std::uint32_t, most_plane_points> numbers{};
    std::array<double, most_plane_points> squared{};
    const auto find = [&](std::size_t n) {
      return tree.nearest(array_of(points[i]), std::span(numbers).first(n),
                          std::span(squared).first(n));
    };
    std::size_t n = find(plane_points);
    if (n == plane_points && squared[n - 1] < radius * radius) {
      n = find(most_plane_points);
      while (n > plane_points && squared[n - 1] > radius * radius) --n;
    }
    Plane plane = plane_of(distinct, std::span(numbers).first(n));
    // Where noise is as large as the distances between points, few do not tell a direction.
    for (std::size_t more = 2 * n;
         plane.uncertainty > most_uncertain_normal && more <= most_plane_points; more *= 2) {
      plane = plane_of(distinct, std::span(numbers).first(find(more)));
    }
    set_normal(i, plane.normal);
  });
}

/// The cosine between the normal of a point and the direction to a sensor; 0 where there is none.
double PointScan::cosine_to(const Vector3& sensor, std::size_t i) const {
  const auto view = sensor - points[i];
  const double length = std::sqrt(squared_norm(view));
  return length > 0 ? dot(normals[i], view) / length : 0;
}

void PointScan::set_normal(std::size_t i, const Vector3& normal) {
  normals[i] = normal;
  double least = 1;  // of the cosines between the normal and the sensors
  double most = -1;
  for (const auto& sensor : sensors) {
    const double cosine = cosine_to(sensor, i);
    least = std::min(least, cosine);
    most = std::max(most, cosine);
  }
  undecided[i] = most <= 0 || least >= 0 ? 0 : 1;
  if (sensors.empty()) undecided[i] = 1;
  if (most <= 0) normals[i] = -1.0 * normal;
}

void PointScan::find_sensors(Workers& workers) {
  if (sensors.size() < 2) return;
  sensor_numbers.assign(size(), 0);
  workers.for_each_in_chunks(size(), [&](std::size_t i) {
    double most = -1;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      const double cosine = cosine_to(sensors[s], i);
      const double turned = is_undecided(i) ? std::abs(cosine) : cosine;
      if (!(turned > most)) continue;
      most = turned;
      sensor_numbers[i] = static_cast<std::uint32_t>(s);
    }
  });
}

double PointScan::squared_spacing(std::size_t i) const {
  const auto around = nearest_to(i, 5);  // itself first
  if (around.size() < 5) return std::numeric_limits<double>::infinity();
  return squared_norm(points[around.back()] - points[i]);
}

std::vector<std::uint32_t> PointScan::nearest_to(std::size_t number, std::size_t count) const {
  std::vector<std::uint32_t> numbers(count);
  std::vector<double> distances(count);
  numbers.resize(tree().nearest(array_of(points[number]), numbers, distances));
  return numbers;
}

}  // namespace dynmesh
