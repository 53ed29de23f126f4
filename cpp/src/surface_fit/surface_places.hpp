/// The sides and the normals of a surface, and its places that are nearest to given points.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/geometry.hpp"

namespace dynmesh {

/// (3 n,) of each side of each triangle, numbered as the corner opposite: the next one with the
/// same ends, and after the last one the first. A side of the boundary is its own.
std::vector<std::uint32_t> next_sides(std::span<const Triangle> faces);

/// (k,) the mean of the normals of the faces around each vertex, weighted by area, of unit length;
/// 0 where that is not defined.
std::vector<Vector3> vertex_normals(std::span<const Triangle> faces, Field frame);

/// (components,) -1 if the faces of a component are wound such that they enclose a negative volume,
/// else 1.
std::vector<double> find_outsides(std::span<const Triangle> faces, const Topology& topology,
                                  Field frame, double mean_edge);

/// A place on a surface: the sum of the corners of a triangle times their shares, which add up to 1
/// (barycentric coordinates).
struct Place {
  std::uint32_t face = 0;
  std::array<std::uint32_t, 3> corners{};
  std::array<double, 3> shares{1, 0, 0};
  double squared = std::numeric_limits<double>::infinity();  ///< of the distance from the point

  [[nodiscard]] bool any() const { return squared < std::numeric_limits<double>::infinity(); }
  /// The corner with the largest share.
  [[nodiscard]] std::uint32_t nearest_corner() const {
    return corners[shares[1] > shares[0] ? (shares[2] > shares[1] ? 2 : 1)
                                         : (shares[2] > shares[0] ? 2 : 0)];
  }
  [[nodiscard]] Vector3 on(Field field) const {
    return shares[0] * field[corners[0]] + shares[1] * field[corners[1]] +
           shares[2] * field[corners[2]];
  }
};

/// The barycentric coordinates of the place of a triangle that is nearest to the origin (Ericson
/// 2005).
inline std::array<double, 3> nearest_shares(const Vector3& a, const Vector3& b, const Vector3& c) {
  const auto ab = b - a;
  const auto ac = c - a;
  const double a1 = -dot(ab, a);
  const double a2 = -dot(ac, a);
  if (a1 <= 0 && a2 <= 0) return {1, 0, 0};
  const double b1 = -dot(ab, b);
  const double b2 = -dot(ac, b);
  if (b1 >= 0 && b2 <= b1) return {0, 1, 0};
  const double area_c = a1 * b2 - b1 * a2;
  if (area_c <= 0 && a1 >= 0 && b1 <= 0) {
    const double share = a1 / (a1 - b1);
    return {1 - share, share, 0};
  }
  const double c1 = -dot(ab, c);
  const double c2 = -dot(ac, c);
  if (c2 >= 0 && c1 <= c2) return {0, 0, 1};
  const double area_b = c1 * a2 - a1 * c2;
  if (area_b <= 0 && a2 >= 0 && c2 <= 0) {
    const double share = a2 / (a2 - c2);
    return {1 - share, 0, share};
  }
  const double area_a = b1 * c2 - c1 * b2;
  if (area_a <= 0 && b2 >= b1 && c1 >= c2) {
    const double share = (b2 - b1) / ((b2 - b1) + (c1 - c2));
    return {0, 1 - share, share};
  }
  const double sum = area_a + area_b + area_c;
  return {1 - area_b / sum - area_c / sum, area_b / sum, area_c / sum};
}

/// Finds nearest places on a surface X whose positions change: a tree of boxes around its triangles
/// is divided once, by frame 0, and the boxes follow X. Allocates memory only in the constructor.
class SurfacePlaces {
 public:
  /// Divides the triangles by where they are in a frame. `faces` must outlive this object.
  SurfacePlaces(std::span<const Triangle> faces, Field frame);

  /// Lets the boxes contain the triangles of X.
  void update_boxes(Field x);

  /// The nearest place of X to a point, if it is nearer than `within`, which may be the place of
  /// another position: a near one saves time. `accepts(place)` may refuse places.
  template <class Accept>
  [[nodiscard]] Place nearest(Field x, const Vector3& point, Place within,
                              const Accept& accepts) const {
    std::array<Waiting, most_levels> stack;
    std::size_t n = 0;
    stack[n++] = {0, 0};
    while (n > 0) {
      const Waiting next = stack[--n];
      if (!(next.squared < within.squared)) continue;
      const Node& node = nodes_[next.node];
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
          const Place place = place_on(x, order_[i], point);
          if (place.squared < within.squared && accepts(place)) within = place;
        }
        continue;
      }
      const Waiting left = {node.first, nodes_[node.first].squared_distance(point)};
      const Waiting right = {node.first + 1, nodes_[node.first + 1].squared_distance(point)};
      const auto& [near, far] = std::minmax(
          left, right, [](const Waiting& a, const Waiting& b) { return a.squared < b.squared; });
      if (far.squared < within.squared) stack[n++] = far;
      if (near.squared < within.squared) stack[n++] = near;
    }
    return within;
  }
  /// The place of X to which a point comes from another one, over triangles that have a common edge
  /// or corner, as long as it comes nearer to the point.
  [[nodiscard]] Place walk(Field x, const Vector3& point, std::uint32_t from) const;
  /// The place of one triangle of X that is nearest to a point.
  [[nodiscard]] Place place_on(Field x, std::uint32_t face, const Vector3& point) const;

 private:
  // Halves have equal sizes, so that a tree of 2^32 triangles has no more.
  static constexpr std::size_t most_levels = 40;
  static constexpr std::uint32_t leaf_size = 4;

  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t first = 0;  ///< of its two children, or of its triangles in order_
    std::uint32_t count = 0;  ///< of its triangles; 0 if it has children

    [[nodiscard]] double squared_distance(const Vector3& point) const {
      const Eigen::Array3d p(point.x, point.y, point.z);
      return (box.min().array() - p).max(p - box.max().array()).max(0).matrix().squaredNorm();
    }
  };
  struct Waiting {
    std::uint32_t node;
    double squared;
  };

  std::span<const Triangle> faces_;
  std::vector<Node> nodes_;  // children after their parents
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> next_sides_;
  Cells faces_at_;  // the faces at each vertex, instead of its neighbours
};

inline Place SurfacePlaces::place_on(Field x, std::uint32_t face, const Vector3& point) const {
  Place place;
  place.face = face;
  std::array<Vector3, 3> arms;
  for (std::size_t c = 0; c < 3; ++c) {
    place.corners[c] = static_cast<std::uint32_t>(faces_[face][c]);
    arms[c] = x[place.corners[c]] - point;
  }
  place.shares = nearest_shares(arms[0], arms[1], arms[2]);
  place.squared = squared_norm(place.shares[0] * arms[0] + place.shares[1] * arms[1] +
                               place.shares[2] * arms[2]);
  return place;
}

}  // namespace dynmesh
