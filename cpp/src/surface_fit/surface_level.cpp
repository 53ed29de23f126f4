#include "surface_fit/surface_level.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.hpp"
#include "surface_fit/correction.hpp"
#include "surface_fit/joint_motion.hpp"
#include "surface_fit/lost_components.hpp"
#include "surface_fit/materials.hpp"
#include "surface_fit/prediction.hpp"

namespace dynmesh {
namespace {

constexpr std::size_t all_points = std::numeric_limits<std::size_t>::max();

}  // namespace

SurfaceLevel::SurfaceLevel(std::vector<Triangle> faces, const Topology& topology, Workers& workers,
                           Field first_frame, const TrackingConstants& constants,
                           const TrainingFrames& training, bool has_uncertainty, double epsilon,
                           std::vector<Material> materials)
    : workers_(workers),
      constants_(constants),
      faces_(std::move(faces)),
      model_(topology, faces_, first_frame, training, epsilon, workers),
      materials_(materials.empty()
                     ? find_materials(faces_, topology, model_.clusters(), first_frame, constants_)
                     : std::move(materials)),
      step_(model_, faces_, workers, constants_, materials_),
      matcher_(faces_, topology, workers, constants_, first_frame, model_.mean_edge, materials_,
               model_.clusters()),
      all_slide_(std::ranges::all_of(materials_, &Material::slides)),
      any_slides_(std::ranges::any_of(materials_, &Material::slides)),
      has_uncertainty_(has_uncertainty),
      points_at_first_(any_slides_ ? all_points : constants_.points_of_vertex * first_frame.size()),
      rigid_points_(
          std::min(points_at_first_, constants_.rigid_points * topology.report.components)) {}

void SurfaceLevel::begin(Memory& memory) const {
  memory.tracking.before = memory.last;
  memory.tracking.colours = {std::vector<Vector3>(memory.last.size()),
                             std::vector<std::uint8_t>(memory.last.size())};
  step_.begin(memory);
}

SurfaceFrame SurfaceLevel::find(const Memory& memory, const PointScan& scan,
                                const FitOptions& options, Memory& next) {
  next.q = memory.q;
  next.fit = memory.fit;
  next.sizes = memory.sizes;
  MatchedPoints points = matcher_.points_of(scan);
  WeightedTies ties = step_.ties().weighted(memory.departures);
  auto [x, visibility] = predict(memory, model_, constants_, rigid_points_, ties, matcher_, points);
  SurfaceFrame frame{std::move(x), std::move(points), std::move(visibility), std::move(ties)};
  if (!options.whole.empty()) {
    matcher_.compare_with(memory.last, frame.visibility, *finer_, options.whole, frame.points);
  }
  align_rigidly(memory, options, frame);
  if (seek_lost(frame)) align_rigidly(memory, options, frame);
  std::vector<Vector3> before = frame.x;
  std::optional<Preconditioner> preconditioner;
  for (int left = frame.iterations; left-- > 0;) {
    if (!iterate(left, left == 1, constants_.solution, options, memory, preconditioner, frame,
                 next)) {
      break;
    }
    // The last iteration begins where the one before it ended.
    if (left > 1) extrapolate(frame.x, before, constants_.prediction);
  }
  return frame;
}

FittedSurface SurfaceLevel::refine(std::vector<Vector3> x, const Memory& memory,
                                   const PointScan& scan, const FitOptions& options,
                                   int most_iterations, int iterations, Memory& next) {
  next.fit = memory.fit;
  next.sizes = memory.sizes;
  auto visibility = matcher_.visibility_of(x, scan);
  const LearnedTies& ties = step_.ties();
  auto weighted = ties.weighted(ties.departed(x, next.q, memory.departures));
  SurfaceFrame frame{std::move(x), matcher_.points_of(scan), std::move(visibility),
                     std::move(weighted)};
  frame.iterations = iterations;
  std::optional<Correction> correction;
  if (most_iterations > 0) {
    correction.emplace(frame.x, next.q, memory.tracking, constants_, workers_);
    frame.x = correction->start();
  }
  std::optional<Preconditioner> preconditioner;
  double largest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_iterations && !lies_still(largest); ++i) {
    const std::vector<Vector3> before = frame.x;
    iterate(0, i == 0, constants_.whole_solution, options, memory, preconditioner, frame, next);
    largest = 0;
    for (std::size_t v = 0; v < before.size(); ++v) {
      largest = std::max(largest, squared_norm(frame.x[v] - before[v]));
    }
  }
  if (correction) correction->end(matcher_.normals_of(frame.x), next.q, frame.x, next.tracking);
  if (most_iterations == 0 && has_uncertainty_) {
    frame.rows = matcher_.match(
        frame.x, frame.visibility,
        {.walked = constants_.resolution,
         .weight = options.times_weight * options.precision * constants_.last_weight},
        frame.points);
  } else if (most_iterations == 0) {
    matcher_.nearest_places(frame.x, frame.visibility, constants_.resolution, frame.points);
  }
  return compared(std::move(frame), memory, next);
}

