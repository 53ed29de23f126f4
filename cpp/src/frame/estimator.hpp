/// The interface between the completer and its methods.
#pragma once

#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/stored_numbers.hpp"
#include "frame/generations.hpp"
#include "kernels/rotation_kernels.hpp"

namespace dynmesh {

/// A method of estimating the satellites of the frames of one sequence, whose frame 0 the
/// constructors take. Frames have one Vector3 per vertex.
class Estimator {
 public:
  using Frame = std::span<const Vector3<double>>;
  Estimator() = default;
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;
  Estimator(Estimator&&) = delete;
  Estimator& operator=(Estimator&&) = delete;
  virtual ~Estimator() = default;

  /// Classifies the vertices and estimates the satellites of `points` from the anchors and from the
  /// previous completed frame. The anchors, which are the vertices with `known[v] == 1` and not 0,
  /// are already in `points`. Disconnected vertices are not changed, and neither are anchors,
  /// unless the method treats them as noisy. Returns the number of iterations. If it throws because
  /// memory is exhausted, `generations` and everything that later calls depend on are unchanged.
  virtual Index estimate(Frame previous, std::span<Vector3<double>> points,
                         std::span<const std::uint8_t> known, Generations& generations) = 0;

  /// Updates the memory of the method with a completed frame, including its disconnected vertices.
  /// Called before the next `estimate`.
  virtual void remember(Frame /*completed*/) {}

  /// Writes the memory of the method, which has always the same size in bytes, in the internal
  /// order of vertices, which follows from the faces.
  virtual void write_memory(Writer& /*writer*/) const {}
  /// Reads it again at the beginning of a sequence. `completed` is the last completed frame.
  /// Refuses a memory that this method cannot have produced, after which it is of no use.
  virtual void read_memory(Reader& /*reader*/, Frame /*completed*/) {}

  /// (components,) how each component has turned since the previous frame, as unit quaternions, or
  /// empty if the method does not tell.
  [[nodiscard]] virtual std::span<const Quaternion> rotations_of_components() const { return {}; }

  /// (k,) the standard errors of the last estimate, or empty if they are not computed.
  [[nodiscard]] virtual std::span<const double> standard_error() const { return {}; }

  /// The details of the last `estimate` and `remember`.
  [[nodiscard]] virtual StageReport stages() const { return {}; }
};

}  // namespace dynmesh
