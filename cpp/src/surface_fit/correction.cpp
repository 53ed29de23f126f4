#include "surface_fit/correction.hpp"

#include <algorithm>
#include <cmath>

#include "base/geometry.hpp"
#include "shape/rotations.hpp"

namespace dynmesh {

Correction::Correction(Field followed, std::span<const Quaternion> q, const TrackingMemory& last,
                       const TrackingConstants& constants, Workers& workers)
    : followed_(followed.begin(), followed.end()),
      last_(followed.size()),
      share_(last.correction_share),
      constants_(constants),
      workers_(workers) {
  turn(q, last.corrections, last_, workers_);
}

std::vector<Vector3> Correction::start() const {
  std::vector<Vector3> x = followed_;
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + share_ * last_[v];
  return x;
}

void Correction::end(Field normals, std::span<const Quaternion> q, std::span<Vector3> x,
                     TrackingMemory& next) const {
  double common = 0;
  double found = 0;
  double before = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    const auto led = x[v] - followed_[v];
    const auto newly = led - share_ * last_[v];
    common += dot(newly, last_[v]);
    found += squared_norm(newly);
    before += squared_norm(last_[v]);
    const auto along = led - dot(led, normals[v]) * normals[v];
    x[v] = x[v] + constants_.beyond_correction * share_ * along;
    next.corrections[v] = x[v] - followed_[v];
  }
  turn_back(q, next.corrections, next.corrections, workers_);
  const double scale = std::sqrt(found * before);
  const double cosine = scale > 0 ? common / scale : 0;
  next.correction_share = std::clamp(share_ + constants_.correction_growth * cosine, 0.0,
                                     constants_.largest_correction);
}

void forget_correction(TrackingMemory& memory) {
  std::ranges::fill(memory.corrections, Vector3{});
  memory.correction_share = 0;
}

}  // namespace dynmesh
