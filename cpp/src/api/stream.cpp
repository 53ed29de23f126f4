#include "api/stream.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"
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

FrameStream::Parts::Parts(std::shared_ptr<StreamMesh> of_all, std::shared_ptr<StreamSolver> solver,
                          double largest)
    : mesh(std::move(of_all)),
      shared_solver(std::move(solver)),
      largest_coordinate(largest),
      memory(first_frame()),
      next(memory) {}

template <class Real>
void FrameStream::Parts::read(Points<const Real> rows, KnownMask mask) {
  std::atomic<bool> are_in_range{true};
  // Loops without branches, since masks may be random.
  const auto read_rows = [&, rows, mask](Index first, Index last) {
    for (Index v = first; v < last; ++v) next.last[v] = row(rows, at(v));
    for (Index v = first; v < last; ++v) {
      next.known[v] = (mask.data == nullptr ? is_finite(next.last[v]) : mask[at(v)]) ? 1 : 0;
    }
    bool all_in_range = true;
    for (Index v = first; v < last; ++v) {
      all_in_range &=
          (int{is_in_range(next.last[v], largest_coordinate)} | int{next.known[v] == 0}) != 0;
    }
    if (!all_in_range) are_in_range.store(false, std::memory_order_relaxed);
  };
  mesh->workers.for_each_chunk(static_cast<Index>(n_vertices()), read_rows);
  for (std::size_t v = 0; v < n_vertices() && !are_in_range; ++v) {
    if (next.known[v] != 0) (void)known_row(rows, v);
  }
}

void FrameStream::Parts::finish() {
  mesh->workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    for (Index v = first; v < last; ++v) {
      if (!is_in_range(next.last[v], largest_coordinate)) next.last[v] = memory.last[v];
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
void FrameStream::Parts::put(Points<Real> completed) const {
  mesh->workers.for_each_chunk(static_cast<Index>(n_vertices()),
                               [&, completed](Index first, Index last) {
                                 for (Index v = first; v < last; ++v)
                                   put_row(completed, at(v), memory.last[v]);
                               });
}

bool FrameStream::Parts::begins_with(const Frame& frame) const {
  return std::ranges::equal(std::as_bytes(std::span(frame)),
                            std::as_bytes(std::span(first_frame())));
}

void FrameStream::Parts::check() {
  check_memory(memory, largest_coordinate);
  memory.generations.classify(mesh->topology.cells, memory.known);
  next = memory;  // numbers that no step writes would otherwise differ from frame to frame
}

void FrameStream::Parts::publish() const noexcept {
  publish_report();
  mesh->n_frames.store(memory.n_frames);
}

void count(const Generations& generations, FrameReport& report) {
  report.known = generations.anchors();
  report.filled = generations.reached();
  report.disconnected = generations.disconnected_vertices();
}

template void FrameStream::Parts::read(Points<const float>, KnownMask);
template void FrameStream::Parts::read(Points<const double>, KnownMask);
template void FrameStream::Parts::put(Points<float>) const;
template void FrameStream::Parts::put(Points<double>) const;

FrameStream::FrameStream() = default;
FrameStream::~FrameStream() = default;
FrameStream::FrameStream(FrameStream&&) noexcept = default;
FrameStream& FrameStream::operator=(FrameStream&&) noexcept = default;

void FrameStream::begin(std::unique_ptr<Parts> first) {
  mesh_ = first->mesh;
  parts_ = std::move(first);
  parts_->publish();
  mesh_->state_size = state().size();
}
void FrameStream::replace(std::unique_ptr<Parts> sequence) noexcept {
  parts_ = std::move(sequence);
  parts_->publish();
}

std::vector<std::byte> FrameStream::state() const {
  Writer writer(state_size());
  parts_->write(writer);
  return writer.take_sealed();
}

void FrameStream::restore(std::span<const std::byte> state) {
  const DefaultArithmetic arithmetic;
  Reader reader = parts_->open(state);
  Parts::Frame frame(n_vertices());
  reader.read(frame);
  check_stored_frame(frame, parts_->largest_coordinate);
  auto restored = parts_->begun(std::move(frame));
  restored->read_memory(reader);
  replace(std::move(restored));
}

std::size_t FrameStream::state_size() const { return mesh_->state_size; }
std::size_t FrameStream::n_vertices() const { return mesh_->topology.cells.size(); }
std::size_t FrameStream::n_edges() const { return mesh_->topology.cells.neighbours.size() / 2; }
const TopologyReport& FrameStream::topology() const { return mesh_->topology.report; }
std::size_t FrameStream::n_frames() const { return mesh_->n_frames; }
std::span<const Index> FrameStream::generation() const {
  return parts_->memory.generations.of_vertices();
}
std::span<const Index> FrameStream::age() const { return parts_->memory.age; }

}  // namespace dynmesh
