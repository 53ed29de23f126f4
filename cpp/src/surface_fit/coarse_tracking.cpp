#include "surface_fit/coarse_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"

namespace dynmesh {
namespace {

std::vector<Vector3> chosen(Field frame, std::span<const Index> vertices) {
  std::vector<Vector3> some;
  for (const Index v : vertices) some.push_back(frame[at(v)]);
  return some;
}

TrainingFrames chosen(const TrainingFrames& frames, std::span<const Index> vertices) {
  TrainingFrames some;
  for (const auto& frame : frames) some.push_back(chosen(frame, vertices));
  return some;
}

/// How many vertices of the whole mesh there are for a coarse one: the square of a ratio of
/// lengths.
double vertices_of(const DecimatedMesh& mesh, const ShapeModel& whole) {
  return static_cast<double>(whole.size()) / static_cast<double>(mesh.vertices.size());
}

/// Those with which the coarse mesh resists points as the whole one does. In mean edges, bending
/// grows with the fourth power of their length, and points a little less, since they would else
/// bend it by their noise. Distances shrink: they are the same as for the whole mesh, so that other
/// things in the scan draw no more. Only the scale of far points shrinks less, as the coarse mesh
/// is what comes from afar.
TrackingConstants for_coarse(TrackingConstants constants, std::size_t n_vertices, double ratio) {
  constants.most_points = constants.points_of_vertex * n_vertices;
  const double length = std::sqrt(ratio);
  constants.last_weight *= length * length * length;
  constants.iterations_per_edge *= length;
  constants.radius /= length;
  constants.resolution /= length;
  constants.near /= length;
  constants.farthest_end /= length;
  constants.largest_scale /= std::sqrt(length);
  return constants;
}

/// (components,) of the coarse mesh. Membranes grow with the square of the length.
std::vector<Material> materials_of(const DecimatedMesh& mesh, const Topology& topology,
                                   const ShapeModel& whole, std::span<const Material> materials) {
  std::vector<Material> some(topology.report.components);
  for (std::size_t c = 0; c < mesh.vertices.size(); ++c) {
    Material& material = some[at(topology.component[c])];
    material = materials[at(whole.topology.component[at(mesh.vertices[c])])];
    material.membrane *= vertices_of(mesh, whole);
  }
  return some;
}

/// (clusters,) the coarse vertex that is nearest to the centre of each, counted in edges.
std::vector<Index> nearest_to(const Clusters& clusters, const Cells& cells,
                              std::span<const Index> vertices) {
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
  std::vector<Index> of_clusters;
  for (const Index centre : clusters.centres) of_clusters.push_back(nearest[at(centre)]);
  return of_clusters;
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

CoarseTracking::CoarseTracking(DecimatedMesh mesh, const ShapeModel& whole,
                               std::span<const Material> materials, Workers& workers,
                               const TrackingConstants& constants, const TrainingFrames& training,
                               double epsilon)
    : whole_(whole),
      materials_(materials),
      workers_(workers),
      mesh_(std::move(mesh)),
      topology_(
          build_topology({mesh_.faces.data()->data(), mesh_.faces.size()}, mesh_.vertices.size())),
      first_frame_(chosen(whole.first_frame, mesh_.vertices)),
      tracking_(mesh_.faces, topology_, workers, first_frame_,
                for_coarse(constants, mesh_.vertices.size(), vertices_of(mesh_, whole)),
                chosen(training, mesh_.vertices), false, epsilon,
                materials_of(mesh_, topology_, whole, materials)),
      memory_(first_frame_),
      next_(first_frame_),
      nearest_(nearest_to(whole.clusters(), whole.topology.cells, mesh_.vertices)),
      anchors_(anchors_at(mesh_.vertices, whole.size())),
      system_(whole.k, workers),
      rotations_(whole.surroundings, workers),
      turns_(whole.clusters().size()),
      shape_(whole.size()),
      kx_(whole.size()) {
  tracking_.begin(memory_);
  next_ = memory_;
  system_.factorize(anchors_);
}

void CoarseTracking::begin(Memory& memory) const { memory.coarse_fit = memory_.fit; }

int CoarseTracking::fit(const Memory& memory, const PointScan& measurement, Field rest,
                        Memory& next, std::span<Vector3> x) {
  gather(memory);
  const int iterations = tracking_.find(memory_, measurement, {}, next_);
  next.coarse_fit = next_.fit;
  restore(memory, rest, next, x);
  return iterations;
}

/// Sets the memory to that of the coarse mesh.
void CoarseTracking::gather(const Memory& memory) {
  for (std::size_t c = 0; c < mesh_.vertices.size(); ++c) {
    const std::size_t v = at(mesh_.vertices[c]);
    memory_.last[c] = memory.last[v];
    memory_.before[c] = memory.before[v];
    memory_.q[c] = memory.q[v];
  }
  memory_.fit = memory.coarse_fit;
  tracking_.shape_.remember(memory_.last, memory_);
}

/// As method detail: Q is turned further as the coarse vertices were, and X is solved for; then Q
/// is fitted to it, and X is solved for again.
void CoarseTracking::restore(const Memory& memory, Field rest, Memory& next, std::span<Vector3> x) {
  tracking_.shape_.fit_rotations(tracking_.x_, next_.q);
  for (std::size_t c = 0; c < turns_.size(); ++c) {
    const auto& [w, i, j, k] = memory_.q[at(nearest_[c])];
    turns_[c] = product(next_.q[at(nearest_[c])], {w, -i, -j, -k});
  }
  rotations_.turn_further(turns_, memory.q, next.q);
  std::ranges::copy(memory.last, x.begin());
  for (std::size_t c = 0; c < mesh_.vertices.size(); ++c) {
    x[at(mesh_.vertices[c])] = tracking_.x_[c];
  }
  for (int i = 0; i < 2; ++i) {
    if (i > 0) rotations_.fit(x, next.q);
    for (std::size_t v = 0; v < x.size(); ++v) {
      const double pull = materials_[at(whole_.topology.component[v])].pull;
      shape_[v] = memory.m[v] + pull * (rest[v] - memory.m[v]);
    }
    turn(next.q, shape_, shape_, workers_);
    system_.apply(x, 1, kx_);
    const Field steps = system_.solve<1>(
        [&](std::size_t v, std::size_t) { return shape_[v] - kx_[v]; }, x, anchors_);
    for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + steps[v];
  }
}

}  // namespace dynmesh
