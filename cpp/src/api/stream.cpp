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

Stream::Stream(Faces mesh_faces, std::size_t n_vertices, Index threads, const TaskSharing& sharing,
               const Coordinates& given, TrainingFrames training_frames)
    : coordinates(given),
      training(std::move(training_frames)),
      topology(checked_topology(mesh_faces, n_vertices)),
      faces(triangles_of(mesh_faces)),
      workers(threads, sharing),
      memory({}),
      next({}) {
  for (const auto& frame : training) {
    training_hash = training_hash * 31 + (hash_of(std::as_bytes(std::span(frame))) | 1);
  }
}

template <class Real>
void Stream::read(Points<const Real> rows, KnownMask mask) {
  std::atomic<bool> may_be_large{false};
  // Loops without branches, since masks may be random, on local variables, which no write changes.
  const auto read_rows = [&, rows, mask](Index first, Index last) {
    const auto given = rows;
    const auto given_mask = mask;
    const double largest = coordinates.largest;
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
  workers.for_each_chunk(static_cast<Index>(n_vertices()), read_rows);
  for (std::size_t v = 0; v < n_vertices() && may_be_large; ++v) {
    next.known[v] = (mask.data == nullptr ? is_finite(next.last[v]) : mask[v]) ? 1 : 0;
    if (next.known[v] != 0) (void)known_row(rows, v);
  }
}

void Stream::reset_diverged(Field previous, std::span<Vector3> completed) {
  workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index first, Index last) {
    for (Index v = first; v < last; ++v) {
      if (!is_in_range(completed[v], coordinates.largest)) completed[v] = previous[v];
    }
  });
}

void Stream::count_frames(const Memory& last, Memory& following) {
  workers.for_each_chunk(static_cast<Index>(n_vertices()), [&](Index begin, Index end) {
    const Index* const age = last.age.data();
    const std::uint8_t* const known = following.known.data();
    Index* const next_age = following.age.data();
    for (Index v = begin; v < end; ++v) {
      const Index older = age[v] + (age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
      next_age[v] = known[v] != 0 ? 0 : older;
    }
  });
  const bool is_counted = last.n_frames < std::numeric_limits<std::size_t>::max();
  following.n_frames = last.n_frames + (is_counted ? 1 : 0);
}

void Stream::advance() noexcept {
  std::swap(memory, next);
  round_errors();
}

void Stream::round_errors() noexcept {
  if (rounded_errors.empty()) return;
  std::ranges::transform(memory.errors.standard_errors, rounded_errors.begin(),
                         saturated_or_infinite<float>);
}

template <class Real>
void Stream::put(Points<Real> completed) {
  const auto put_rows = [&, completed](Index first, Index last) {
    const Points<Real> to = completed;
    const Vector3* const from = completed_frame(memory).data();
    for (Index v = first; v < last; ++v) {
      to(at(v), 0) = static_cast<Real>(from[v].x);
      to(at(v), 1) = static_cast<Real>(from[v].y);
      to(at(v), 2) = static_cast<Real>(from[v].z);
    }
  };
  workers.for_each_chunk(static_cast<Index>(n_vertices()), put_rows);
}

template void Stream::read(Points<const float>, KnownMask);
template void Stream::read(Points<const double>, KnownMask);
template void Stream::put(Points<float>);
template void Stream::put(Points<double>);

FrameStream::FrameStream(std::unique_ptr<Stream> stream) : stream_(std::move(stream)) {}
FrameStream::~FrameStream() = default;
FrameStream::FrameStream(FrameStream&&) noexcept = default;
FrameStream& FrameStream::operator=(FrameStream&&) noexcept = default;

std::vector<std::byte> FrameStream::state() const {
  Writer writer(state_size());
  stream_->write(writer);
  return writer.take_sealed();
}

void FrameStream::restore(std::span<const std::byte> state) {
  const DefaultArithmetic arithmetic;
  stream_->restore(state);
}

std::size_t FrameStream::state_size() const { return stream_->state_size; }
std::size_t FrameStream::n_vertices() const { return stream_->n_vertices(); }
std::size_t FrameStream::n_edges() const { return stream_->topology.cells.neighbours.size() / 2; }
const TopologyReport& FrameStream::topology() const { return stream_->topology.report; }
std::size_t FrameStream::n_frames() const { return stream_->n_frames; }
std::span<const Index> FrameStream::generation() const {
  return stream_->memory.generations.of_vertices();
}
std::span<const Index> FrameStream::age() const { return stream_->memory.age; }

}  // namespace dynmesh
