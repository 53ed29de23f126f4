#include "registration/candidates.hpp"

#include <limits>

#include "registration/surface_sample.hpp"
#include "registration/tips.hpp"

namespace dynmesh {
namespace {

/// Where the distances from paired tips differ least from those of a point: a number of the second
/// surface, or its size if it has no such place.
std::size_t most_alike(std::size_t i, const Tips& first, const Tips& second,
                       std::span<const std::size_t> pairing, std::size_t step) {
  const std::size_t n = second.from[0].size();
  std::size_t best = n;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < n; j += step) {
    double sum = 0;
    for (std::size_t tip = 0; tip < pairing.size() && sum < least; ++tip) {
      if (pairing[tip] == no_tip) continue;
      const double difference = first.from[tip][i] - second.from[pairing[tip]][j];
      sum += difference * difference;
    }
    if (!(sum < least)) continue;  // it is infinite or none where there is no way along the surface
    least = sum;
    best = j;
  }
  return best;
}

}  // namespace

std::vector<Candidate> candidates_by_tips(std::span<const Triangle> faces,
                                          std::span<const Vector3<double>> frame,
                                          const PointScan& scan, const TipConstants& constants) {
  // About as many points of the scan as places of the template tell what is connected.
  const PointScan sample = sample_scan(scan, constants.points);
  const SurfaceSample places = sample_surface(faces, frame, constants.points);
  PointScan surface;
  surface.points = places.points;
  surface.normals = places.normals;
  surface.index();
  const Tips ours = tips_of(surface, constants.of_template, constants);
  const Tips theirs = tips_of(sample, constants.of_scan, constants);
  std::vector<Candidate> found;
  if (theirs.numbers.empty()) return found;
  for (const auto& pairing : likely_pairs(ours, theirs, constants)) {
    Candidate candidate;
    for (std::size_t i = 0; i < surface.size(); i += 1 + surface.size() / constants.places) {
      const std::size_t step = 1 + sample.size() / (10 * constants.places);
      const std::size_t other = most_alike(i, ours, theirs, pairing, step);
      if (other == sample.size()) continue;
      candidate.rough.vertices.push_back(places.vertices[i]);
      candidate.rough.positions.push_back(sample.points[other]);
    }
    if (!candidate.rough.determine_a_rotation()) continue;
    candidate.motion = candidate.rough.motion_from(frame);
    found.push_back(std::move(candidate));
  }
  return found;
}

}  // namespace dynmesh
