/// What a measurement says about a vertex.
#pragma once

#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

/// A measured point of the surface and the unit normal there. `weight` is 0 if there is none.
struct Correspondence {
  Vector3<double> point;
  Vector3<double> normal;
  double weight = 0;
};

/// What the sensors measured of a frame.
class Measurement {
 public:
  using Field = std::span<const Vector3<double>>;

  Measurement() = default;
  Measurement(const Measurement&) = delete;
  Measurement& operator=(const Measurement&) = delete;
  Measurement(Measurement&&) = delete;
  Measurement& operator=(Measurement&&) = delete;
  virtual ~Measurement() = default;

  /// The nearest measured point within `radius` of `position` whose normal agrees with `normal`:
  /// their cosine is at least `agreement`. Without one, the weight of the result is 0, else 1.
  [[nodiscard]] virtual Correspondence nearest(const Vector3<double>& position,
                                               const Vector3<double>& normal, double radius,
                                               double agreement) const = 0;
};

}  // namespace dynmesh
