#include "surface_fit/coarse_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"

namespace dynmesh {
namespace {

std::vector<Vector3> chosen_of(Field frame, std::span<const Index> vertices) {
  std::vector<Vector3> some;
  for (const Index v : vertices) some.push_back(frame[at(v)]);
  return some;
}

/// (k,) the coarse vertex that is nearest to each vertex, counted in edges.
std::vector<Index> nearest_to(const Cells& cells, std::span<const Index> vertices) {
  std::vector<Index> nearest(cells.size(), none);
  std::vector<Index> reached(vertices.begin(), vertices.end());
  for (std::size_t c = 0; c < vertices.size(); ++c) {
    nearest[at(vertices[c])] = static_cast<Index>(c);
  }
  for (std::size_t i = 0; i < reached.size(); ++i) {
    for (const Index other : cells[at(reached[i])]) {
      if (nearest[at(other)] != none) continue;
      nearest[at(other)] = nearest[at(reached[i])];
      reached.push_back(other);
    }
  }
  return nearest;
}

Anchors anchors_at(std::span<const Index> vertices, std::size_t k) {
  Anchors anchors(k, false);
  std::ranges::fill(anchors.is_solved, std::uint8_t{1});
  std::ranges::fill(anchors.counts, 1.0);
  for (const Index v : vertices) anchors.is_solved[at(v)] = 0;
  anchors.number = vertices.size();
  anchors.n_solved = k - vertices.size();
  return anchors;
}

}  // namespace

CoarseSurface::CoarseSurface(DecimatedMesh mesh, const ShapeModel& whole,
                             std::span<const Material> materials, Workers& workers)
    : whole_(whole),
      materials_(materials),
      workers_(workers),
      mesh_(std::move(mesh)),
      topology_(
          build_topology({mesh_.faces.data()->data(), mesh_.faces.size()}, mesh_.vertices.size())),
      first_frame_(chosen_of(whole.first_frame, mesh_.vertices)),
      nearest_(nearest_to(whole.topology.cells, mesh_.vertices)),
      anchors_(anchors_at(mesh_.vertices, whole.size())),
      system_(whole.k, workers),
      factors_(MaskedFactor(whole.plan, workers)),
      rotations_(whole.surroundings, workers) {
  if (anchors_.any_solved()) factor_.emplace(anchors_, factors_.lend());
}

/// How many vertices of the whole surface there are for a coarse one: the square of a ratio of
/// lengths.
double CoarseSurface::ratio() const {
  return static_cast<double>(whole_.size()) / static_cast<double>(size());
}

/// In mean edges, bending grows with the fourth power of their length, and points a little less,
/// since they would else bend the surface by their noise. Distances shrink: they are the same as
/// for the whole surface, so that other things in the scan draw no more. Only the scale of far
/// points shrinks less, as the coarse mesh is what comes from afar.
TrackingConstants CoarseSurface::constants_of(TrackingConstants constants) const {
  const bool has_cloth = std::ranges::any_of(materials_, &Material::slides);
  constants.most_points =
      size() * (has_cloth ? constants.points_of_cloth : constants.points_of_vertex);
  const double length = std::sqrt(ratio());
  constants.last_weight *= length * length * length;
  constants.iterations_per_edge *= length;
  constants.radius /= length;
  constants.resolution /= length;
  constants.least_walk /= length;
  constants.near /= length;
  constants.wall /= length;
  constants.farthest_end /= length;
  constants.largest_scale /= std::sqrt(length);
  return constants;
}

/// Membranes grow with the square of the length.
std::vector<Material> CoarseSurface::materials() const {
  std::vector<Material> some(topology_.report.components);
  for (std::size_t c = 0; c < size(); ++c) {
    Material& material = some[at(topology_.component[c])];
    material = materials_[at(whole_.topology.component[at(mesh_.vertices[c])])];
    material.membrane *= ratio();
  }
  return some;
}

TrainingFrames CoarseSurface::chosen(const TrainingFrames& frames) const {
  TrainingFrames some;
  for (const auto& frame : frames) some.push_back(chosen_of(frame, mesh_.vertices));
  return some;
}

void CoarseSurface::choose(const Memory& memory, Memory& coarse) const {
  for (std::size_t c = 0; c < size(); ++c) {
    const std::size_t v = at(mesh_.vertices[c]);
    coarse.last[c] = memory.last[v];
    coarse.tracking.before[c] = memory.tracking.before[v];
    coarse.q[c] = memory.q[v];
  }
  for (std::size_t c = 0; c < size(); ++c) {
    coarse.sizes[at(topology_.component[c])] =
        memory.sizes[at(whole_.topology.component[at(mesh_.vertices[c])])];
  }
  coarse.fit = memory.tracking.coarse_fit;
  coarse.departures = memory.tracking.coarse_departures;
}

SurfaceColours CoarseSurface::colours(const SurfaceColours& of_whole) const {
  SurfaceColours means = {std::vector<Vector3>(size()), std::vector<std::uint8_t>(size())};
  std::vector<double> numbers(size());
  for (std::size_t v = 0; v < nearest_.size(); ++v) {
    if (of_whole.is_known[v] == 0) continue;
    const std::size_t c = at(nearest_[v]);
    numbers[c] += 1;
    means.is_known[c] = 1;
    means.of_vertices[c] =
        means.of_vertices[c] + (1 / numbers[c]) * (of_whole.of_vertices[v] - means.of_vertices[c]);
  }
  return means;
}

/// As a step of method detail: Q is turned further as the coarse vertices were, and X is solved
/// for. Another step hardly changes X.
std::vector<Vector3> CoarseSurface::restored(const Memory& last, const Memory& next,
                                             const Memory& memory, Field rest, Memory& found) {
  std::vector<Quaternion> turns;  // (clusters,)
  for (const Index centre : whole_.clusters().centres) {
    const std::size_t coarse = nearest(centre);
    const auto& [w, i, j, k] = last.q[coarse];
    turns.push_back(product(next.q[coarse], {w, -i, -j, -k}));
  }
  rotations_.turn_further(turns, memory.q, found.q);
  std::vector<Vector3> x = memory.last;
  for (std::size_t c = 0; c < size(); ++c) x[at(mesh_.vertices[c])] = next.last[c];
  if (!factor_) return x;
  std::vector<Vector3> shape(x.size()), kx(x.size()), steps(x.size());
  for (std::size_t v = 0; v < x.size(); ++v) {
    const double pull = materials_[at(whole_.topology.component[v])].pull;
    shape[v] = memory.m[v] + pull * (rest[v] - memory.m[v]);
  }
  turn(found.q, shape, shape, workers_);
  system_.apply(x, 1, kx);
  system_.solve<1>([&](std::size_t v, std::size_t) { return shape[v] - kx[v]; }, x, *factor_,
                   steps);
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + steps[v];
  return x;
}

}  // namespace dynmesh