/// What ties keep while components move rigidly: the differences of the last frame, and a share of
/// those of frame 0, since the points of many frames may say little of some directions.
std::vector<Vector3> SurfaceLevel::wanted_differences(const Memory& memory) const {
  std::vector<Vector3> differences;
  for (const Tie& tie : step_.ties().between()) {
    const auto last = memory.last[tie.i] - memory.last[tie.j];
    const auto first = LearnedTies::kept(tie, memory.q);
    differences.push_back(last + constants_.tie_pull * (first - last));
  }
  return differences;
}

/// Moves the components of X rigidly to the points until they lie still, first as one, then each to
/// its own points. Finds how many iterations are to follow: the farther the points are, the more
/// slowly their weight grows.
void SurfaceLevel::align_rigidly(const Memory& memory, const FitOptions& options,
                                 SurfaceFrame& frame) {
  const MatchOptions matching = {
      .walked = constants_.radius, .points = rigid_points_, .scale = constants_.radius / 2};
  const LearnedTies& ties = step_.ties();
  auto differences = wanted_differences(memory);
  const double reach = constants_.radius * model_.mean_edge;
  const auto is_near = [&](const Tie& tie) { return squared_norm(tie.kept) <= reach * reach; };
  double stiffness = std::ranges::any_of(ties.between(), is_near) ? constants_.first_stiffness : 1;
  for (int step = 0; step < constants_.most_iterations; ++step) {
    frame.rows = matcher_.match(frame.x, frame.visibility, matching, frame.points);
    // Cloth bends while it moves, which its planes cannot tell from a rigid motion along it.
    if (all_slide_ || frame.rows.size() < constants_.fewest) break;
    frame.ties = ties.weighted(ties.departed(frame.x, differences, memory.departures));
    const double moved = move_jointly(frame.rows, frame.ties.between(), reach, stiffness,
                                      model_.topology, constants_, frame.x, differences);
    if (stiffness == 1 && lies_still(moved)) break;
    stiffness = std::max(1.0, stiffness / constants_.stiffness_growth);
  }
  frame.visibility = matcher_.visibility_of(frame.x, *frame.points.scan);
  frame.iterations = constants_.most_iterations;
  if (any_slides_) return;
  const double distance = matcher_.distance_of(constants_.far_share, frame.rows);
  // The first iterations are as stiff as with usual weights: a stiff surface turns, where one that
  // bends does not.
  const double sharper = std::log(options.precision) / std::log(constants_.weight_growth);
  const double wanted = options.fewest_iterations + std::max(0.0, sharper) +
                        constants_.iterations_per_edge * distance;
  frame.iterations =
      static_cast<int>(std::min<double>(std::ceil(wanted), constants_.most_iterations));
}

/// (components,) 1 for those that have their points, of which sensors should see nothing, or that
/// are tied to another one with points, and so are where this holds them.
std::vector<std::uint8_t> SurfaceLevel::find_placed(const SurfaceFrame& frame) const {
  const auto is_measured = matcher_.find_measured(frame.visibility, frame.points);
  auto is_placed = is_measured;
  const auto ties = frame.ties.between();
  for (std::size_t t = 0; t < ties.size(); ++t) {
    const std::size_t a = at(model_.topology.component[ties[t].i]);
    const std::size_t b = at(model_.topology.component[ties[t].j]);
    if (is_measured[a] == is_measured[b] || frame.ties.hold[t] == 0) continue;
    is_placed[a] = is_placed[b] = 1;
  }
  return is_placed;
}

/// Seeks the components that are lost elsewhere, and returns whether any was found.
bool SurfaceLevel::seek_lost(SurfaceFrame& frame) {
  const auto is_lost = [](std::uint8_t is_placed) { return is_placed == 0; };
  if (std::ranges::none_of(find_placed(frame), is_lost)) return false;
  matcher_.nearest_places(frame.x, frame.visibility, constants_.resolution, frame.points);
  const auto normals = matcher_.normals_of(frame.x);
  if (!find_lost(find_placed(frame), frame.points, frame.visibility, normals, model_.topology,
                 constants_, frame.x)) {
    return false;
  }
  frame.visibility = matcher_.visibility_of(frame.x, *frame.points.scan);
  return true;
}

