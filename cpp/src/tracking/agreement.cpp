#include "tracking/agreement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>

#include "support/geometry.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {
namespace {

using Corners = std::array<Vector3<double>, 3>;

constexpr double everywhere = std::numeric_limits<double>::infinity();

/// The squared distance of a segment from the origin.
double squared_distance(const Vector3<double>& a, const Vector3<double>& b) {
  const auto edge = b - a;
  const double square = squared_norm(edge);
  const double share = square > 0 ? std::clamp(-dot(a, edge) / square, 0.0, 1.0) : 0;
  return squared_norm(a + share * edge);
}

/// The same of a triangle: that of the foot of the origin, if it is inside, or else of a side.
double squared_distance(const Corners& corners) {
  const auto normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double square = squared_norm(normal);
  bool is_inside = square > 0;
  for (std::size_t side = 0; is_inside && side < 3; ++side) {
    is_inside = dot(cross(corners[side], corners[(side + 1) % 3]), normal) >= 0;
  }
  if (is_inside) {
    const double height = dot(corners[0], normal);
    return height * height / square;
  }
  double least = everywhere;
  for (std::size_t side = 0; side < 3; ++side) {
    least = std::min(least, squared_distance(corners[side], corners[(side + 1) % 3]));
  }
  return least;
}

/// Adds points, and then their mean.
class Sum {
 public:
  void add(double squared, bool is_near, bool agrees) {
    ++points_;
    if (!is_near) {
      ++far_;
      return;
    }
    if (!agrees) ++disagreeing_;
    squares_ += squared;
  }

  [[nodiscard]] Agreement result(double mean_edge) const {
    const auto n = static_cast<double>(points_);
    Agreement found;
    found.points = points_;
    if (points_ > 0) found.far_share = static_cast<double>(far_) / n;
    if (points_ > 0) found.disagreeing = static_cast<double>(disagreeing_) / n;
    if (points_ > far_) {
      found.distance = mean_edge * std::sqrt(squares_ / static_cast<double>(points_ - far_));
    }
    return found;
  }

 private:
  std::size_t points_ = 0;
  std::size_t far_ = 0;
  std::size_t disagreeing_ = 0;
  double squares_ = 0;
};

/// (n,) which of the points of a scan that are compared, of every `stride`-th, are of no surface,
/// such as outliers: they are not near the mesh, and have fewer points around them than most.
template <class IsNear>
std::vector<std::uint8_t> find_strays(const Measurement& scan, std::size_t stride, std::size_t n,
                                      const TrackingConstants& constants, const IsNear& is_near) {
  std::vector<std::uint8_t> strays(n);
  const auto neighbours = static_cast<std::size_t>(constants.stray_neighbours);
  std::size_t first = 0;
  while (first < n && is_near(first)) ++first;
  if (first == n || scan.size() <= neighbours) return strays;
  const auto spacing_at = [&](std::size_t i) {
    return scan.squared_spacing(i * stride, neighbours);
  };
  constexpr std::size_t enough = 256;
  std::vector<double> usual;
  for (std::size_t i = 0; i < n; i += 1 + n / enough) usual.push_back(spacing_at(i));
  const auto middle = usual.begin() + std::ssize(usual) / 2;
  std::ranges::nth_element(usual, middle);
  const double limit = constants.stray_spacing * constants.stray_spacing * *middle;
  for (std::size_t i = first; i < n; ++i) {
    if (!is_near(i) && spacing_at(i) > limit) strays[i] = 1;
  }
  return strays;
}

}  // namespace

/// The surface in mean edges around a point, which keeps squares in range.
struct SurfaceComparison::Local {
  Field x;
  Vector3<double> origin;
  double scale;

  [[nodiscard]] Vector3<double> operator[](std::size_t v) const { return scale * (x[v] - origin); }
};

SurfaceComparison::SurfaceComparison(std::span<const Triangle> faces, const Cells& cells,
                                     Workers& workers, const TrackingConstants& constants)
    : faces_(faces),
      cells_(cells),
      workers_(workers),
      constants_(constants),
      ends_(cells.size() + 1),
      faces_around_(3 * faces.size()) {
  for (const Triangle& face : faces) {
    for (const Index v : face) ++ends_[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 0; v < cells.size(); ++v) ends_[v + 1] += ends_[v];
  auto next = ends_;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const Index v : faces[f]) {
      faces_around_[next[static_cast<std::size_t>(v)]++] = static_cast<std::uint32_t>(f);
    }
  }
}

