/// What completers and trackers share: one stream of frames of one mesh.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/frame_stream.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "api/published.hpp"
#include "base/geometry.hpp"
#include "base/stored_numbers.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "kernels/rotation_kernels.hpp"
#include "shape/memory.hpp"

namespace dynmesh {

/// What all sequences of a completer or of a tracker have in common. `reset` and `restore` leave it
/// where it is, so that any thread may read the constants in it, and what is published, at any
/// time.
struct StreamMesh {
  StreamMesh(Faces mesh_faces, std::size_t n_vertices, Index threads, const TaskSharing& sharing,
             TrainingFrames training_frames = {});

  TrainingFrames training;  ///< empty without training
  Topology topology;
  std::vector<Triangle> faces;
  Workers workers;
  std::uint64_t training_hash = 0;        ///< of the training frames; 0 without training
  std::size_t state_size = 0;             ///< of all states; set by the constructor of the stream
  std::atomic<std::size_t> n_frames = 0;  ///< of the sequence
};

/// The same with settings, and reports of this kind.
template <class Settings, class Report>
struct StreamMeshOf final : StreamMesh {
  StreamMeshOf(const Settings& chosen, Faces mesh_faces, std::size_t n_vertices,
               const TaskSharing& sharing, TrainingFrames training_frames = {})
      : StreamMesh(mesh_faces, n_vertices, chosen.threads, sharing, std::move(training_frames)),
        settings(chosen) {}

  Settings settings;
  Published<Report> report;  ///< of the last frame
};

/// Finds the frames of sequences that begin with the same frame. Nothing is in it on which a later
/// frame depends, but for the modes of a completer that learns.
struct StreamSolver {
  explicit StreamSolver(std::vector<Vector3> frame) : first_frame(std::move(frame)) {}

  std::vector<Vector3> first_frame;
};

/// One sequence: its memory, and that of the next frame while it is found.
///
/// A frame: call `read` or set `next.last` and `next.known`, estimate the satellites in
/// `next.last`, and call `finish`, `advance` and `put`. Allocates memory only in the constructor.
struct FrameStream::Parts {
  using Frame = std::vector<Vector3>;

  /// Begins a sequence. `largest` is the largest coordinate of the type in which positions are
  /// given.
  Parts(std::shared_ptr<StreamMesh> of_all, std::shared_ptr<StreamSolver> solver, double largest);
  virtual ~Parts() = default;
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;
  Parts(Parts&&) = delete;
  Parts& operator=(Parts&&) = delete;

  /// Another sequence with the same mesh and settings, and with the same solver if it begins with
  /// the same frame.
  [[nodiscard]] virtual std::unique_ptr<Parts> begun(Frame frame) const = 0;
  /// Publishes the report of the last frame.
  virtual void publish_report() const noexcept = 0;
  /// Publishes the last frame, and how many there were.
  void publish() const noexcept;
  /// Everything that later frames depend on.
  virtual void write(Writer& writer) const = 0;
  /// Checks the beginning of a state, after which frame 0 follows.
  [[nodiscard]] virtual Reader open(std::span<const std::byte> state) const = 0;
  /// Reads what follows frame 0. Refuses values that no sequence can have, and is of no use then.
  virtual void read_memory(Reader& reader) = 0;

  /// Reads a row for each vertex. Without a mask, finite rows are known. Refuses known rows that
  /// are out of range.
  template <class Real>
  void read(Points<const Real> rows, KnownMask mask);
  /// Resets vertices whose estimate has diverged to the previous frame, since a NaN would spread to
  /// later frames, and finds the ages.
  void reset_diverged();
  void count_frames();
  void finish() {
    reset_diverged();
    count_frames();
  }
  /// The next frame becomes the last one.
  void advance() noexcept { std::swap(memory, next); }
  /// Copies the last completed frame to the caller's rows.
  template <class Real>
  void put(Points<Real> completed) const;

  [[nodiscard]] const Frame& first_frame() const { return shared_solver->first_frame; }
  [[nodiscard]] std::size_t n_vertices() const { return first_frame().size(); }
  /// Whether frame 0 is this one, bit for bit.
  [[nodiscard]] bool begins_with(const Frame& frame) const;
  /// Checks the memory that was read, and finds what follows from it.
  void check();

  std::shared_ptr<StreamMesh> mesh;  ///< of all sequences
  std::shared_ptr<StreamSolver> shared_solver;
  double largest_coordinate;
  Memory memory, next;
};

/// The numbers of vertices in the report of a frame.
void count(const Generations& generations, FrameReport& report);

}  // namespace dynmesh
