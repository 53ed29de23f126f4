#include "registration/part_starts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"
#include "base/rigid_motion.hpp"
#include "registration/constants.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {
namespace {

using Motion = Eigen::Isometry3d;

/// A motion of the part, and the share of its places that it leaves unexplained; a place counts
/// the less the nearer it is.
struct Start {
  Motion motion = Motion::Identity();
  double cost = std::numeric_limits<double>::infinity();
};

/// The places of a part, with a search tree of the points of the whole in the six dimensions of
/// position and normal. Lengths are in mean distances of the places from their centre.
class Sliding {
 public:
  Sliding(const PointScan& part, const PointScan& whole) : whole_(whole) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    const auto n = static_cast<double>(part.size());
    for (const auto& point : part.points) centre += to_eigen(point) / n;
    for (const auto& point : part.points) size_ += (to_eigen(point) - centre).norm() / n;
    // The first places are spread all over the part.
    const std::size_t n_places = std::min(part_start_constants.places, part.size());
    const auto golden =
        static_cast<std::size_t>(std::llround(static_cast<double>(n_places) / std::numbers::phi));
    std::size_t step = std::max<std::size_t>(golden, 1);
    while (std::gcd(step, n_places) != 1) ++step;
    for (std::size_t i = 0; i < n_places; ++i) {
      const std::size_t p = (i * step % n_places) * part.size() / n_places;
      places_.push_back(
          {to_eigen(part.points[p]), to_eigen(part.normals[p]), part.is_undecided(p)});
    }
    std::vector<Row> rows;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      rows.push_back(row(to_eigen(whole.points[i]), to_eigen(whole.normals[i])));
    }
    tree_.emplace(std::move(rows));
  }

  [[nodiscard]] double size() const { return size_; }

  /// The starts at which some places of the part lie on points all over the whole.
  [[nodiscard]] std::vector<Start> laid_on() const {
    std::vector<Start> best;
    const auto is_better = [](const Start& a, const Start& b) { return a.cost < b.cost; };
    const auto seeds = spread_points();
    for (const std::size_t i : flat_places()) {
      const Place& place = places_[i];
      for (const std::size_t seed : seeds) {
        const Eigen::Vector3d point = to_eigen(whole_.points[seed]);
        const Eigen::Vector3d normal = to_eigen(whole_.normals[seed]);
        const bool is_either = whole_.is_undecided(seed) || place.is_undecided;
        for (const double side : {1.0, -1.0}) {
          if (side < 0 && !is_either) break;
          const auto turn = Eigen::Quaterniond::FromTwoVectors(place.normal, side * normal);
          for (int angle = 0; angle < part_start_constants.angles; ++angle) {
            const double radians = 2 * std::numbers::pi * angle / part_start_constants.angles;
            Start start;
            start.motion.linear() =
                Eigen::AngleAxisd(radians, side * normal).toRotationMatrix() * turn;
            start.motion.translation() = point - start.motion.linear() * place.point;
            const bool is_full = best.size() == part_start_constants.laid;
            const double limit =
                is_full ? best.front().cost : std::numeric_limits<double>::infinity();
            start.cost = cost(start.motion, part_start_constants.reach,
                              part_start_constants.few_places, limit);
            if (!(start.cost < limit)) continue;
            best.push_back(start);
            std::ranges::push_heap(best, is_better);
            if (!is_full) continue;
            std::ranges::pop_heap(best, is_better);
            best.pop_back();
          }
        }
      }
    }
    return best;
  }

  /// Improves a start with the nearest pairs within a distance.
  [[nodiscard]] Start improved(Start start, double reach, std::size_t n) const {
    n = std::min(n, places_.size());
    for (int step = 0; step < part_start_constants.steps; ++step) {
      std::vector<Vector3> ours;
      std::vector<SurfaceRow> rows;
      for (std::size_t i = 0; i < n; ++i) {
        const auto [nearest, squared] = nearest_to(start.motion, places_[i], reach);
        if (!std::isfinite(squared)) continue;
        const auto number = static_cast<std::uint32_t>(ours.size());
        ours.push_back(from_eigen(start.motion * places_[i].point));
        rows.push_back(
            {{0, {number, number, number}}, whole_.normals[nearest], whole_.points[nearest], 1});
      }
      if (rows.size() < part_start_constants.fewest_pairs) break;
      start.motion = fit_to_planes(rows, ours) * start.motion;
    }
    start.cost = cost(start.motion, reach, n, std::numeric_limits<double>::infinity());
    return start;
  }

  /// The best starts that differ, at most so many.
  [[nodiscard]] std::vector<Start> best_of(std::vector<Start> starts, std::size_t most) const {
    std::ranges::stable_sort(starts, {}, &Start::cost);
    std::vector<Start> best;
    for (const Start& start : starts) {
      if (best.size() == most) break;
      const bool is_new = std::ranges::all_of(best, [&](const Start& other) {
        double sum = 0;
        const std::size_t n = std::min(part_start_constants.few_places, places_.size());
        for (std::size_t i = 0; i < n; ++i) {
          const Eigen::Vector3d& p = places_[i].point;
          sum += (start.motion * p - other.motion * p).norm();
        }
        return sum > part_start_constants.same * size_ * static_cast<double>(n);
      });
      if (is_new) best.push_back(start);
    }
    return best;
  }

 private:
  using Row = PointTree<6>::Point;
  struct Place {
    Eigen::Vector3d point, normal;
    bool is_undecided = false;
  };

  [[nodiscard]] Row row(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d n = part_start_constants.normal * size_ * normal;
    return {point.x(), point.y(), point.z(), n.x(), n.y(), n.z()};
  }

  /// The nearest point of the whole to a place, and its squared distance; infinite beyond `reach`.
  [[nodiscard]] PointTree<6>::Nearest nearest_to(const Motion& motion, const Place& place,
                                                 double reach) const {
    const Eigen::Vector3d point = motion * place.point;
    const Eigen::Vector3d normal = motion.linear() * place.normal;
    PointTree<6>::Nearest best;
    double squared_reach = std::pow(reach * size_, 2);
    for (const double side : {1.0, -1.0}) {
      // Undecided points of the whole may face either way.
      if (side < 0 && !place.is_undecided && whole_.undecided.empty()) break;
      tree_->search(row(point, side * normal), squared_reach,
                    [&](std::uint32_t number, double squared) {
                      if (side < 0 && !place.is_undecided && !whole_.is_undecided(number)) {
                        return squared_reach;
                      }
                      best = {number, squared};
                      return squared_reach = squared;
                    });
    }
    return best;
  }

  /// Whether a sensor of the whole may see a place.
  [[nodiscard]] bool is_seen(const Motion& motion, const Place& place) const {
    if (whole_.sensors.empty()) return true;
    const Eigen::Vector3d point = motion * place.point;
    const Eigen::Vector3d normal = motion.linear() * place.normal;
    return std::ranges::any_of(whole_.sensors, [&](const Vector3& sensor) {
      return normal.dot(to_eigen(sensor) - point) > 0;
    });
  }

  /// The mean of the squared distances of those of the first n places that should be seen, of which
  /// none counts more than 1; infinite from a limit on.
  [[nodiscard]] double cost(const Motion& motion, double reach, std::size_t n, double limit) const {
    n = std::min(n, places_.size());
    const double most = limit * static_cast<double>(n);
    double sum = 0;
    double seen = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (!is_seen(motion, places_[i])) continue;
      seen += 1;
      const double squared = nearest_to(motion, places_[i], reach).squared;
      sum += std::isfinite(squared) ? squared / std::pow(reach * size_, 2) : 1;
      if (!(sum < most)) return std::numeric_limits<double>::infinity();
    }
    return seen > 0 ? sum / seen : std::numeric_limits<double>::infinity();
  }

  /// Places apart around which the part is flat, so that their normals tell a rotation.
  [[nodiscard]] std::vector<std::size_t> flat_places() const {
    std::vector<std::pair<double, std::size_t>> flat;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double n = 0;
      for (const Place& other : places_) {
        if ((other.point - places_[i].point).norm() > part_start_constants.around * size_) continue;
        sum += other.normal.dot(places_[i].normal) < 0 && other.is_undecided ? -other.normal
                                                                             : other.normal;
        n += 1;
      }
      // Places at the border of the part have fewer neighbours; those of the whole have more.
      flat.emplace_back(-sum.norm() * std::sqrt(n) / n, i);
    }
    std::ranges::sort(flat);
    std::vector<std::size_t> chosen;
    for (const auto& [negative, i] : flat) {
      if (chosen.size() == part_start_constants.laid_places) break;
      const bool is_apart = std::ranges::all_of(chosen, [&](std::size_t other) {
        return (places_[i].point - places_[other].point).norm() >
               part_start_constants.apart * size_;
      });
      if (is_apart) chosen.push_back(i);
    }
    return chosen;
  }

  /// Points of the whole at regular distances.
  [[nodiscard]] std::vector<std::size_t> spread_points() const {
    const PointTree<3> tree(arrays_of(whole_.points));
    for (double spacing = part_start_constants.spacing * size_;; spacing *= std::numbers::sqrt2) {
      std::vector<std::uint8_t> is_taken(whole_.size());
      std::vector<std::size_t> chosen;
      for (std::size_t i = 0; i < whole_.size(); ++i) {
        if (is_taken[i] != 0 || squared_norm(whole_.normals[i]) == 0) continue;
        chosen.push_back(i);
        const double squared = spacing * spacing;
        tree.search(array_of(whole_.points[i]), squared, [&](std::uint32_t other, double) {
          if (dot(whole_.normals[other], whole_.normals[i]) > 0) is_taken[other] = 1;
          return squared;
        });
      }
      if (chosen.size() <= part_start_constants.most_points) return chosen;
    }
  }

  const PointScan& whole_;
  std::vector<Place> places_;
  double size_ = 0;
  std::optional<PointTree<6>> tree_;
};

}  // namespace

std::vector<Eigen::Isometry3d> part_starts(const PointScan& part, const PointScan& whole) {
  if (part.size() < part_start_constants.fewest_pairs ||
      whole.size() < part_start_constants.fewest_pairs)
    return {};
  const Sliding sliding(part, whole);
  if (!(sliding.size() > 0)) return {};
  auto starts = sliding.laid_on();
  for (Start& start : starts) {
    start = sliding.improved(start, part_start_constants.reach, part_start_constants.few_places);
  }
  starts = sliding.best_of(std::move(starts), part_start_constants.improved);
  for (Start& start : starts) {
    start = sliding.improved(start, part_start_constants.near_reach, part_start_constants.places);
  }
  std::vector<Eigen::Isometry3d> motions;
  for (const Start& start : sliding.best_of(std::move(starts), part_start_constants.starts)) {
    motions.push_back(start.motion);
  }
  return motions;
}

}  // namespace dynmesh
