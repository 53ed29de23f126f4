/// The state of a stream: what another stream must share to restore it, details of the last frame,
/// the arrays in the caller's order, the memory of the estimator as one block, and a checksum. All
/// fields are little-endian and packed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <span>
#include <vector>

#include "stream/stream.hpp"
#include "support/stored_numbers.hpp"

namespace dynmesh {

/// What a state is of.
struct StateKind {
  StateFormat format;
  const char* name;  ///< in messages
};

/// The size of a state whose estimator has a memory of `of_memory` bytes. `Settings` are those of a
/// completer or of a tracker.
template <class Settings, class Real>
std::size_t size_of_state(const Stream<Real>& stream, std::size_t of_memory);

/// Writes everything up to the memory of the estimator. `training` is the hash of the training
/// frames, 0 without any.
template <class Real, class Settings>
void write_stream(Writer& writer, const StateKind& kind, const Stream<Real>& stream,
                  const Settings& settings, std::uint64_t training, const FrameReport& report);

/// What `write_stream` writes, without what the stream and its settings have in common.
template <class Real>
struct StoredStream {
  explicit StoredStream(std::size_t n_vertices)
      : first_frame(n_vertices), previous(n_vertices), age(n_vertices), known(n_vertices) {}

  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    visit(self.report.iterations);
    visit(self.report.rejected);
    visit(self.report.stages.blend);
    visit(self.report.stages.prior_weight);
    visit(self.report.stages.prior_share);
    visit(self.report.stages.first_order_share);
    visit(self.n_frames);
    for (auto* frame : {&self.first_frame, &self.previous}) {
      for (auto& position : *frame) visit(std::span(&position.x, 3));
    }
    visit(self.age);
    visit(self.known);
  }

  FrameReport report;  ///< without the numbers of vertices and the standard error
  std::size_t n_frames = 0;
  std::vector<Vector3<Real>> first_frame;  ///< in the caller's order
  // In the internal order after reading:
  std::vector<Vector3<Real>> previous;
  std::vector<Index> age;
  std::vector<std::uint8_t> known;
};

/// Reads it again, and leaves `reader` at the memory of the estimator. Refuses a state of another
/// kind, mesh, training sequence or other settings, one that is damaged or not of `size` bytes, and
/// values that no stream can have.
template <class Real, class Settings>
StoredStream<Real> read_stream(Reader& reader, std::span<const std::byte> state, std::size_t size,
                               const StateKind& kind, const Stream<Real>& stream,
                               const Settings& settings, std::uint64_t training);

}  // namespace dynmesh
