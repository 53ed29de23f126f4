/// A template that was bent into a scan.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <vector>

#include "registration/coverage.hpp"

namespace dynmesh {

/// All arrays are in the internal order.
struct Pose {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();  ///< that comes closest to x
  std::vector<Vector3<double>> x = {};                       ///< (k,)
  std::vector<std::uint8_t> observed = {};                   ///< (k,)
  std::vector<double> standard_errors = {};                  ///< (k,), empty if not wanted
  std::size_t rounds = 0;
  bool converged = false;
  Agreement agreement = {};
  Coverage coverage = {};
  double unexplained = 0;  ///< the share of the points that noise does not explain
  double stretch = 0;      ///< of its edges, on average
  bool has_misplaced_landmarks = false;
  RegistrationQuality quality = RegistrationQuality::ruined;

  [[nodiscard]] bool is_good() const { return quality == RegistrationQuality::good; }
  /// What tells the right pose among several: the share of the points that it does not explain.
  /// Exchanged limbs and bodies that are turned front to back may explain more of them, but by a
  /// template that is stretched twice as much.
  [[nodiscard]] double misfit() const {
    return agreement.far_share + agreement.disagreeing + stretch;
  }
};

}  // namespace dynmesh
