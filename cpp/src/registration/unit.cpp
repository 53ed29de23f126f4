#include "registration/unit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

#include "tracking/robust_size.hpp"

namespace dynmesh {

double unit_of(std::span<const Vector3<double>> frame, const PointScan& scan, bool may_scale,
               const RegistrationConstants& constants) {
  std::vector<Vector3<double>> points;
  const std::size_t stride = 1 + scan.size() / constants.examined_points;
  for (std::size_t i = 0; i < scan.size(); i += stride) points.push_back(scan.point(i));
  const double size = size_of(frame);
  const double ratio = size > 0 ? size_of(points) / size : 1;
  if (!(ratio > 0) || !std::isfinite(ratio)) {
    throw std::invalid_argument("points: all are at the same position, as far as can be computed");
  }
  if (may_scale) {
    const bool is_other = std::max(ratio, 1 / ratio) > constants.other_unit;
    return is_other ? std::pow(10.0, std::round(std::log10(ratio))) : 1;
  }
  if (std::max(ratio, 1 / ratio) <= constants.largest_ratio) return 1;
  std::array<char, 200> text{};
  (void)std::snprintf(text.data(), text.size(),
                      "points: are %.4g times as large as the template; both must be in the same "
                      "unit of length, unless scale is set",
                      ratio);
  throw std::invalid_argument(text.data());
}

}  // namespace dynmesh
