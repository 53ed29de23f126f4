/// What a completer and a tracker share: one stream of frames of one mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "kernels/kernels.hpp"
#include "mesh/generations.hpp"
#include "mesh/numbering.hpp"
#include "stream/disconnected.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Converts between the caller's order of vertices and the internal order. Allocates no memory.
/// Packed rows are processed by faster loops.
template <class Real>
class Exchange {
 public:
  /// Both arguments must outlive this object.
  Exchange(const Numbering& numbering, Workers& workers);

  /// Copies every row to `points` and sets `is_known` according to the mask or, if `known.data` is
  /// null, for finite rows. Returns whether all known rows are in range; rows that are not are
  /// copied as well.
  bool read(Points<const Real> rows, KnownMask known, std::span<Vector3<Real>> points,
            std::span<std::uint8_t> is_known);

  /// Copies the completed points to the caller's rows. Points that are out of range are first reset
  /// to their previous positions.
  void write(std::span<Vector3<Real>> points, std::span<const Vector3<Real>> previous,
             Points<Real> rows);

 private:
  const Numbering& numbering_;
  Workers& workers_;
  const RowKernels<Real>& kernels_;
};

/// The mesh, the last frames and the ages. All arrays are in the internal order of vertices, which
/// is that of the caller unless it scatters neighbours over a large mesh.
///
/// A frame: set `known` and `current`, classify `generations`, estimate the satellites in
/// `current`, and call `write` and `advance`. Allocates memory in the constructor and in `prepare`.
template <class Real>
class Stream {
 public:
  using Frame = std::vector<Vector3<Real>>;

  /// `first_frame` is in the caller's order.
  Stream(const Frame& first_frame, Topology caller_topology, DisconnectedRule rule, Index threads,
         bool has_uncertainty);

  /// A new frame 0 with what is computed from it.
  struct Prepared {
    Frame first_frame;
    Disconnected<Real> disconnected;
  };
  /// `first_frame` is in the caller's order. If it throws, nothing has changed.
  [[nodiscard]] Prepared prepare(const Frame& first_frame) const;
  /// Begins a sequence.
  void begin(Prepared prepared) noexcept;

  /// Completes the disconnected vertices of `current`, and copies it to the caller's rows. Vertices
  /// whose estimate has diverged are first reset to the previous frame, since a NaN would spread to
  /// later frames.
  void write(Points<Real> completed);
  /// Makes the current frame the previous one, and updates the ages.
  void advance();

  /// Continues after an earlier frame, as after `advance`.
  void recall(Frame previous, std::vector<Index> age, std::vector<std::uint8_t> known,
              std::size_t frames);

  [[nodiscard]] std::size_t n_vertices() const { return topology->cells.size(); }
  /// The numbers of vertices in the report of the last frame.
  void count(FrameReport& report) const;

  /// Values of the last frame in the caller's order. The mask is 1 for its anchors.
  [[nodiscard]] std::span<const std::uint8_t> known_of_caller() const;
  [[nodiscard]] std::span<const Index> generation_of_caller() const;
  [[nodiscard]] std::span<const Index> age_of_caller() const;
  /// Converts (k,) `standard_error`, in the internal order.
  [[nodiscard]] std::span<const Real> in_caller_order(std::span<const double> standard_error) const;

  Numbering numbering;
  std::unique_ptr<const Topology> topology;
  // The following members refer to the two above and to each other.
  Workers workers;
  Exchange<Real> exchange;
  Generations generations;
  Disconnected<Real> disconnected;

  Frame first_frame;
  Frame previous;                   // the last completed frame, V
  Frame current;                    // the frame being completed
  std::vector<std::uint8_t> known;  // the known mask of the current frame
  std::vector<Index> age;
  std::size_t n_frames = 0;  // since `begin`

 private:
  template <class T>
  std::span<const T> in_caller_order(std::span<const T> values, std::vector<T>& copy) const;
  void forget_copies() noexcept;

  // Copies in the caller's order; empty until requested.
  mutable std::vector<std::uint8_t> known_copy_;
  mutable std::vector<Index> generation_copy_;
  mutable std::vector<Index> age_copy_;
  mutable std::vector<Real> standard_error_copy_;
};

}  // namespace dynmesh
