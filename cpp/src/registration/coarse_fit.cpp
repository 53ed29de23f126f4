#include "registration/coarse_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/geometry.hpp"
#include "support/indices.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh {
namespace {

TrackingConstants for_bending(const RegistrationConstants& constants) {
  TrackingConstants bending;
  bending.cloth_membrane = constants.bending_membrane;
  return bending;
}

}  // namespace

CoarseFit::CoarseFit(const CoarseMesh& mesh, Workers& workers,
                     const RegistrationConstants& constants)
    : mesh_(mesh),
      workers_(workers),
      constants_(constants),
      bending_(for_bending(constants)),
      mean_edge_(mean_edge_length<double>(mesh.topology.cells, mesh.positions)),
      nobody_(mesh.positions.size(), 0),
      everybody_(mesh.positions.size(), 1),
      shape_(mesh.faces, mesh.topology, workers, tracking_, mesh.positions, mean_edge_, nobody_, {},
             false, std::numeric_limits<double>::epsilon()),
      bent_(mesh.faces, mesh.topology, workers, bending_, mesh.positions, mean_edge_, everybody_,
            {}, false, std::numeric_limits<double>::epsilon()),
      matches_(mesh.faces, mesh.topology, workers, tracking_, mesh.positions, mean_edge_, nobody_,
               shape_.clusters()) {}

std::vector<Landmark> CoarseFit::targets(std::span<const TemplateLandmark> landmarks,
                                         double weight) const {
  std::vector<Landmark> result;
  for (const TemplateLandmark& landmark : landmarks) {
    const std::size_t coarse = at(mesh_.of_vertex[at(landmark.vertex)]);
    result.push_back(
        {coarse, landmark.position + (mesh_.positions[coarse] - landmark.start), weight});
  }
  return result;
}

CoarseFit::Fitted CoarseFit::fit(const PointScan& scan, std::span<const TemplateLandmark> landmarks,
                                 int passes) {
  Fitted fitted;
  fitted.x = mesh_.positions;
  if (!landmarks.empty()) bend(landmarks, fitted.x);
  draw(scan, landmarks, passes, fitted.x);
  Rotations rotations(mesh_.topology.cells, workers_);
  rotations.reset(rotations.prepare(mesh_.positions), mesh_.positions, mean_edge_);
  rotations.fit(fitted.x);
  fitted.rotations.assign(rotations.quaternions().begin(), rotations.quaternions().end());
  fitted.misfit =
      far_share(scan, fitted.x) + mean_stretch(mesh_.topology.cells, mesh_.positions, fitted.x);
  return fitted;
}

/// The positions of the landmarks move to their targets during most of the steps.
void CoarseFit::bend(std::span<const TemplateLandmark> landmarks, std::span<Vector3<double>> x) {
  SurfaceRows no_points;
  no_points.index(x.size());
  bent_.begin_frame();
  bent_.factorize(no_points, targets(landmarks, constants_.bending_weight), 1);
  for (int step = 0; step < constants_.bending_steps; ++step) {
    const double share =
        std::min(1.0, (step + 1) / (constants_.bending_share * constants_.bending_steps));
    auto moving = targets(landmarks, constants_.bending_weight);
    for (auto& target : moving) {
      const auto start = mesh_.positions[target.vertex];
      target.target = start + share * (target.target - start);
    }
    bent_.take(no_points, moving, 0, x);
  }
}

void CoarseFit::draw(const PointScan& scan, std::span<const TemplateLandmark> landmarks, int passes,
                     std::span<Vector3<double>> x) {
  matches_.begin(scan);
  shape_.begin_frame();
  for (int pass = 0; pass < passes; ++pass) {
    const double progress = static_cast<double>(pass) / std::max(1, passes - 1);
    const double weight =
        constants_.first_coarse_weight *
        std::pow(tracking_.last_weight / constants_.first_coarse_weight, progress);
    SurfaceRows& rows = matches_.find(x, {.radius = tracking_.radius_before(passes - 1 - pass),
                                          .walked = tracking_.walked,
                                          .weight = weight,
                                          .cloth_weight = weight});
    const auto held = targets(landmarks, (1 - progress) * constants_.coarse_landmark_weight);
    if (pass % constants_.passes_with_a_factor == 0) shape_.factorize(rows, held, 1);
    shape_.take(rows, held, 0, x);
  }
}

/// How many points are far from all vertices, or have a normal opposed to that of the nearest one.
double CoarseFit::far_share(const PointScan& scan, Field x) const {
  PointScan vertices;
  vertices.points.assign(x.begin(), x.end());
  vertices.normals.resize(x.size());
  find_vertex_normals(mesh_.faces, x, vertices.normals);
  vertices.index();
  const double reach = constants_.coarse_far * mean_edge_;
  double n_far = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double agreement = scan.is_undecided(i) ? -2 : 0;
    if (!vertices.find(scan.point(i), scan.normal(i), reach, agreement).any) n_far += 1;
  }
  return n_far / static_cast<double>(std::max<std::size_t>(scan.size(), 1));
}

}  // namespace dynmesh
