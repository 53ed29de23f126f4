/// Whether a template lies in a scan, and the rigid motion that puts it there.
#pragma once

#include <array>
#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>

namespace dynmesh {

/// A rigid motion of a template, and what is known of it and a scan. Distances are typical ones
/// between the surface of the template and the scan, small if one of them covers the other: the
/// smaller one of the distance of the median point of the scan from the template, which is small if
/// the scan is of one side, and of that within which 40 % of the template have a point of the scan,
/// which is small if the scan has much else.
struct Alignment {
  /// Row by row. The new position of a vertex x is rotation * x + shift.
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> shift{};  ///< in the unit of the positions
  double mean_edge = 0;           ///< of the template, in the unit of the positions
  double before = 0;              ///< the distance without the motion, in mean edges
  double after = 0;               ///< the distance with it, in mean edges
  double ratio = 0;               ///< how many times as large as the template the scan is
  /// Whether the template lies in the scan as it is, so that a tracker can bridge the distance in
  /// its first frame. Then, the motion is the identity.
  bool lies_in_scan = false;
  /// Whether the template lies in the scan with the motion. If not, it has another pose than the
  /// scan, or is another mesh, and should not be tracked.
  bool matches = false;
  /// Whether one is at least 20 times as large as the other, so that a unit of length is probably
  /// wrong. Then, no motion is sought, and the template does not match.
  bool other_unit = false;
};

/// Finds the rigid motion that puts a template into a scan, from any rotation and position. A
/// tracker follows the template from there; Tracker itself bridges small distances only.
///
/// The motion is found by iterative closest points in position and normal, of which the farthest
/// fifth is ignored (trimmed ICP, Chetverikov et al. 2002), since scans see only one side and may
/// contain more than the subject. From 64 rotations, points are first drawn to points (Besl and
/// McKay 1992), and the best six results then to tangent planes (Chen and Medioni 1991), along
/// which smooth surfaces slide into place. Shapes with symmetries match in several rotations, of
/// which one is returned.
///
/// `faces` are triangles of the template, `first_frame` (k, 3) are its vertices, and `scan` (n, 3)
/// are points of the surface, both in the same unit of length. The motion is found from about 1500
/// of them and 3000 places of the template, and its distances from about 1000 and 4000, so the time
/// is linear in the size of both, for reading them, plus some tenths of a second. Equal input gives
/// equal results.
///
/// Throws std::invalid_argument if there are no faces, vertices or points, if a face refers to a
/// vertex that does not exist, and for a coordinate that is not finite or beyond 1e18 for float or
/// 1e200 for double.
template <class Real>
DYNMESH_EXPORT Alignment find_alignment(Faces faces, Points<const Real> first_frame,
                                        Points<const Real> scan);

}  // namespace dynmesh
