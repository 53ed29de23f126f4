/// The estimate of the paper: a satellite moves like the known vertices of its cell (section 3,
/// "Geometry Completion Based on Topological Characteristics").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "kernels/kernels.hpp"

namespace dynmesh {

/// In iteration t, each satellite of generation t or less receives the mean (4) of the motions in
/// its cell that were known before. Generations follow from where there is such a mean.
///
/// Allocates memory only in the constructor.
class Motion {
 public:
  /// `cells` and `workers` must outlive this object. `first_frame` is frame 0. `extra_iterations`
  /// >= 0 is the number of iterations after the one that reaches the last satellite. Without
  /// `revisit`, a satellite is estimated only once, when it is reached, and extra iterations have
  /// no effect. The result does not depend on the number of threads.
  Motion(const Cells& cells, Field first_frame, Index extra_iterations, bool revisit,
         Workers& workers, const MotionKernels& kernels = best_kernels().motion);

  /// Estimates the satellites of `points` from the anchors, which are the vertices with
  /// `known[v] == 1` and not 0, and from the previous completed frame, and tells the generations.
  /// Returns the number of iterations.
  std::size_t estimate(Field previous, std::span<Vector3> points,
                       std::span<const std::uint8_t> known, Generations& generations);

 private:
  /// The motion d of a vertex, times its weight w / t: that of anchors is always 1. All are 0 where
  /// no motion is known.
  struct alignas(4 * sizeof(double)) WeightedMotion {
    std::array<double, 4> values;  // x, y, z and w / t, in one array so that loops use vectors
  };
  /// Vertices `first` to `last` - 1. The unknown ones among them are listed in `rows_` from `first`
  /// on, and the weights s of their cells in `weights_` from where that of `first` begins.
  struct Chunk {
    Index first;
    Index last;
    Index unknown = 0;
    Index reached = 0;
  };

  void begin(Chunk& chunk, Field previous, Field points, std::span<const std::uint8_t> known,
             std::span<Index> generation);
  [[nodiscard]] MotionRows rows_of(const Chunk& chunk) const {
    return {cells_.offsets.data(), cells_.neighbours.data(), &rows_[chunk.first], chunk.unknown};
  }
  [[nodiscard]] double* weights_of(const Chunk& chunk) {
    return weights_.data() + cells_.offsets[chunk.first];
  }
  /// Calls `work` for each chunk.
  template <class Work>
  void for_each_chunk(const Work& work) {
    workers_.for_each(static_cast<Index>(chunks_.size()), [&](Index c) { work(chunks_[c]); });
  }

  const Cells& cells_;
  Workers& workers_;
  const MotionKernels& kernels_;
  Index extra_iterations_;
  bool revisits_;
  double per_mean_edge_;  // 1 / h
  std::vector<Chunk> chunks_;
  // (k,) the vertices of each chunk by the sizes of their cells, since a processor foresees the end
  // of a loop that has always been as long: a tenth of the time.
  std::vector<Index> order_;
  // Of a frame:
  std::vector<Index> rows_;
  std::vector<double> weights_;
  std::vector<WeightedMotion> moved_;  // (k,)
  std::vector<WeightedMotion> means_;  // (k,) those of the iteration after it
};

}  // namespace dynmesh
