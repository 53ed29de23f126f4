/// The interface between the completer and its methods.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "generations/generations.hpp"

namespace dynmesh {

/// What the standard errors of later frames depend on; see error_bars.hpp.
struct MemoryOfErrors {
  using Row = std::array<double, 34>;
  std::vector<Row> rows;         ///< one for each vertex, or empty
  std::array<double, 7> sums{};  ///< over the mesh
};

/// A method of estimating the satellites of a frame. Frames have one Vector3 per vertex.
template <class Real>
class Estimator {
 public:
  using Frame = std::span<const Vector3<Real>>;
  /// The memory of one vertex. For method detail it is the rotation, as a quaternion w x y z, and
  /// the recent change of the shape.
  using Row = std::array<double, 7>;
  /// The shapes of up to 32 frames at one vertex: x of all, then y, then z.
  using Shapes = std::array<float, std::size_t{3} * 32>;
  /// What a method stores in addition to frames. Only method detail stores anything.
  struct Memory {
    std::vector<Row> rows;  ///< one for each vertex, or empty
    double anchor_weight = 0;
    std::vector<double> pose;    ///< of a subject seen before, `shape_fit_size()` numbers
    std::vector<Shapes> shapes;  ///< learned on the way, `shape_rows()` of them
    MemoryOfErrors errors;       ///< of the standard errors, if they are computed
  };

  Estimator() = default;
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;
  Estimator(Estimator&&) = delete;
  Estimator& operator=(Estimator&&) = delete;
  virtual ~Estimator() = default;

  /// Begins a sequence whose frame 0 is `first_frame`. If it throws, nothing has changed.
  virtual void reset(Frame first_frame) = 0;

  /// Classifies the vertices and estimates the satellites of `points` from the anchors and from the
  /// previous completed frame. The anchors, which are the vertices with `known[v] == 1` and not 0,
  /// are already in `points`. Disconnected vertices are not changed, and neither are anchors,
  /// unless the method treats them as noisy. Returns the number of iterations. If it throws because
  /// memory is exhausted, `generations` and everything that later calls depend on are unchanged.
  virtual Index estimate(Frame previous, std::span<Vector3<Real>> points,
                         std::span<const std::uint8_t> known, Generations& generations) = 0;

  /// Updates the memory of the method with a completed frame, including its disconnected vertices.
  /// Called before the next `estimate`.
  virtual void remember(Frame completed) = 0;

  /// Returns what later estimates depend on in addition to frame 0 and the last completed frame.
  [[nodiscard]] virtual Memory memory() const { return {}; }
  /// The number of rows of that memory, which is constant.
  [[nodiscard]] virtual std::size_t memory_rows() const { return 0; }
  [[nodiscard]] virtual std::size_t shape_fit_size() const { return 0; }
  [[nodiscard]] virtual std::size_t shape_rows() const { return 0; }
  /// Whether this method can have produced this memory.
  [[nodiscard]] virtual bool accepts(const Memory& memory) const {
    return memory.rows.size() == memory_rows() && memory.anchor_weight == 0 &&
           memory.pose.empty() && memory.shapes.empty() && memory.errors.rows.empty();
  }
  /// Restores the memory after `reset`. `completed` is the last completed frame.
  virtual void recall(const Memory& /*memory*/, Frame /*completed*/) {}

  /// (k,) the standard errors of the last estimate, or empty if they are not computed.
  [[nodiscard]] virtual std::span<const double> standard_error() const { return {}; }

  /// The details of the last `estimate` and `remember`.
  [[nodiscard]] virtual StageReport stages() const { return {}; }
};

}  // namespace dynmesh
