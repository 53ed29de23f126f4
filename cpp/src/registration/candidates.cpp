#include "registration/candidates.hpp"

#include <utility>

#include "registration/surface_sample.hpp"
#include "registration/targets.hpp"
#include "support/geometry.hpp"
#include "support/indices.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

TipsOfBoth tips_of_both(const TemplateShape& shape, const PointScan& scan,
                        const TipConstants& constants) {
  PointScan sample;
  sample_scan(scan, constants.points, sample);
  const SurfaceSample places = sample_surface(shape.faces, shape.frame, constants.points);
  PointScan surface;
  surface.points = places.points;
  surface.normals = places.normals;
  surface.index();
  TipsOfBoth tips;
  tips.ours = tips_of(surface, constants.of_template, constants);
  tips.theirs = tips_of(sample, constants.of_scan, constants);
  for (const std::size_t i : tips.ours.numbers) tips.vertices.push_back(places.vertices[i]);
  for (const std::size_t i : tips.theirs.numbers) tips.positions.push_back(sample.points[i]);
  return tips;
}

std::vector<Candidate> candidates_by_tips(const TemplateShape& shape, const TipsOfBoth& tips,
                                          const TipConstants& constants) {
  std::vector<Candidate> found;
  for (const auto& pairing : likely_pairs(tips.ours, tips.theirs, constants)) {
    Targets targets;
    for (std::size_t i = 0; i < pairing.size(); ++i) {
      if (pairing[i] == no_tip) continue;
      targets.vertices.push_back(tips.vertices[i]);
      targets.positions.push_back(tips.positions[pairing[i]]);
    }
    if (!targets.determine_a_rotation()) continue;
    found.push_back({targets.motion_from(shape.frame), targets});
  }
  return found;
}

std::vector<Candidate> candidates_by_tips_left_out(const TemplateShape& shape,
                                                   const TipsOfBoth& tips,
                                                   const Eigen::Isometry3d& motion,
                                                   std::span<const Vector3<double>> x,
                                                   const TipConstants& constants) {
  PointScan surface;
  surface.points.assign(x.begin(), x.end());
  surface.index();
  std::vector<Candidate> found;
  const double reach = constants.left_out * shape.mean_edge;
  for (const auto& position : tips.positions) {
    if (surface.find_if(position, reach, [](std::uint32_t) { return true; }).any) continue;
    for (const Index moving : tips.vertices) {
      Targets targets;
      for (const Index vertex : tips.vertices) {
        targets.vertices.push_back(vertex);
        targets.positions.push_back(vertex == moving ? position : x[at(vertex)]);
      }
      found.push_back({motion, targets});
    }
  }
  return found;
}

std::vector<Candidate> candidates_by_exchanged_tips(const TipsOfBoth& tips,
                                                    const Eigen::Isometry3d& motion,
                                                    std::span<const Vector3<double>> x) {
  Targets targets;
  targets.vertices = tips.vertices;
  for (const Index vertex : tips.vertices) targets.positions.push_back(x[at(vertex)]);
  std::vector<Candidate> found;
  for (std::size_t i = 0; i < targets.positions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      std::swap(targets.positions[i], targets.positions[j]);
      found.push_back({motion, targets});
      std::swap(targets.positions[i], targets.positions[j]);
    }
  }
  return found;
}

}  // namespace dynmesh
