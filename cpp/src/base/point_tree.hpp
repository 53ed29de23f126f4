/// The nearest of some points.
#pragma once

// nanoflann prints to stderr before it throws std::bad_alloc. A library must not print, and
// nanoflann has no setting for this, so its only call of fprintf is taken out. What it includes
// comes first, so that the macro changes nothing else.
#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <dynmesh/types.hpp>
#include <fstream>
#include <functional>
#include <future>
#include <istream>
#include <limits>
#include <ostream>
#include <span>
#include <stdexcept>
#include <unordered_set>
#include <utility>
#include <vector>

#pragma push_macro("fprintf")
#undef fprintf
#define fprintf(...) static_cast<void>(0)
#include <nanoflann.hpp>
#pragma pop_macro("fprintf")

namespace dynmesh {

/// Points in as many dimensions, with a k-d tree (nanoflann) in which they are found. It cannot be
/// copied or moved, as the tree cannot, which refers to the points.
template <std::size_t dimensions>
class PointTree {
 public:
  using Point = std::array<double, dimensions>;

  explicit PointTree(std::vector<Point> points)
      : cloud_{std::move(points)},
        tree_(static_cast<int>(dimensions), cloud_,
              nanoflann::KDTreeSingleIndexAdaptorParams(leaf_size)) {}

  [[nodiscard]] bool empty() const { return cloud_.points.empty(); }

  /// Calls `visit(number, squared_distance)` for points that are nearer to a position than the
  /// radius, in any order. It returns the squared radius in which the search goes on; 0 ends it.
  template <class Visit>
  void search(const Point& position, double squared_radius, const Visit& visit) const {
    // The tree would look at all of the points that coincide with the position.
    if (!(squared_radius > 0)) return;
    struct Search {
      using DistanceType [[maybe_unused]] = double;

      const Visit& visit;
      double squared_radius;

      [[nodiscard]] std::size_t size() const { return 0; }
      [[nodiscard]] bool full() const { return true; }
      [[nodiscard]] double worstDist() const { return squared_radius; }
      bool addPoint(double squared, std::uint32_t number) {
        if (squared < squared_radius) squared_radius = visit(number, squared);
        return squared_radius > 0;
      }
    };
    Search result{visit, squared_radius};
    tree_.findNeighbors(result, position.data(), {});
  }

  struct Nearest {
    std::uint32_t number = 0;
    double squared = std::numeric_limits<double>::infinity();  ///< if there is no point
  };
  [[nodiscard]] Nearest nearest(const Point& position) const {
    Nearest found;
    search(position, found.squared, [&](std::uint32_t number, double squared) {
      found = {number, squared};
      return squared;
    });
    return found;
  }
  /// Finds as many of the nearest points as there is room for, or all, by ascending distances.
  /// Returns their number.
  std::size_t nearest(const Point& position, std::span<std::uint32_t> numbers,
                      std::span<double> squared) const {
    nanoflann::KNNResultSet<double, std::uint32_t> result(numbers.size());
    result.init(numbers.data(), squared.data());
    tree_.findNeighbors(result, position.data(), {});
    return result.size();
  }

 private:
  /// Between 8 and 32, building and searching together hardly change.
  static constexpr std::size_t leaf_size = 16;

  struct Cloud {
    std::vector<Point> points;

    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t c) const { return points[i][c]; }
    template <class Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
  };

  Cloud cloud_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud,
                                      static_cast<int>(dimensions), std::uint32_t>
      tree_;
};

inline std::array<double, 3> array_of(const Vector3& x) { return {x.x, x.y, x.z}; }
inline std::vector<std::array<double, 3>> arrays_of(Field points) {
  std::vector<std::array<double, 3>> arrays(points.size());
  std::ranges::transform(points, arrays.begin(), array_of);
  return arrays;
}

}  // namespace dynmesh
