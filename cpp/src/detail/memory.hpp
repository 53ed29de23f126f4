/// The terms of a shape at a vertex.
#pragma once

#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

/// At one vertex, the terms of the shape m + b (m_first - m) + c u, or what belongs to each of
/// them: the term in the axes of the current frame, the step towards it, or K times that step.
struct ShapeTerms {
  Vector3<double> last;     ///< m, the shape of the last frame
  Vector3<double> to_rest;  ///< m_first - m, of which b is added
  Vector3<double> change;   ///< u, the recent change of m per frame, of which c is added
};
static_assert(sizeof(ShapeTerms) == 3 * sizeof(Vector3<double>));

/// The same memory as fields that are stored side by side: (3 k,).
inline std::span<const Vector3<double>> side_by_side(std::span<const ShapeTerms> terms) {
  return {reinterpret_cast<const Vector3<double>*>(terms.data()), 3 * terms.size()};
}
inline std::span<Vector3<double>> side_by_side(std::span<ShapeTerms> terms) {
  return {reinterpret_cast<Vector3<double>*>(terms.data()), 3 * terms.size()};
}

}  // namespace dynmesh
