/// Finds the pose of a template in a scan: tries where it may be, and keeps what fits best.
#pragma once

#include <dynmesh/registration.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/training_frames.hpp"
#include "mesh/triangle.hpp"
#include "registration/candidates.hpp"
#include "registration/coarse_fit.hpp"
#include "registration/coarse_mesh.hpp"
#include "registration/constants.hpp"
#include "registration/fine_rounds.hpp"
#include "registration/pose.hpp"
#include "registration/pose_measure.hpp"
#include "registration/targets.hpp"
#include "stream/stream.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// A template, all of it in the internal order and in the unit of the scans.
struct ScaledTemplate {
  std::vector<Triangle> faces;
  std::vector<Vector3<double>> frame;
  TrainingFrames training;
};

class PoseSearch {
 public:
  /// `epsilon` is that of the caller's numbers. All arguments must outlive this object.
  PoseSearch(const ScaledTemplate& scaled, const Targets& targets,
             const RegistrationSettings& settings, double epsilon, Stream<double>& stream,
             const RegistrationConstants& constants);

  Pose run(const PointScan& scan);

 private:
  Pose with_landmarks(const PointScan& scan);
  Pose without_landmarks(const PointScan& scan);
  void try_tips(const PointScan& scan, Pose& best);
  void repair(const PointScan& scan, const TipsOfBoth& tips, Pose& best);
  void exchange(const PointScan& scan, const TipsOfBoth& tips, Pose& best);
  bool try_others(const PointScan& scan, std::vector<Candidate> others, Pose& best);
  Pose best_of(const PointScan& scan, std::vector<Candidate> tried, int most_rounds);
  [[nodiscard]] std::vector<Candidate> likely(const PointScan& scan, std::vector<Candidate> tried);
  [[nodiscard]] CoarseFit::Fitted fitted(const Candidate& candidate, const PointScan& scan,
                                         std::size_t n_points, int passes);
  Pose finished(const PointScan& scan, const Candidate& candidate, int most_rounds,
                FineRounds& rounds);
  [[nodiscard]] TemplateShape shape() const;

  const ScaledTemplate& template_;
  const Targets& targets_;
  const RegistrationSettings& settings_;
  Stream<double>& stream_;
  const RegistrationConstants& constants_;
  PoseMeasure measure_;
  CoarseMesh mesh_;
  CoarseFit coarse_;
  FineRounds rounds_;
};

}  // namespace dynmesh
