/// What completers and trackers have in common.
#pragma once

#include <cstddef>
#include <dynmesh/export.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

namespace dynmesh {

struct Stream;

/// One sequence of frames of one mesh. One that was moved from may only be destroyed or assigned
/// to.
///
/// Threads. Different objects are independent. `n_vertices`, `n_edges`, `topology`, `state_size`,
/// `settings`, `n_frames` and `report` may be called at any time, also while another thread is in
/// any other function but the destructor and moves; what they return references to stays valid
/// until the object is destroyed or assigned to. `n_frames` and `report` are of the last frame
/// that was complete when they were called. The other const functions may be called by several
/// threads at once while no thread is in one that is not const, which only one thread at a time may
/// be in. The spans that they return are valid until the next call of a function that is not const.
class DYNMESH_EXPORT FrameStream {
 public:
  /// `state` returns everything that later frames depend on, in a little-endian, versioned format
  /// that can be stored or sent. It contains no times, so objects that received the same frames
  /// have identical states.
  ///
  ///     const std::vector<std::byte> saved = completer.state();
  ///     file.write(reinterpret_cast<const char*>(saved.data()), std::ssize(saved));
  ///     other.restore(saved);  // or std::as_bytes(std::span(read)) of bytes that were read
  ///
  /// `restore` continues from a state in any object of the same class with the same faces in the
  /// same order, Real, settings and training sequence. It throws std::invalid_argument if the state
  /// belongs to another mesh or other settings, is damaged, or holds values that no such object can
  /// produce. It is safe to pass arbitrary bytes. Both functions allocate memory. If the sequence
  /// begins with the same frame as that of this object, `restore` takes about as long as copying
  /// the state, unless modes are learned; otherwise as long as the constructor.
  [[nodiscard]] std::vector<std::byte> state() const;
  /// The number of bytes that `state` returns. It does not change during the lifetime of the
  /// object.
  [[nodiscard]] std::size_t state_size() const;
  void restore(std::span<const std::byte> state);

  /// The number of vertices, k.
  [[nodiscard]] std::size_t n_vertices() const;
  /// The number of edges of the mesh.
  [[nodiscard]] std::size_t n_edges() const;
  [[nodiscard]] const TopologyReport& topology() const;

  // `restore` restores what follows, and the standard errors and reports, except for times, which
  // become 0.

  /// The number of frames since construction or `reset`.
  [[nodiscard]] std::size_t n_frames() const;
  /// (k,) the generation of each vertex in the last frame: 0 for an anchor (a known vertex, or one
  /// that has a measured point), the number of edges to the nearest anchor for a satellite (another
  /// vertex that a chain of edges connects to an anchor), -1 for a disconnected vertex.
  [[nodiscard]] std::span<const Index> generation() const;
  /// (k,) the number of frames since the vertex was last observed.
  [[nodiscard]] std::span<const Index> age() const;

 protected:
  explicit FrameStream(std::unique_ptr<Stream> stream);
  ~FrameStream();
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;
  FrameStream(FrameStream&&) noexcept;
  FrameStream& operator=(FrameStream&&) noexcept;

  std::unique_ptr<Stream> stream_;
};

}  // namespace dynmesh
