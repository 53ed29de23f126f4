/// Finds the pose of a template in a scan: tries where it may be, and keeps what fits best.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <dynmesh/quality.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "registration/candidates.hpp"
#include "registration/constants.hpp"
#include "registration/pose_quality.hpp"
#include "surface_fit/coarse_surface.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/surface_errors.hpp"
#include "surface_fit/surface_level.hpp"

namespace dynmesh {

/// A template, and other frames of it.
struct Template {
  std::vector<Triangle> faces;
  std::vector<Vector3> frame;
  TrainingFrames training;
};

/// A template that was bent into a scan.
struct Pose {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();  ///< that comes closest to x
  std::vector<Vector3> x = {};                               ///< (k,)
  std::vector<std::uint8_t> observed = {};                   ///< (k,)
  std::vector<double> standard_errors = {};                  ///< (k,), empty if not wanted
  std::size_t rounds = 0;
  bool converged = false;
  Measure measure = {};
  Fit fit = {};
  bool has_misplaced_landmarks = false;

  [[nodiscard]] bool is_good() const { return measure.quality == Quality::good; }
  /// The least of several tells the right pose.
  [[nodiscard]] std::pair<bool, double> misfit() const {
    return {has_misplaced_landmarks, fit.misfit()};
  }
};

/// Bends the coarse mesh of a template from many candidates, and then the template from the best
/// one. Both are drawn to a scan as a tracker does. Holds nothing on which a result depends.
class PoseSearch {
 public:
  /// `epsilon` is that of the caller's numbers. All other arguments must outlive this object.
  PoseSearch(const Template& given, const Topology& topology, Workers& workers,
             const RegistrationSettings& settings, double epsilon);

  /// `scan` and the targets are in the unit of the template.
  Pose run(const PointScan& scan, const Targets& targets);
  /// How many times as large as the template the coarse mesh becomes, by the median of its edges.
  double growth(const PointScan& scan, const Targets& targets);

 private:
  using Cloud = std::vector<Vector3>;
  /// What a template is sought in.
  struct Wanted {
    const PointScan& scan;
    std::shared_ptr<const PointScan> dense, sample;  ///< of the scan
    Targets held;                                    ///< landmarks of parts that have no points
    Targets checked;                                 ///< all others
    double ratio = 1;  ///< about the area of the scan in that of the template
  };
  struct Trial {
    Candidate candidate = {};
    std::shared_ptr<const PointScan> sample = {};  ///< of the points around it
    Cloud x = {};                                  ///< of the coarse mesh
    Fit fit = {};

    [[nodiscard]] double misfit() const { return fit.misfit(); }
  };
  /// The best pose so far, if there is any, and the coarse meshes from which poses were found.
  struct Found {
    std::optional<Pose> best = {};
    std::vector<Cloud> from = {};

    [[nodiscard]] bool is_good() const { return best && best->is_good(); }
  };

  [[nodiscard]] Wanted wanted(const PointScan& scan, const Targets& targets) const;
  Found search(const Wanted& wanted, const Targets& targets, Found found);
  Found finish_best(const Wanted& wanted, const std::vector<Trial>& trials, bool are_all,
                    Found found);
  Found finish(const Wanted& wanted, const Trial& trial, Found found);
  [[nodiscard]] std::vector<Candidate> by_points(const Wanted& wanted,
                                                 const Targets& targets) const;
  [[nodiscard]] bool are_alike(const Cloud& x, const Cloud& y) const;
  [[nodiscard]] std::vector<Candidate> by_parts(const Wanted& wanted, const Targets& targets) const;
  [[nodiscard]] std::shared_ptr<const PointScan> around(const Eigen::Isometry3d& motion,
                                                        const Wanted& wanted) const;
  std::vector<Trial> trials_of(const std::vector<Candidate>& candidates, const Wanted& wanted);
  Trial bent(const Candidate& candidate, const Wanted& wanted);
  Trial drawn(Trial trial);
  [[nodiscard]] Trial compared(Trial trial, const FittedSurface& found) const;
  [[nodiscard]] Fit fit_of(const BentSurface& surface, const FittedSurface& found,
                           bool draws_all_sides) const;
  Memory placed(const Cloud& x);
  [[nodiscard]] std::vector<Landmark> landmarks_on_coarse(const Targets& landmarks,
                                                          const Eigen::Isometry3d& motion,
                                                          double weight) const;
  Pose finished(const Wanted& wanted, const Trial& trial);
  void judge(const Wanted& wanted, const FittedSurface& found, Pose& pose) const;

  static constexpr const RegistrationConstants& constants_ = registration_constants;

  const Template& template_;
  const Topology& topology_;
  const RegistrationSettings& settings_;
  Workers& workers_;
  std::vector<std::uint8_t> is_sheet_, is_border_;
  SurfaceLevel fine_;
  SurfaceErrors errors_;  // of the fine level
  CoarseSurface mesh_;
  std::vector<std::uint8_t> is_coarse_sheet_;
  SurfaceLevel coarse_;
  Memory fine_first_, coarse_first_;  // of frame 0
};

}  // namespace dynmesh
