#include "surface_fit/surface_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "mesh/decimation.hpp"
#include "surface_fit/correction.hpp"
#include "surface_fit/surface_colours.hpp"

namespace dynmesh {
namespace {

/// On how many vertices the iterations run: "best", on all of few, or else on at most half of them.
/// The points do not tell how far cloth slides, but its folds do. So it is counted by itself, and
/// has what the others leave of half of all, if that is more than half of its own.
DecimationLimits limits_of(const TrackingConstants& constants, std::size_t resolution,
                           const Topology& topology, std::span<const Material> materials) {
  if (resolution > 0) return {{resolution}, constants.fewest_vertices, {}};
  const auto part = [&](std::size_t n) { return n / constants.share_of_vertices; };
  const auto most = [&](std::size_t n, std::size_t left) {
    if (n <= constants.coarse_vertices) return n;
    return std::min(constants.coarse_vertices, std::max(part(n), left));
  };
  const std::size_t n = topology.component.size();
  const auto n_cloth = static_cast<std::size_t>(std::ranges::count_if(
      topology.component, [&](Index component) { return materials[component].slides; }));
  const std::size_t others = most(n - n_cloth, 0);
  const std::size_t cloth = most(n_cloth, part(n) - std::min(part(n), others));
  DecimationLimits limits = {{others, cloth}, constants.fewest_vertices, {}};
  for (const Material& material : materials) limits.group_of.push_back(material.slides ? 1 : 0);
  return limits;
}

/// How many times more than usual points weigh in the next frame. The steps of a subject that rests
/// are noise, and so each undoes a part of the one before it; those of a motion have its direction.
/// Steps that are hardly any tell neither.
double next_times_weight(const Memory& memory, const FittedSurface& found, double mean_edge,
                         const TrackingConstants& constants) {
  double common = 0;
  double newest = 0;
  double earlier = 0;
  double hardly = 0;
  double noisy = 0;
  for (std::size_t v = 0; v < found.x.size(); ++v) {
    if (found.observed[v] == 0) continue;
    const auto step = found.x[v] - memory.last[v];
    const auto before = memory.last[v] - memory.tracking.before[v];
    common += dot(step, before);
    newest += squared_norm(step);
    earlier += squared_norm(before);
    hardly += std::pow(constants.hardly_moved * mean_edge, 2);
    noisy += std::pow(constants.resolution * mean_edge, 2);
  }
  // What swings goes back as well, but by more than noise moves a surface.
  if (common < 0) common *= noisy / (noisy + newest);
  const double scale = std::sqrt(newest * earlier) + hardly;
  const double correlation = scale > 0 ? common / scale : 0;
  const double times = std::pow(constants.times_weight_growth, correlation);
  return std::clamp(times * memory.tracking.times_weight, constants.least_times_weight, 1.0);
}

/// How many times more than usual points weigh for their noise in the last frames.
double precision_of(const TrackingMemory& memory, const TrackingConstants& constants) {
  const double least = std::pow(constants.least_noise, 2);
  return (std::pow(constants.usual_noise, 2) + least) / (std::pow(memory.noise, 2) + least);
}

/// How far most vertices moved in the last frame.
double usual_step(const Memory& memory) {
  std::vector<double> steps;
  for (std::size_t v = 0; v < memory.last.size(); ++v) {
    steps.push_back(std::sqrt(squared_norm(memory.last[v] - memory.tracking.before[v])));
  }
  return median(steps);
}

}  // namespace

SurfaceFit::SurfaceFit(const std::vector<Triangle>& faces, const Topology& topology,
                       Workers& workers, Field first_frame, const TrainingFrames& training,
                       const Options& options)
    : whole_(faces, topology, workers, first_frame, {}, training, options.uncertainty,
             options.epsilon),
      growth_(whole_.model()),
      errors_(whole_.model(), whole_.materials(), whole_.factors(), whole_.constants(), workers,
              options.uncertainty),
      is_live_(options.resolution > 0) {
  const TrackingConstants& constants = whole_.constants();
  auto mesh = decimated(faces, topology, first_frame,
                        limits_of(constants, options.resolution, topology, whole_.materials()));
  if (mesh.vertices.size() == first_frame.size()) return;
  coarse_ = std::make_unique<Coarse>(std::move(mesh), whole_, training, options.epsilon, workers);
}

SurfaceFit::Coarse::Coarse(DecimatedMesh mesh, SurfaceLevel& whole, const TrainingFrames& training,
                           double epsilon, Workers& workers)
    : surface(std::move(mesh), whole.model(), whole.materials(), workers),
      level(surface.faces(), surface.topology(), workers, surface.first_frame(),
            surface.constants_of(whole.constants()), surface.chosen(training), false, epsilon,
            surface.materials()),
      first({surface.first_frame().begin(), surface.first_frame().end()}) {
  level.measure_heights(whole);
  level.begin(first);
}

void SurfaceFit::begin(Memory& memory) const {
  whole_.begin(memory);
  memory.errors = errors_.no_errors();
  if (coarse_ == nullptr) return;
  if (!is_live_) memory.tracking.corrections.resize(memory.last.size());
  memory.tracking.coarse_fit = coarse_->first.fit;
  memory.tracking.coarse_departures = coarse_->first.departures;
}

FittedSurface SurfaceFit::fit(const Memory& memory, const PointScan& scan, Memory& next,
                              int fewest_iterations) {
  FitOptions options = {.fewest_iterations = fewest_iterations,
                        .times_weight = memory.tracking.times_weight,
                        .precision = precision_of(memory.tracking, whole_.constants())};
  if (coarse_ == nullptr) return whole_.fit(memory, scan, options, next);
  auto& [surface, level, first] = *coarse_;
  Memory last = first;
  surface.choose(memory, last);
  level.find_shape(last);
  Memory found = last;
  // Exact points draw the template as closely as they can, not the coarse mesh, which is farther
  // from them. Colours are matched on the template, unless it only follows.
  FitOptions of_coarse = options;
  of_coarse.precision = std::min(1.0, options.precision);
  of_coarse.matches_colours = is_live_;
  if (is_live_ && !scan.colours.empty()) {
    last.tracking.colours = surface.colours(memory.tracking.colours);
  }
  // Where the surface moves farther, what was measured of the template says nothing any more.
  const TrackingConstants& constants = level.constants();
  if (usual_step(memory) < constants.corrected_steps * level.mean_edge()) {
    of_coarse.whole = memory.last;
  }
  SurfaceFrame frame = level.find(last, scan, of_coarse, found);
  found.last = std::move(frame.x);
  level.fit_rotations(found);
  next.tracking.coarse_fit = found.fit;
  next.tracking.coarse_departures = level.departures(found, memory.tracking.coarse_departures);
  auto x = surface.restored(last, found, memory, whole_.rest_shape(memory), next);
  const int most_iterations = is_live_ ? 0 : whole_.constants().whole_iterations;
  // Where the coarse mesh has farther to go than its iterations lead it, the distance of a point is
  // not noise; and a template that only follows is drawn by the weights of the coarse mesh.
  const bool has_arrived = frame.iterations < constants.most_iterations;
  if (is_live_ || !has_arrived) options.precision = of_coarse.precision;
  return whole_.refine(std::move(x), memory, scan, options, most_iterations, frame.iterations,
                       next);
}

void SurfaceFit::remember(const Memory& memory, const FittedSurface& found, bool moves,
                          bool is_lost, Memory& next) {
  whole_.remember(memory, moves, next);
  next.sizes = memory.sizes;
  if (moves && !is_lost) {
    growth_.find(next.known, next.last, Growth::Since::first_frame, next.sizes);
    // Edges of cloth, which slides, are not measured.
    for (std::size_t c = 0; c < next.sizes.size(); ++c) {
      if (whole_.materials()[c].slides) next.sizes[c] = 1;
    }
  }
  next.tracking.times_weight =
      next_times_weight(memory, found, whole_.mean_edge(), whole_.constants());
  next.tracking.colours = memory.tracking.colours;
  if (is_lost || !moves) forget_correction(next.tracking);
  if (!is_lost) {
    learn_colours(found.points, whole_.constants(), next.tracking.colours);
    next.departures = whole_.departures(next, memory.departures);
  } else {
    next.departures = memory.departures;
    next.tracking.coarse_departures = memory.tracking.coarse_departures;
  }
}

}  // namespace dynmesh
