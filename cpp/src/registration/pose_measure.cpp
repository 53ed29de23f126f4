#include "registration/pose_measure.hpp"

#include <cmath>

#include "registration/coverage.hpp"
#include "registration/visibility.hpp"
#include "support/geometry.hpp"
#include "support/indices.hpp"
#include "tracking/cloth.hpp"
#include "tracking/robust_size.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh {

PoseMeasure::PoseMeasure(std::span<const Triangle> faces, const Topology& topology, Field frame,
                         const Targets& targets, Workers& workers,
                         const RegistrationConstants& constants)
    : faces_(faces),
      topology_(topology),
      frame_(frame),
      targets_(targets),
      constants_(constants),
      workers_(workers),
      mean_edge_(mean_edge_length<double>(topology.cells, frame)) {}

double PoseMeasure::misfit_of(Field x, const PointScan& scan) const {
  Pose pose;
  std::vector<Vector3<double>> normals(x.size());
  find_vertex_normals(faces_, x, normals);
  // What the sensors see of it is unknown.
  pose.agreement = agreement_of(scan, x, normals, std::vector<std::uint8_t>(x.size()));
  pose.stretch = mean_stretch(topology_.cells, frame_, x);
  return pose.misfit();
}

void PoseMeasure::measure(const PointScan& scan, Pose& pose) const {
  const Field x = pose.x;
  std::vector<Vector3<double>> normals(x.size());
  find_vertex_normals(faces_, x, normals);
  std::vector<Sight> seen(x.size());
  Visibility(x.size()).find(faces_, x, normals, scan.viewpoints(),
                            find_sheets(faces_, topology_.component),
                            {constants_.pixel * mean_edge_, constants_.thickness * mean_edge_,
                             constants_.back_thickness * mean_edge_},
                            seen);
  std::vector<std::uint8_t> is_either(x.size());
  for (std::size_t v = 0; v < seen.size(); ++v) {
    if (seen[v] == Sight::back) normals[v] = -1.0 * normals[v];
    is_either[v] = seen[v] == Sight::both ? 1 : 0;
  }
  pose.agreement = agreement_of(scan, x, normals, is_either);
  pose.coverage = coverage_of({faces_, topology_.cells, frame_, x, normals, seen, mean_edge_}, scan,
                              tracking_, constants_);
  pose.stretch = mean_stretch(topology_.cells, frame_, x);
  pose.quality = quality_of(pose, scan);
}

Agreement PoseMeasure::agreement_of(const PointScan& scan, Field x, Field normals,
                                    std::span<const std::uint8_t> is_either) const {
  SurfacePlaces places(faces_, x);
  places.follow(x);
  return compare(scan, places.nearest_to_all(x, scan, workers_), normals, is_either, mean_edge_,
                 tracking_)
      .all;
}

bool PoseMeasure::has_misplaced_landmarks(const Pose& pose, const PointScan& scan) const {
  const double limit = constants_.misplaced_landmark * size_of(pose.x);
  constexpr double any_normal = -2;
  for (std::size_t i = 0; i < targets_.vertices.size(); ++i) {
    const auto& position = targets_.positions[i];
    const auto& found = pose.x[at(targets_.vertices[i])];
    const bool is_measured =
        scan.viewpoints().empty() || scan.find(position, {}, limit, any_normal).any;
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

RegistrationQuality PoseMeasure::quality_of(const Pose& pose, const PointScan& scan) const {
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
