#include "api/stream.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "api/state.hpp"
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
    : generations(frame.size()),
      first_frame(std::move(frame)),
      previous(first_frame),
      known(first_frame.size(), 1),
      age(first_frame.size()),
      current(first_frame.size()),
      current_known(first_frame.size()),
      mesh_(mesh),
      largest_(largest),
      disconnected_(mesh.topology, rule, first_frame) {
  generations.classify(mesh.topology.cells, known);
}

template <class Real>
void Stream::read(Points<const Real> rows, KnownMask mask) {
  std::atomic<bool> are_in_range{true};
  // Loops without branches, since masks may be random.
  const auto read_rows = [&, rows, mask](Index first, Index last) {
    for (Index v = first; v < last; ++v) current[v] = row(rows, at(v));
    for (Index v = first; v < last; ++v) {
      current_known[v] = (mask.data == nullptr ? is_finite(current[v]) : mask[at(v)]) ? 1 : 0;
    }
    bool all_in_range = true;
    for (Index v = first; v < last; ++v) {
      all_in_range &= is_in_range(current[v], largest_) | (current_known[v] == 0);
    }
    if (!all_in_range) are_in_range.store(false, std::memory_order_relaxed);
  };
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()), read_rows);
  for (std::size_t v = 0; v < n_vertices() && !are_in_range; ++v) {
    if (current_known[v] != 0) (void)known_row(rows, v);
  }
}

void Stream::finish(std::span<const Quaternion> rotations) {
  disconnected_.complete(previous, current, generations, rotations);
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    for (Index v = first; v < last; ++v) {
      if (!is_in_range(current[v], largest_)) current[v] = previous[v];
    }
  });
}

template <class Real>
void Stream::write(Points<Real> completed) const {
  mesh_.workers.for_each_chunk(static_cast<Index>(n_vertices()),
                               [&, completed](Index first, Index last) {
                                 for (Index v = first; v < last; ++v)
                                   put_row(completed, at(v), previous[v]);
                               });
}

void Stream::advance() {
  std::swap(previous, current);
  std::swap(known, current_known);
  for (std::size_t v = 0; v < age.size(); ++v) {
    const Index older = age[v] + (age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
    age[v] = known[v] != 0 ? 0 : older;
  }
  if (n_frames < std::numeric_limits<std::size_t>::max()) ++n_frames;
}

/// The checksum of a state detects damage but not bytes that were made up. This refuses all values
/// that later frames cannot handle, wherever the bytes come from.
void Stream::recall() {
  check_stored_frame(previous, largest_);
  for (std::size_t v = 0; v < age.size(); ++v) {
    if (age[v] >= 0 && known[v] <= 1) continue;
    refuse_state(joined("vertex ", v, " has the age ", age[v], " and the mask ", known[v],
                        ", which is not possible"));
  }
  generations.classify(mesh_.topology.cells, known);
}

void Stream::count(FrameReport& report) const {
  report.known = generations.anchors();
  report.filled = generations.reached();
  report.disconnected = generations.disconnected_vertices();
}

template void Stream::read(Points<const float>, KnownMask);
template void Stream::read(Points<const double>, KnownMask);
template void Stream::write(Points<float>) const;
template void Stream::write(Points<double>) const;

}  // namespace dynmesh
