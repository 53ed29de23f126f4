/// What sensors measured in one frame: points with normals.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "base/point_tree.hpp"
#include "base/workers.hpp"

namespace dynmesh {

/// How far the noise of points may turn a normal, as a standard deviation in radians; beyond that,
/// more points determine it.
inline constexpr double most_uncertain_normal = 0.15;

/// Fill `points`, `normals` and `sensors`. The first search builds a tree of the points, which must
/// not change from then on, and allocates memory, as does the first call of `along_curve`. Several
/// threads may search at once.
class PointScan {
 public:
  std::vector<Vector3> points;   ///< (n,) finite
  std::vector<Vector3> normals;  ///< (n,) of unit length; 0 if it is not known
  std::vector<Vector3> sensors;  ///< (c,) where they stand, may be empty
  std::vector<Vector3> colours;  ///< (n,) in any unit; empty if they are not known

  /// Sets each normal to that of the plane that fits the nearest points best (Hoppe et al. 1992),
  /// or those within the radius if they are more, or still more where noise hides the direction of
  /// the plane, turned to the sensors. Without sensors, or if the
  /// plane lies between two of them, the direction stays undecided: the normal then agrees with its
  /// opposite as well. Points at the same position count once. Points on a line have no normal.
  void estimate_normals(double radius, Workers& workers);
  /// Finds which of several sensors measured each point: the one that its normal turns to most.
  void find_sensors(Workers& workers);

  [[nodiscard]] std::size_t size() const { return points.size(); }
  [[nodiscard]] bool is_undecided(std::size_t i) const {
    return !undecided.empty() && undecided[i] != 0;
  }
  /// Which sensor measured a point; of a single one, or if that is not known, the first one.
  [[nodiscard]] std::size_t sensor_of(std::size_t i) const {
    return sensor_numbers.empty() ? 0 : sensor_numbers[i];
  }
  /// The squared distance from a point to the fourth nearest of the others; infinite if there are
  /// fewer.
  [[nodiscard]] double squared_spacing(std::size_t i) const;

  /// The distance from a position to the nearest point.
  [[nodiscard]] double distance(const Vector3& position) const {
    return std::sqrt(tree().nearest(array_of(position)).squared);
  }
  /// The numbers of the points that are nearest to a point, itself first, at most `count`.
  [[nodiscard]] std::vector<std::uint32_t> nearest_to(std::size_t number, std::size_t count) const;

  /// (n,) permutation: the numbers of the points in an order in which neighbours are near (Morton
  /// 1966), so that what is found for them is near in memory as well.
  [[nodiscard]] std::span<const std::uint32_t> along_curve() const;

  /// (n,) which of the sensors measured each point; empty if that is not known.
  std::vector<std::uint32_t> sensor_numbers;
  /// (n,) 1 for normals that may as well be the opposite; empty if there are none.
  std::vector<std::uint8_t> undecided;

 private:
  [[nodiscard]] double cosine_to(const Vector3& sensor, std::size_t i) const;
  /// Sets a normal, turned to the sensors, and whether that was possible.
  void set_normal(std::size_t i, const Vector3& normal);

  [[nodiscard]] const PointTree<3>& tree() const;

  struct Search {
    std::once_flag begun, ordered;
    std::optional<PointTree<3>> tree;
    std::vector<std::uint32_t> order;
  };
  std::unique_ptr<Search> search_ = std::make_unique<Search>();
};

}  // namespace dynmesh
