/// What sensors measured of a surface in one frame.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>

#include "support/geometry.hpp"

namespace dynmesh {

/// A measured point of the surface and the unit normal there, which point to one vertex. A weight
/// of 0 means that the vertex has none.
struct Correspondence {
  Vector3<double> point;
  Vector3<double> normal;
  double weight = 0;
  std::uint32_t number = 0;  ///< which of the measured points it is
};

/// The points of one frame, in the unit of the template.
class Measurement {
 public:
  using Field = std::span<const Vector3<double>>;

  Measurement() = default;
  Measurement(const Measurement&) = delete;
  Measurement& operator=(const Measurement&) = delete;
  Measurement(Measurement&&) = delete;
  Measurement& operator=(Measurement&&) = delete;
  virtual ~Measurement() = default;

  /// Where the sensors are; empty if that is not known.
  [[nodiscard]] virtual Field viewpoints() const = 0;

  /// The number of measured points, and the position and the normal of one of them.
  [[nodiscard]] virtual std::size_t size() const = 0;
  [[nodiscard]] virtual Vector3<double> point(std::size_t i) const = 0;
  [[nodiscard]] virtual Vector3<double> normal(std::size_t i) const = 0;
  /// Whether that normal may as well be the opposite.
  [[nodiscard]] virtual bool is_undecided(std::size_t i) const = 0;

  /// Which of the viewpoints a point was measured from. Must not be called without any.
  [[nodiscard]] virtual std::size_t sensor_of(std::size_t i) const = 0;

  /// The squared distance from a point to the so manyth nearest of the others around it; infinite
  /// if there are fewer.
  [[nodiscard]] virtual double squared_spacing(std::size_t i, std::size_t neighbours) const = 0;

  /// The measured point that is nearest to `position`, among those within `radius` whose normal
  /// agrees with `normal`: the cosine between them is at least `agreement`. The weight of the
  /// result is 1, or 0 if there is none. `guess` is the number of a point that may be near, or
  /// `no_guess`; a good one saves time. May be called by several threads at once.
  [[nodiscard]] virtual Correspondence nearest(const Vector3<double>& position,
                                               const Vector3<double>& normal, double radius,
                                               double agreement, std::uint32_t guess) const = 0;
  /// The same for a sheet that is measured from both sides: the normal may agree with the opposite
  /// of `normal` as well.
  [[nodiscard]] Correspondence nearest_of_both_sides(const Vector3<double>& position,
                                                     const Vector3<double>& normal, double radius,
                                                     double agreement, std::uint32_t guess) const {
    // The side of the guess first: what it finds bounds the search on the other side.
    const bool is_back = guess != no_guess && dot(this->normal(guess), normal) < 0;
    const auto side = is_back ? -1.0 * normal : normal;
    const auto first = nearest(position, side, radius, agreement, guess);
    const double nearer =
        first.weight > 0 ? std::sqrt(squared_norm(first.point - position)) : radius;
    const auto second = nearest(position, -1.0 * side, nearer, agreement, guess);
    return second.weight > 0 ? second : first;
  }

  /// Whether a sensor looked through `position` at something that is farther by more than `margin`,
  /// so that no surface with this normal can be there. False where that is not known.
  [[nodiscard]] virtual bool is_free(const Vector3<double>& /*position*/,
                                     const Vector3<double>& /*normal*/, double /*margin*/) const {
    return false;
  }

  static constexpr std::uint32_t no_guess = std::numeric_limits<std::uint32_t>::max();
};

}  // namespace dynmesh
