#include "surface_fit/template_tracking.hpp"

#include <algorithm>
#include <utility>

#include "base/geometry.hpp"
#include "mesh/decimation.hpp"

namespace dynmesh {
namespace {

/// The number of vertices of the mesh on which the iterations run.
std::size_t most_vertices(const TrackingConstants& constants, std::size_t resolution,
                          std::size_t n_vertices) {
  if (resolution > 0) return resolution;
  if (n_vertices <= constants.coarse_vertices) return n_vertices;
  return std::min(constants.coarse_vertices, n_vertices / constants.share_of_vertices);
}

}  // namespace

TemplateTracking::TemplateTracking(const std::vector<Triangle>& faces, const Topology& topology,
                                   Workers& workers, Field first_frame,
                                   const TrainingFrames& training, const Settings& settings)
    : whole_(faces, topology, workers, first_frame, {}, training, settings.uncertainty,
             settings.epsilon),
      is_live_(settings.resolution > 0) {
  // The points do not tell how far cloth slides, so that it needs all iterations itself.
  const std::size_t most = most_vertices(constants(), settings.resolution, first_frame.size());
  if (most >= first_frame.size() || (whole_.any_slides() && !is_live_)) return;
  auto mesh = decimated(faces, topology, first_frame, most, constants().fewest_vertices);
  if (mesh.vertices.size() == first_frame.size()) return;
  coarse_ = std::make_unique<Coarse>(std::move(mesh), whole_, training, settings.epsilon, workers);
}

TemplateTracking::Coarse::Coarse(DecimatedMesh mesh, SurfaceTracking& whole,
                                 const TrainingFrames& training, double epsilon, Workers& workers)
    : surface(std::move(mesh), whole.model(), whole.materials(), workers),
      tracking(surface.faces(), surface.topology(), workers, surface.first_frame(),
               surface.constants_of(whole.constants()), surface.chosen(training), false, epsilon,
               surface.materials()),
      memory({surface.first_frame().begin(), surface.first_frame().end()}),
      next(memory) {
  tracking.measure_heights(whole);
  tracking.begin(memory);
  next = memory;
  first_fit = memory.fit;
  no_departures = memory.departures;
}

void TemplateTracking::begin(Memory& memory) const {
  whole_.begin(memory);
  if (coarse_ == nullptr) return;
  memory.tracking.coarse_fit = coarse_->first_fit;
  memory.tracking.coarse_departures = coarse_->no_departures;
}

TemplateTracking::Found TemplateTracking::fit(const Memory& memory, const PointScan& measurement,
                                              Memory& next) {
  if (coarse_ == nullptr) return whole_.fit(memory, measurement, {}, next);
  auto& [surface, tracking, last, found, first_fit, no_departures] = *coarse_;
  surface.choose(memory, last);
  tracking.find_shape(last);
  const int iterations = tracking.find(last, measurement, {}, found);
  std::ranges::copy(tracking.x(), found.last.begin());
  tracking.fit_rotations(found);
  next.tracking.coarse_fit = found.fit;
  next.tracking.coarse_departures = tracking.departures(found, memory.tracking.coarse_departures);
  const std::span<Vector3> x = whole_.start(memory, measurement, next);
  surface.restore(last, found, memory, whole_.rest_shape(), next, x);
  return whole_.settle(memory, is_live_ ? 0 : constants().whole_iterations, iterations, next);
}

/// A frame in which the template was lost says nothing of what moves apart.
void TemplateTracking::remember(const Memory& memory, bool moves, bool is_lost, Memory& next) {
  whole_.remember(memory, moves, next);
  if (!is_lost) {
    next.departures = whole_.departures(next, memory.departures);
  } else {
    next.departures = memory.departures;
    next.tracking.coarse_departures = memory.tracking.coarse_departures;
  }
}

}  // namespace dynmesh
