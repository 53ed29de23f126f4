/// The seam between the completer and its methods.
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

/// One way to estimate the satellites of a frame. Frames have one Vector3 per vertex.
template <class Real>
class Estimator {
 public:
  using Frame = std::span<const Vector3<Real>>;
  /// Of a vertex: of detail the rotation, as a quaternion w x y z, and how the shape has been
  /// changing.
  using Row = std::array<double, 7>;
  /// What a method keeps beside frames; detail alone does.
  struct Memory {
    std::vector<Row> rows;  ///< one for each vertex, or none
    double anchor_weight = 0;
  };

  Estimator() = default;
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;
  Estimator(Estimator&&) = delete;
  Estimator& operator=(Estimator&&) = delete;
  virtual ~Estimator() = default;

  /// Begins a sequence whose frame 0 is `first_frame`. Where it throws, all is as it was.
  virtual void reset(Frame first_frame) = 0;

  /// Classifies the vertices and fills in the satellites of `points`, where the anchors, those with
  /// `known[v] == 1` and not 0, already stand, from them and from the previous completed frame.
  /// Unseen vertices are left alone; anchors too, unless the method takes them to be noisy. Returns
  /// the number of iterations. Where it throws, for lack of memory, `generations` and all that
  /// later calls depend on are as they were.
  virtual Index estimate(Frame previous, std::span<Vector3<Real>> points,
                         std::span<const std::uint8_t> known, Generations& generations) = 0;

  /// Takes note of a completed frame, unseen vertices and all, before the next `estimate`.
  virtual void remember(Frame completed) = 0;

  /// What later estimates depend on beside frame 0 and the last completed frame, to be stored.
  [[nodiscard]] virtual Memory memory() const { return {}; }
  /// How many rows that memory has, at all times.
  [[nodiscard]] virtual std::size_t memory_rows() const { return 0; }
  /// Whether such an estimator can have had this memory.
  [[nodiscard]] virtual bool accepts(const Memory& memory) const {
    return memory.rows.size() == memory_rows() && memory.anchor_weight == 0;
  }
  /// Takes it up again after `reset`; `completed` is the last completed frame.
  virtual void recall(const Memory& /*memory*/, Frame /*completed*/) {}

  /// Of the last `estimate` and `remember`.
  [[nodiscard]] virtual StageReport stages() const { return {}; }
};

}  // namespace dynmesh
