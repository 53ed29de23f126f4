/// The rigid motion that puts a template into the points of a scan.
#pragma once

#include <array>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// The best rigid start, and even samples of the template and of the scan, which show how far they
/// are apart.
struct RigidAlignment {
  std::array<double, 16> motion{};  ///< row by row
  double mean_edge = 0;             ///< of the template
  std::vector<double> surface;      ///< x, y, z of places of the template
  std::vector<double> scan;         ///< x, y, z of some of the points
};

/// Throws std::invalid_argument if there are no faces, vertices or points, if a face refers to a
/// vertex that does not exist, and for a coordinate that is not finite or beyond 1e200.
RigidAlignment align_rigidly(Faces faces, Points<const double> first_frame,
                             Points<const double> scan);

}  // namespace dynmesh