/// Matches the points with X, and then finds X for these and the landmarks; `left` iterations are
/// to follow. Returns false if there are neither.
bool SurfaceLevel::iterate(int left, bool fits_modes, const SolverLimits& limits,
                           const FitOptions& options, const Memory& memory,
                           std::optional<Preconditioner>& preconditioner, SurfaceFrame& frame,
                           Memory& next) {
  const bool arrives = left < constants_.final_iterations;
  const double precision = arrives ? options.precision : std::min(1.0, options.precision);
  const double last_weight = options.times_weight * precision * constants_.last_weight;
  const double weight =
      std::max(constants_.first_weight, last_weight * std::pow(constants_.weight_growth, -left));
  const bool has_colours =
      arrives && options.matches_colours && !frame.points.scan->colours.empty();
  const SurfaceColours* const colours = has_colours ? &memory.tracking.colours : nullptr;
  frame.rows = matcher_.match(frame.x, frame.visibility,
                              {.walked = constants_.resolution,
                               .tells_layers = finer_ == nullptr,
                               .weight = weight,
                               .looks_farther = !arrives,
                               .points = arrives ? all_points : points_at_first_,
                               .colours = colours},
                              frame.points);
  frame.ties = step_.turn_to(frame.x, memory.departures, next);
  const Pulls pulls = {frame.rows, options.landmarks, frame.ties.all};
  if (!preconditioner || !(weight < constants_.factored_growth * preconditioner->weight)) {
    const double growth = std::min(constants_.factored_growth, last_weight / weight);
    preconditioner.reset();  // the next one has its memory
    preconditioner.emplace(step_.preconditioner(pulls, std::sqrt(growth)), weight);
  }
  const double mode_weights = fits_modes ? constants_.first_weight / weight : 0;
  return step_.step({pulls, options.yields_beyond, limits, mode_weights}, preconditioner->factor,
                    memory.m, frame.x, next);
}

/// The frame compared with the points, with what its standard errors need.
FittedSurface SurfaceLevel::compared(SurfaceFrame frame, const Memory& memory, const Memory& next) {
  FittedSurface found = agreement_of(std::move(frame));
  if (!has_uncertainty_) return found;
  found.shape = step_.wanted_shape(memory.m, next);
  return found;
}

/// Which vertices have a measured point, and how far the points are.
FittedSurface SurfaceLevel::agreement_of(SurfaceFrame frame) const {
  FittedSurface found{std::move(frame), {}, {}, {}, {}, {}};
  found.normals = normals_of(found.x);
  matcher_.update_distances(found.x, found.normals, found.visibility, found.points);
  found.observed.resize(found.x.size());
  found.points.for_each_near([&](const Place& place) {
    for (std::size_t s = 0; s < 3; ++s) {
      if (place.shares[s] > 0) found.observed[place.corners[s]] = 1;
    }
  });
  // What few points lie at a component that should have many is not observed.
  const auto is_measured = matcher_.find_measured(found.visibility, found.points);
  const auto is_placed = find_placed(found);
  std::vector<std::vector<std::size_t>> lost(is_placed.size());
  for (std::size_t v = 0; v < found.x.size(); ++v) {
    const std::size_t component = at(model_.topology.component[v]);
    if (is_measured[component] == 0) found.observed[v] = 0;
    if (is_placed[component] == 0) lost[component].push_back(v);
  }
  found.lost = *std::ranges::max_element(lost, {}, &std::vector<std::size_t>::size);
  found.agreements = agreements_of(found.points, constants_);
  return found;
}

FittedSurface SurfaceLevel::agreement_with(const PointScan& scan, std::vector<Vector3> frame) {
  auto visibility = matcher_.visibility_of(frame, scan);
  SurfaceFrame compared{std::move(frame), matcher_.points_of(scan), std::move(visibility),
                        step_.ties().weighted(step_.ties().no_departures())};
  matcher_.nearest_places(compared.x, compared.visibility, 0, compared.points);
  return agreement_of(std::move(compared));
}

void SurfaceLevel::remember(const Memory& memory, bool moves, Memory& next) {
  std::ranges::copy(moves ? memory.last : next.last, next.tracking.before.begin());
  step_.remember(next.last, next);
}

void SurfaceLevel::place(Field frame, Memory& memory) {
  for (auto* of : {&memory.last, &memory.tracking.before}) std::ranges::copy(frame, of->begin());
  forget_correction(memory.tracking);
  step_.remember(memory.last, memory);
}

void SurfaceLevel::bend(const FitOptions& options, int steps, Memory& memory) {
  std::vector<Vector3> x = memory.last;
  Memory bent = memory;
  const WeightedTies first = step_.ties().weighted(memory.departures);
  Lent<MaskedFactor> factor = step_.preconditioner({{}, options.landmarks, first.all}, 1);
  std::vector<Landmark> moving(options.landmarks.begin(), options.landmarks.end());
  for (int step = 0; step < steps; ++step) {
    const double share = static_cast<double>(step + 1) / steps;
    for (std::size_t i = 0; i < moving.size(); ++i) {
      const auto& start = memory.last[moving[i].vertex];
      moving[i].target = start + share * (options.landmarks[i].target - start);
    }
    const WeightedTies ties = step_.turn_to(x, memory.departures, bent);
    step_.step({{{}, moving, ties.all}, options.yields_beyond, constants_.solution}, factor,
               memory.m, x, bent);
  }
  place(x, memory);
  forget_shape(memory);
}

}  // namespace dynmesh
