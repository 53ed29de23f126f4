/// Completion of a dynamic mesh, one frame at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/export.hpp>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

namespace dynmesh {

/// Completes the frames of one dynamic mesh in their order, each from itself and the past alone.
///
/// `push`, `push_sparse` and `skip` write the completed frame to `completed` and return its report.
/// Known vertices come back exactly as given, except that with the setting `noise` they move too,
/// and that those which `reject_outliers` takes as unknown are estimated. They allocate nothing,
/// except that method detail makes room for a factor larger than all before. Every one of them
/// throws std::invalid_argument for bad input (wrong counts, null pointers, strides of 0, a known
/// position that is not finite or has a coordinate beyond 1e18 for float and 1e200 for double,
/// indices out of range or twice), saying what, where and with which value. `completed` may be the
/// very view that `points` is, or other columns of the same interleaved buffer; output that would
/// overwrite input in any other way is refused.
///
/// Completed frames are finite always: an estimate that would leave the range above, which takes a
/// recursion that diverges for long, stays where it was.
///
/// A call that throws, whatever it throws, std::bad_alloc included, leaves the completer as it was
/// before the call and writes nothing to `completed`.
///
/// One thread at a time per object; different objects are independent.
template <class Real>
class DYNMESH_EXPORT Completer {
 public:
  /// `faces`, at least one, is read once. `first_frame` must be complete: at least one vertex, all
  /// finite. Throws std::invalid_argument for these and for settings that `check_settings` refuses.
  Completer(Faces faces, Points<const Real> first_frame, const Settings& settings = {});
  ~Completer();
  Completer(const Completer&) = delete;
  Completer& operator=(const Completer&) = delete;
  Completer(Completer&&) noexcept;
  Completer& operator=(Completer&&) noexcept;

  /// `points` and `known` have a row for each vertex; rows that are not known are not read.
  FrameReport push(Points<const Real> points, KnownMask known, Points<Real> completed);

  /// Rows of `points` with a coordinate that is not finite are missing.
  FrameReport push(Points<const Real> points, Points<Real> completed);

  /// Vertex `indices[i]` was observed at `points(i)`, and no other was.
  FrameReport push_sparse(std::span<const Index> indices, Points<const Real> points,
                          Points<Real> completed);

  /// A frame of which nothing was observed.
  FrameReport skip(Points<Real> completed);

  /// This complete frame becomes frame 0, as if the completer were new. Allocates.
  void reset(Points<const Real> frame);

  /// All that later frames depend on, in a form (little-endian, versioned) that may be stored and
  /// moved. It holds no times, so that completers that were given the same frames have the same
  /// bytes. `restore` takes it up in any completer of the same faces, Real and settings; one that
  /// does not fit, is damaged, or holds what no completer can come to, throws
  /// std::invalid_argument: the bytes may be anything. Both allocate.
  [[nodiscard]] std::vector<std::byte> state() const;
  /// How many bytes `state` returns: the same number for the life of the completer.
  [[nodiscard]] std::size_t state_size() const;
  void restore(std::span<const std::byte> state);

  [[nodiscard]] std::size_t n_vertices() const;
  [[nodiscard]] const Settings& settings() const;
  [[nodiscard]] const TopologyReport& topology() const;

  // `restore` brings these three back too, the report without its times, which are 0 then.

  /// (k,) of the last frame: 0 anchor, g satellite, -1 unseen. Valid until the next call of any
  /// method.
  [[nodiscard]] std::span<const Index> generation() const;
  /// (k,) frames since the vertex was last observed. Valid until the next call of any method.
  [[nodiscard]] std::span<const Index> age() const;
  /// Of the last frame; all vertices known before the first.
  [[nodiscard]] const FrameReport& report() const;

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
};

}  // namespace dynmesh
