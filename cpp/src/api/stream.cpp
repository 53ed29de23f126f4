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
  std::atomic<bool> may_be_large{false};
  // Loops without branches, since masks may be random, on local variables, which no write changes.
  const auto read_rows = [&, rows, mask](Index first, Index last) {
    const auto given = rows;
    const auto given_mask = mask;
    const double largest = largest_coordinate;
    Vector3* const points = next.last.data();
    std::uint8_t* const known = next.known.data();
    for (Index v = first; v < last; ++v) points[v] = row(given, at(v));
    int any_large = 0;
    for (Index v = first; v < last; ++v) {
      // Not less than the largest coordinate, and not a number if one of them is none.
      const double sum = std::abs(points[v].x) + std::abs(points[v].y) + std::abs(points[v].z);
      const int fits{sum <= largest};
      const int is_known = given_mask.data == nullptr ? fits : int{given_mask[at(v)]};
      any_large |= (1 - fits) & (given_mask.data == nullptr ? int{!std::isnan(sum)} : is_known);
      known[v] = static_cast<std::uint8_t>(is_known);
    }
    if (any_large != 0) may_be_large.store(true, std::memory_order_relaxed);
  };
  mesh->workers.for_each_chunk(static_cast<Index>(n_vertices()), read_rows);
  for (std::size_t v = 0; v < n_vertices() && may_be_large; ++v) {
    next.known[v] = (mask.data == nullptr ? is_finite(next.last[v]) : mask[v]) ? 1 : 0;
    if (next.known[v] != 0) (void)known_row(rows, v);
  }
}

void FrameStream::Parts::reset_diverged() {
  mesh->workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    for (Index v = first; v < last; ++v) {
      if (!is_in_range(next.last[v], largest_coordinate)) next.last[v] = memory.last[v];
    }
  });
}

void FrameStream::Parts::count_frames() {
  mesh->workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    const Index* const age = memory.age.data();
    const std::uint8_t* const known = next.known.data();
    Index* const next_age = next.age.data();
    for (Index v = first; v < last; ++v) {
      const Index older = age[v] + (age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
      next_age[v] = known[v] != 0 ? 0 : older;
    }
  });
  const bool is_counted = memory.n_frames < std::numeric_limits<std::size_t>::max();
  next.n_frames = memory.n_frames + (is_counted ? 1 : 0);
}

template <class Real>
void FrameStream::Parts::put(Points<Real> completed) const {
  mesh->workers.for_each_chunk(static_cast<Index>(n_vertices()),
                               [&, completed](Index first, Index last) {
                                 const Points<Real> to = completed;
                                 const Vector3* const from = memory.last.data();
                                 for (Index v = first; v < last; ++v) {
                                   to(at(v), 0) = static_cast<Real>(from[v].x);
                                   to(at(v), 1) = static_cast<Real>(from[v].y);
                                   to(at(v), 2) = static_cast<Real>(from[v].z);
                                 }
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
