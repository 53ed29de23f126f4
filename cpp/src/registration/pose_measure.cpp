#include "registration/pose_measure.hpp"

#include <cmath>

#include "registration/coverage.hpp"
#include "support/geometry.hpp"
#include "support/indices.hpp"
#include "tracking/robust_size.hpp"
#include "tracking/vertex_normals.hpp"
#include "tracking/visibility.hpp"

namespace dynmesh {

PoseMeasure::PoseMeasure(std::span<const Triangle> faces, const Topology& topology, Field frame,
                         const Targets& targets, Workers& workers,
                         const RegistrationConstants& constants)
    : faces_(faces),
      topology_(topology),
      frame_(frame),
      targets_(targets),
      constants_(constants),
      comparison_(faces, topology.cells, workers, tracking_),
      mean_edge_(mean_edge_length<double>(topology.cells, frame)) {}

double PoseMeasure::misfit_of(Field x, const Measurement& scan) const {
  Pose pose;
  std::vector<Vector3<double>> normals(x.size());
  find_vertex_normals(faces_, x, normals);
  // What the sensors see of it is unknown.
  pose.agreement = comparison_.compare({x, normals, {}, mean_edge_}, scan, {}).all;
  pose.stretch = mean_stretch(topology_.cells, frame_, x);
  return pose.misfit();
}

void PoseMeasure::measure(const Measurement& scan, Pose& pose) const {
  const Field x = pose.x;
  std::vector<Vector3<double>> normals(x.size());
  find_vertex_normals(faces_, x, normals);
  std::vector<Sight> seen(x.size());
  Visibility(x.size()).find(faces_, x, normals, scan.viewpoints(),
                            find_sheets(faces_, topology_.component),
                            {tracking_.pixel * mean_edge_, tracking_.thickness * mean_edge_,
                             tracking_.back_thickness * mean_edge_},
                            seen);
  for (std::size_t v = 0; v < seen.size(); ++v) {
    if (seen[v] == Sight::back) normals[v] = -1.0 * normals[v];
  }
  pose.agreement = comparison_.compare({x, normals, seen, mean_edge_}, scan, {}).all;
  pose.coverage = coverage_of({faces_, topology_.cells, frame_, x, normals, seen, mean_edge_}, scan,
                              tracking_, constants_);
  pose.stretch = mean_stretch(topology_.cells, frame_, x);
  pose.quality = quality_of(pose, scan);
}

bool PoseMeasure::has_misplaced_landmarks(const Pose& pose, const Measurement& scan) const {
  const double limit = constants_.misplaced_landmark * size_of(pose.x);
  constexpr double any_normal = -2;
  for (std::size_t i = 0; i < targets_.vertices.size(); ++i) {
    const auto& position = targets_.positions[i];
    const auto& found = pose.x[at(targets_.vertices[i])];
    const bool is_measured =
        scan.viewpoints().empty() ||
        scan.nearest(position, {}, limit, any_normal, Measurement::no_guess).weight > 0;
    if (is_measured && squared_norm(found - position) > limit * limit) return true;
  }
  return false;
}

bool PoseMeasure::are_elsewhere(Field a, Field b) const {
  double distance = 0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    distance += std::sqrt(squared_norm(a[v] - b[v])) / static_cast<double>(a.size());
  }
  return distance > constants_.elsewhere * mean_edge_;
}

RegistrationQuality PoseMeasure::quality_of(const Pose& pose, const Measurement& scan) const {
  const bool is_ruined = pose.agreement.far_share > constants_.ruined_far ||
                         pose.agreement.disagreeing > constants_.ruined_disagreeing ||
                         pose.coverage.stretched > constants_.ruined_stretched;
  if (is_ruined) return RegistrationQuality::ruined;
  const bool is_doubtful = pose.agreement.far_share > constants_.doubtful_far ||
                           pose.coverage.empty_share > constants_.doubtful_empty ||
                           pose.coverage.hole > constants_.doubtful_hole ||
                           pose.coverage.overlap > constants_.doubtful_overlap ||
                           pose.coverage.has_bridges(constants_) ||
                           pose.coverage.stretched > constants_.doubtful_stretched ||
                           has_misplaced_landmarks(pose, scan);
  return is_doubtful ? RegistrationQuality::doubtful : RegistrationQuality::good;
}

}  // namespace dynmesh
