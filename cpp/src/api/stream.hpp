/// What a completer and a tracker share: one stream of frames of one mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <utility>
#include <vector>

#include "api/disconnected.hpp"
#include "base/geometry.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "kernels/rotation_kernels.hpp"
#include "shape/memory.hpp"

namespace dynmesh {

/// What all sequences of a completer or of a tracker have in common.
struct StreamMesh {
  StreamMesh(Faces mesh_faces, std::size_t n_vertices, Index threads, const TaskSharing& sharing,
             TrainingFrames training_frames = {});

  TrainingFrames training;  ///< empty without training
  Topology topology;
  std::vector<Triangle> faces;
  Workers workers;
  std::uint64_t training_hash = 0;  ///< of the training frames; 0 without training
};

/// One sequence: its memory, and that of the next frame while it is found.
///
/// A frame: call `read` or set `next.last` and `next.known`, estimate the satellites in
/// `next.last`, and call `finish`, `advance` and `write`. Allocates memory only in the constructor.
class Stream {
 public:
  using Frame = std::vector<Vector3<double>>;

  /// Begins a sequence. `mesh` must outlive this object. `largest` is the largest coordinate of the
  /// type in which positions are given.
  Stream(StreamMesh& mesh, Frame frame, DisconnectedRule rule, double largest);

  /// Reads a row for each vertex. Without a mask, finite rows are known. Refuses known rows that
  /// are out of range.
  template <class Real>
  void read(Points<const Real> rows, KnownMask mask);
  /// Completes the disconnected vertices of the next frame. Then resets vertices whose estimate has
  /// diverged to the previous frame, since a NaN would spread to later frames, and finds the ages.
  /// `rotations` are those of the components since the previous frame, or empty.
  void finish(std::span<const Quaternion> rotations = {});
  /// The next frame becomes the last one.
  void advance() noexcept { std::swap(memory, next); }
  /// Copies the last completed frame to the caller's rows.
  template <class Real>
  void write(Points<Real> completed) const;

  [[nodiscard]] std::size_t n_vertices() const { return first_frame.size(); }
  /// Ends reading a memory. Refuses values that no stream can have.
  void check();

  Frame first_frame;
  Memory memory, next;

 private:
  StreamMesh& mesh_;
  double largest_;
  Disconnected disconnected_;
};

/// The numbers of vertices in the report of a frame.
void count(const Generations& generations, FrameReport& report);

}  // namespace dynmesh
