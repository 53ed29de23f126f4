#include "api/stream.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "base/arguments.hpp"
#include "base/stored_numbers.hpp"
#include "mesh/faces.hpp"

namespace dynmesh {

StreamMesh::StreamMesh(Faces mesh_faces, std::size_t n_vertices, Index threads,
                       const TaskSharing& sharing, TrainingFrames training_frames)
    : training(std::move(training_frames)),
      topology(checked_topology(mesh_faces, n_vertices)),
      faces(triangles_of(mesh_faces)),
      workers(threads, sharing) {
  for (const auto& frame : training) {
    training_hash = training_hash * 31 + (hash_of(std::as_bytes(std::span(frame))) | 1);
  }
}

Stream::Stream(StreamMesh& mesh, Frame frame, DisconnectedRule rule, double largest)
    : first_frame(std::move(frame)),
      memory(first_frame),
      next(first_frame),
      mesh_(mesh),
      largest_(largest),
      disconnected_(mesh.topology, rule, first_frame) {}

template <class Real>
void Stream::read(Points<const Real> rows, KnownMask mask) {
  std::atomic<bool> are_in_range{true};
  // Loops without branches, since masks may be random.
  const auto read_rows = [&, rows, mask](Index first, Index last) {
    for (Index v = first; v < last; ++v) next.last[v] = row(rows, at(v));
    for (Index v = first; v < last; ++v) {
      next.known[v] = (mask.data == nullptr ? is_finite(next.last[v]) : mask[at(v)]) ? 1 : 0;
    }
    bool all_in_range = true;
    for (Index v = first; v < last; ++v) {
      all_in_range &= is_in_range(next.last[v], largest_) | (next.known[v] == 0);
    }
    if (!all_in_range) are_in_range.store(false, std::memory_order_relaxed);
  };
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()), read_rows);
  for (std::size_t v = 0; v < n_vertices() && !are_in_range; ++v) {
    if (next.known[v] != 0) (void)known_row(rows, v);
  }
}

void Stream::finish(std::span<const Quaternion> rotations) {
  disconnected_.complete(memory.last, next.last, next.generations, rotations);
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    for (Index v = first; v < last; ++v) {
      if (!is_in_range(next.last[v], largest_)) next.last[v] = memory.last[v];
    }
  });
  for (std::size_t v = 0; v < next.age.size(); ++v) {
    const Index older = memory.age[v] + (memory.age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
    next.age[v] = next.known[v] != 0 ? 0 : older;
  }
  const bool is_counted = memory.n_frames < std::numeric_limits<std::size_t>::max();
  next.n_frames = memory.n_frames + (is_counted ? 1 : 0);
}

template <class Real>
void Stream::write(Points<Real> completed) const {
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()),
                               [&, completed](Index first, Index last) {
                                 for (Index v = first; v < last; ++v)
                                   put_row(completed, at(v), memory.last[v]);
                               });
}

void Stream::check() {
  check_memory(memory, largest_);
  memory.generations.classify(mesh_.topology.cells, memory.known);
}

void count(const Generations& generations, FrameReport& report) {
  report.known = generations.anchors();
  report.filled = generations.reached();
  report.disconnected = generations.disconnected_vertices();
}

template void Stream::read(Points<const float>, KnownMask);
template void Stream::read(Points<const double>, KnownMask);
template void Stream::write(Points<float>) const;
template void Stream::write(Points<double>) const;

}  // namespace dynmesh
