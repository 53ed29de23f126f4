/// The places of a surface that are nearest to given points.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

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
  [[nodiscard]] Vector3<double> on(std::span<const Vector3<double>> field) const {
    return shares[0] * field[corners[0]] + shares[1] * field[corners[1]] +
           shares[2] * field[corners[2]];
  }
};

/// Finds nearest places on a surface X whose positions change: a tree of boxes around its triangles
/// is divided once, by frame 0, and the boxes follow X. Allocates memory only in the constructor
/// and in `divide`.
class SurfacePlaces {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `faces` must outlive this object.
  explicit SurfacePlaces(std::span<const Triangle> faces) : faces_(faces) {}

  /// Divides the triangles by where they are in a frame.
  void divide(Field frame);
  /// Lets the boxes contain the triangles of X.
  void follow(Field x);

  /// The nearest place of X to a point, if it is nearer than `within`, which may be the place of
  /// another position: a near one saves time. `accepts(place)` may refuse places.
  template <class Accept>
  [[nodiscard]] Place nearest(Field x, const Vector3<double>& point, Place within,
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
  /// (n,) the nearest places of X to the points of a scan.
  [[nodiscard]] std::vector<Place> nearest_to_all(Field x, const PointScan& scan,
                                                  Workers& workers) const;

  /// The place of one triangle of X that is nearest to a point.
  [[nodiscard]] Place place_on(Field x, std::uint32_t face, const Vector3<double>& point) const;

 private:
  // Halves have equal sizes, so that a tree of 2^32 triangles has no more.
  static constexpr std::size_t most_levels = 40;
  static constexpr std::uint32_t leaf_size = 2;

  struct Node {
    Vector3<double> least, most;
    std::uint32_t first = 0;  ///< of its two children, or of its triangles in order_
    std::uint32_t count = 0;  ///< of its triangles; 0 if it has children

    [[nodiscard]] double squared_distance(const Vector3<double>& point) const {
      const auto outside = [](double low, double x, double high) {
        return std::max({low - x, 0.0, x - high});
      };
      return squared_norm(Vector3<double>{outside(least.x, point.x, most.x),
                                          outside(least.y, point.y, most.y),
                                          outside(least.z, point.z, most.z)});
    }
  };
  struct Waiting {
    std::uint32_t node;
    double squared;
  };

  std::span<const Triangle> faces_;
  std::vector<Node> nodes_;  // children after their parents
  std::vector<std::uint32_t> order_;
};

}  // namespace dynmesh