/// The nearest place of the faces around a vertex.
SurfaceComparison::Place SurfaceComparison::nearest_around(const Local& local,
                                                           std::size_t vertex) const {
  Place found = {vertex, squared_norm(local[vertex])};
  for (std::size_t e = ends_[vertex]; e < ends_[vertex + 1]; ++e) {
    const Triangle& face = faces_[faces_around_[e]];
    const auto corner = [&](std::size_t c) { return local[static_cast<std::size_t>(face[c])]; };
    found.squared = std::min(found.squared, squared_distance({corner(0), corner(1), corner(2)}));
  }
  return found;
}

/// The vertex at which a walk along edges, ever closer to the point, ends.
std::size_t SurfaceComparison::walk(const Local& local, std::size_t start) const {
  std::size_t at = start;
  double least = squared_norm(local[at]);
  for (bool moves = true; moves;) {
    moves = false;
    for (const Index neighbour : cells_[static_cast<Index>(at)]) {
      const auto v = static_cast<std::size_t>(neighbour);
      const double squared = squared_norm(local[v]);
      if (!(squared < least)) continue;
      least = squared;
      at = v;
      moves = true;
    }
  }
  return at;
}

bool SurfaceComparison::agrees(const Surface& surface, const Measurement& scan, std::size_t point,
                               std::size_t vertex) const {
  const double cosine = dot(scan.normal(point), surface.normals[vertex]);
  const bool is_either = scan.is_undecided(point) ||
                         (!surface.visible.empty() && surface.visible[vertex] == Sight::both);
  return is_either ? std::abs(cosine) >= constants_.least_undecided_cosine
                   : cosine >= constants_.least_cosine;
}

/// First from the vertices that are given. Where these are not near, or missing, the nearest one is
/// sought among all, for which a search tree is made only then.
Agreements SurfaceComparison::compare(const Surface& surface, const Measurement& scan,
                                      std::span<const std::uint32_t> near) const {
  const std::size_t stride = stride_of(scan);
  const std::size_t n = (scan.size() + stride - 1) / stride;
  const double far = constants_.far_distance;
  const auto local_at = [&](std::size_t point) {
    return Local{surface.x, scan.point(point), 1 / surface.mean_edge};
  };
  std::vector<Place> places(n, {0, everywhere});
  constexpr Index point_weight = 4;  // of the work of a vertex
  if (!near.empty()) {
    workers_.for_each_short_chunk(
        static_cast<Index>(n),
        [&](Index first, Index last) {
          for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(last); ++i) {
            if (near[i * stride] == Measurement::no_guess) continue;
            const Local local = local_at(i * stride);
            places[i] = nearest_around(local, walk(local, near[i * stride]));
          }
        },
        point_weight);
  }
  const auto is_near = [&](const Place& place) { return place.squared <= far * far; };
  if (!std::ranges::all_of(places, is_near)) {
    PointScan vertices;
    vertices.points.assign(surface.x.begin(), surface.x.end());
    vertices.normals.resize(surface.x.size());
    vertices.index();
    workers_.for_each_short_chunk(
        static_cast<Index>(n),
        [&](Index first, Index last) {
          for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(last); ++i) {
            if (is_near(places[i])) continue;
            const Local local = local_at(i * stride);
            constexpr double any_normal = -2;
            const auto nearest = vertices.find(local.origin, {}, everywhere, any_normal);
            if (!nearest.any) continue;  // the distance is out of range
            Place& place = places[i];
            place = nearest_around(local, nearest.index);
            for (const Index neighbour : cells_[static_cast<Index>(nearest.index)]) {
              const auto other = nearest_around(local, static_cast<std::size_t>(neighbour));
              if (other.squared < place.squared) place = other;
            }
          }
        },
        point_weight);
  }

  const auto strays =
      find_strays(scan, stride, n, constants_, [&](std::size_t i) { return is_near(places[i]); });
  Sum all;
  const auto sensors = scan.viewpoints();
  std::vector<Sum> of_sensors(sensors.size());
  for (std::size_t i = 0; i < n; ++i) {
    if (strays[i] != 0) continue;
    const bool agreeing = agrees(surface, scan, i * stride, places[i].vertex);
    all.add(places[i].squared, is_near(places[i]), agreeing);
    if (of_sensors.empty()) continue;
    of_sensors[scan.sensor_of(i * stride)].add(places[i].squared, is_near(places[i]), agreeing);
  }
  Agreements found;
  found.all = all.result(surface.mean_edge);
  for (const Sum& sum : of_sensors) found.of_sensors.push_back(sum.result(surface.mean_edge));
  return found;
}

}  // namespace dynmesh
