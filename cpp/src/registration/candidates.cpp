#include "registration/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "registration/rigid_starts.hpp"
#include "registration/surface_sample.hpp"
#include "registration/targets.hpp"
#include "support/eigen_points.hpp"
#include "support/geometry.hpp"
#include "support/indices.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/robust_size.hpp"

namespace dynmesh {

std::vector<Candidate> candidates_by_points(const TemplateShape& shape, const PointScan& scan,
                                            const std::vector<TemplateLandmark>& landmarks,
                                            const RegistrationConstants& constants) {
  const auto frame = shape.frame;
  const RigidStart in_place = start_in_place(shape.faces, frame, scan, constants.rigid);
  double moved_by = 0;
  for (const auto& x : frame) {
    const Eigen::Vector3d position = to_eigen(x);
    moved_by += (in_place.motion * position - position).norm() / static_cast<double>(frame.size());
  }
  const double size = size_of(frame);
  const double near =
      std::min(constants.in_place * shape.mean_edge, constants.in_place_share * size);
  const double little = std::min(constants.largest_motion_in_place * shape.mean_edge,
                                 constants.largest_motion_share * size);
  if (in_place.distance < near && moved_by < little) {
    return {{in_place.motion, landmarks}};
  }
  auto starts = rigid_starts(shape.faces, frame, scan, constants.rigid);
  const double limit =
      constants.rigid.largest_ratio * std::min(in_place.distance, starts.front().distance);
  const bool is_new = std::ranges::all_of(starts, [&](const RigidStart& start) {
    return differ(start.motion, in_place.motion, constants.rigid);
  });
  if (is_new || in_place.distance < starts.front().distance) starts.push_back(in_place);
  std::vector<Candidate> found;
  for (const RigidStart& start : starts) {
    if (start.distance <= limit) found.push_back({start.motion, landmarks, start.distance});
  }
  return found;
}

TipsOfBoth tips_of_both(const TemplateShape& shape, const PointScan& scan, std::size_t points,
                        const TipConstants& constants) {
  PointScan sample;
  sample_scan(scan, Eigen::Isometry3d::Identity(), points, sample);
  const SurfaceSample places = sample_surface(shape.faces, shape.frame, points);
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
    found.push_back({targets.motion_from(shape.frame), targets.landmarks_of(shape.frame)});
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
  surface.normals.resize(x.size());
  surface.index();
  constexpr double any_normal = -2;
  std::vector<std::pair<double, Vector3<double>>> left_out;  // by the distance from x
  for (const auto& position : tips.positions) {
    const double distance =
        std::sqrt(surface.find(position, {}, std::numeric_limits<double>::infinity(), any_normal)
                      .squared_distance);
    if (distance > constants.left_out * shape.mean_edge) left_out.emplace_back(distance, position);
  }
  std::ranges::stable_sort(left_out, std::greater<>(), &std::pair<double, Vector3<double>>::first);
  left_out.resize(std::min(left_out.size(), constants.most_left_out));
  std::vector<Candidate> found;
  for (const auto& [distance, position] : left_out) {
    for (const Index moving : tips.vertices) {
      Targets targets;
      for (const Index vertex : tips.vertices) {
        targets.vertices.push_back(vertex);
        targets.positions.push_back(vertex == moving ? position : x[at(vertex)]);
      }
      found.push_back({motion, targets.landmarks_of(shape.frame)});
    }
  }
  return found;
}

std::vector<Candidate> candidates_by_exchanged_tips(const TemplateShape& shape,
                                                    const TipsOfBoth& tips,
                                                    const Eigen::Isometry3d& motion,
                                                    std::span<const Vector3<double>> x) {
  Targets targets;
  targets.vertices = tips.vertices;
  for (const Index vertex : tips.vertices) targets.positions.push_back(x[at(vertex)]);
  std::vector<Candidate> found;
  for (std::size_t i = 0; i < targets.positions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      std::swap(targets.positions[i], targets.positions[j]);
      found.push_back({motion, targets.landmarks_of(shape.frame)});
      std::swap(targets.positions[i], targets.positions[j]);
    }
  }
  return found;
}

}  // namespace dynmesh
