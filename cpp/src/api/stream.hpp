/// What a completer and a tracker share: one stream of frames of one mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "api/disconnected.hpp"
#include "base/geometry.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "frame/estimator.hpp"
#include "frame/generations.hpp"

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

/// The last frames of a sequence, and the ages of the vertices.
///
/// A frame: call `read` or set `current` and `current_known`, classify `generations`, estimate the
/// satellites in `current`, and call `finish`, `advance` and `write`. Allocates memory only in the
/// constructor.
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
  /// Completes the disconnected vertices of `current`. Then resets vertices whose estimate has
  /// diverged to the previous frame, since a NaN would spread to later frames. `rotations` are
  /// those of the components since the previous frame, or empty.
  void finish(std::span<const Quaternion> rotations = {});
  /// Makes the current frame the previous one, and updates the ages.
  void advance();
  /// Copies the last completed frame to the caller's rows.
  template <class Real>
  void write(Points<Real> completed) const;

  [[nodiscard]] std::size_t n_vertices() const { return first_frame.size(); }
  /// The numbers of vertices in the report of the last frame.
  void count(FrameReport& report) const;

  /// What a state keeps beside `first_frame`.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    visit(self.n_frames);
    for (auto& position : self.previous) visit(std::span(&position.x, 3));
    visit(self.age);
    visit(self.known);
  }
  /// Ends reading them. Refuses values that no stream can have.
  void recall();

  Generations generations;
  Frame first_frame;
  Frame previous;                   // the last completed frame, V
  std::vector<std::uint8_t> known;  // its anchors
  std::vector<Index> age;           // of its vertices
  Frame current;                    // the frame being completed
  std::vector<std::uint8_t> current_known;
  std::size_t n_frames = 0;  // since frame 0

 private:
  StreamMesh& mesh_;
  double largest_;
  Disconnected disconnected_;
};

}  // namespace dynmesh
