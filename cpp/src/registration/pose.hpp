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

struct Pose {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();  ///< with which the bending began
  std::vector<Vector3<double>> x = {};                       ///< (k,) in the internal order
  /// (k,) in the caller's order; the second is empty if it is not wanted.
  std::vector<std::uint8_t> observed = {};
  std::vector<double> standard_errors = {};
  std::size_t rounds = 0;
  bool converged = false;
  Agreement agreement = {};
  Coverage coverage = {};
  double stretch = 0;  ///< of its edges, on average
  bool ambiguous = false;
  RegistrationQuality quality = RegistrationQuality::ruined;

  /// A pose beside which another one fits as well is not good.
  void set_ambiguous(bool value) {
    ambiguous = value;
    if (ambiguous && is_good()) quality = RegistrationQuality::doubtful;
  }
  [[nodiscard]] bool is_good() const { return quality == RegistrationQuality::good; }
  [[nodiscard]] bool is_ruined() const { return quality == RegistrationQuality::ruined; }
  /// The share of the points that it does not explain.
  [[nodiscard]] double unexplained() const { return agreement.far_share + agreement.disagreeing; }
  /// What tells the right pose among several. Exchanged limbs and bodies that are turned front to
  /// back may explain more points, but by a template that is stretched twice as much.
  [[nodiscard]] double misfit() const { return unexplained() + stretch; }
};

}  // namespace dynmesh
