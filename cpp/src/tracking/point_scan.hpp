/// What sensors measured in one frame: points with normals.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "support/quiet_nanoflann.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Finds nearest points with a k-d tree (nanoflann). Fill `points`, `normals` and `sensors`, then
/// call `index`. Allocates memory there, and where the arrays grow.
class PointScan {
 public:
  PointScan() : cloud_{&points} {}
  // The tree refers to the points.
  PointScan(const PointScan&) = delete;
  PointScan& operator=(const PointScan&) = delete;
  PointScan(PointScan&&) = delete;
  PointScan& operator=(PointScan&&) = delete;
  ~PointScan() = default;

  std::vector<Vector3<double>> points;   ///< (n,) finite
  std::vector<Vector3<double>> normals;  ///< (n,) of unit length; 0 agrees with nothing
  std::vector<Vector3<double>> sensors;  ///< (c,) where they stand, may be empty

  /// Builds the tree of `points`, which all searches need.
  void index() const;
  [[nodiscard]] bool is_indexed() const { return tree_.has_value(); }
  /// Forgets the tree. Call it where the points change.
  void forget_index() { tree_.reset(); }

  /// Sets each normal to that of the plane that fits the nearest points best (Hoppe et al. 1992),
  /// turned to the sensors. Call `index` before. Without sensors, or if the plane lies between two
  /// of them, the direction stays undecided: the normal then agrees with its opposite as well.
  /// Points at the same position count once.
  void estimate_normals(Workers& workers);

  using Field = std::span<const Vector3<double>>;

  [[nodiscard]] Field viewpoints() const { return sensors; }
  [[nodiscard]] std::size_t size() const { return points.size(); }
  [[nodiscard]] Vector3<double> point(std::size_t i) const { return points[i]; }
  [[nodiscard]] Vector3<double> normal(std::size_t i) const { return normals[i]; }
  [[nodiscard]] bool is_undecided(std::size_t i) const {
    return !undecided.empty() && undecided[i] != 0;
  }
  /// Which sensor measured a point; if that is not known, the one that its normal turns to most.
  [[nodiscard]] std::size_t sensor_of(std::size_t i) const;
  /// The squared distance from a point to the so manyth nearest of the others; infinite if there
  /// are fewer.
  [[nodiscard]] double squared_spacing(std::size_t i, std::size_t neighbours) const;

  /// The nearest agreeing point, if there is any.
  struct Nearest {
    bool any = false;
    std::uint32_t index = 0;
    double squared_distance = std::numeric_limits<double>::infinity();
  };
  [[nodiscard]] Nearest find(const Vector3<double>& position, const Vector3<double>& normal,
                             double radius, double agreement) const;
  /// The nearest point within a radius that is accepted, if there is any.
  template <class Accept>
  [[nodiscard]] Nearest find_if(const Vector3<double>& position, double radius,
                                const Accept& accept) const {
    struct NearestAccepted {
      using DistanceType [[maybe_unused]] = double;

      const Accept& accept;
      double squared_radius;
      Nearest nearest = {};

      [[nodiscard]] std::size_t size() const { return nearest.any ? 1 : 0; }
      [[nodiscard]] bool full() const { return true; }
      [[nodiscard]] double worstDist() const {
        return std::min(squared_radius, nearest.squared_distance);
      }
      bool addPoint(double squared, std::uint32_t number) {
        if (squared < worstDist() && accept(number)) nearest = {true, number, squared};
        return true;
      }
    };
    NearestAccepted result{accept, radius * radius};
    const double query[3] = {position.x, position.y, position.z};
    if (tree_) tree_->findNeighbors(result, query, {});
    return result.nearest;
  }

  /// The numbers of the points that are nearest to a point, itself first, at most `count`.
  [[nodiscard]] std::vector<std::uint32_t> nearest_to(std::size_t number, std::size_t count) const;

  /// Calls `visit(number)` for each point within a radius, in any order.
  template <class Visit>
  void for_each_within(const Vector3<double>& position, double radius, const Visit& visit) const {
    struct Within {
      using DistanceType [[maybe_unused]] = double;

      const Visit& visit;
      double squared_radius;

      [[nodiscard]] std::size_t size() const { return 0; }
      [[nodiscard]] bool full() const { return true; }
      [[nodiscard]] double worstDist() const { return squared_radius; }
      bool addPoint(double squared, std::uint32_t number) {
        if (squared < squared_radius) visit(number);
        return true;
      }
    };
    if (!tree_) return;
    Within within{visit, radius * radius};
    const double query[3] = {position.x, position.y, position.z};
    tree_->findNeighbors(within, query, {});
  }

  /// (n,) which of the sensors measured each point; empty if that is not known.
  std::vector<std::uint32_t> sensor_numbers;
  /// (n,) 1 for normals that may as well be the opposite; empty if there are none.
  std::vector<std::uint8_t> undecided;

 private:
  struct Cloud {
    const std::vector<Vector3<double>>* points;

    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points->size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t c) const {
      const Vector3<double>& p = (*points)[i];
      return c == 0 ? p.x : c == 1 ? p.y : p.z;
    }
    template <class Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
  };
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>,
                                                   Cloud, 3, std::uint32_t>;

  /// The number of points of a local plane, the point itself included. Fewer follow the noise, more
  /// round off edges.
  static constexpr std::size_t plane_points = 12;
  struct Neighbours {
    std::array<std::uint32_t, plane_points> numbers{};
    std::array<double, plane_points> distances{};
    std::size_t size = 0;

    [[nodiscard]] std::span<const std::uint32_t> chosen() const {
      return std::span(numbers).first(size);
    }
  };
  [[nodiscard]] Neighbours neighbours_of(const Vector3<double>& position) const;
  /// Sets a normal, turned to the sensors, and whether that was possible.
  void set_normal(std::size_t i, const Vector3<double>& normal);

  Cloud cloud_;
  mutable std::optional<Tree> tree_;
};

}  // namespace dynmesh
