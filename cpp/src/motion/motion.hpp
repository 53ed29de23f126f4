/// The method of the paper: a satellite moves like the known vertices of its cell (section 3).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "frame/generations.hpp"

namespace dynmesh {

/// In iteration t, each satellite of generation t or less receives the mean (4) of the motions in
/// its cell that were known before. Positions are double, motions and their weights `Real`.
///
/// Allocates memory only in the constructor.
template <class Real>
class Motion {
 public:
  /// `cells` and `workers` must outlive this object. `first_frame` is frame 0. `extra_iterations`
  /// >= 0 is the number of iterations after the one that reaches the last satellite. Without
  /// `revisits`, a satellite is estimated only once, when it is reached, and extra iterations have
  /// no effect. The result does not depend on the number of threads.
  Motion(const Cells& cells, Field first_frame, Index extra_iterations, bool revisits,
         Workers& workers);

  /// Estimates the satellites of `points` from the anchors, which are the vertices with
  /// `known[v] == 1` and not 0, and from the previous completed frame, and tells the generations.
  /// Returns the number of iterations.
  std::size_t estimate(Field previous, std::span<Vector3> points,
                       std::span<const std::uint8_t> known, Generations& generations);

 private:
  /// The motion d of a vertex, times its weight w / t in iteration t, and this weight, which is 1
  /// for anchors. All are 0 where no motion is known.
  using Weighted = Eigen::Array<Real, 4, 1>;

  /// Vertices `first` to `last` - 1. From `first` on, `satellites_` and `unknown_` list those that
  /// were reached and those that were not. `s_` has the weights of the cells of these satellites,
  /// from where that of `first` begins.
  struct Chunk {
    Index first;
    Index last;
    Index reached = 0;  // satellites
    Index before = 0;   // satellites of earlier iterations
    Index unknown = 0;
    Index weighed = 0;  // weights
  };

  void classify(Chunk& chunk, Field previous, Field points, std::span<const std::uint8_t> known,
                std::span<Index> generation);
  void search(Chunk& chunk, Index t, std::span<Index> generation);
  void weigh(Chunk& chunk, Field previous);
  void find_means(const Chunk& chunk, Index t, std::span<const Index> generation);

  const Cells& cells_;
  Workers& workers_;
  Index extra_iterations_;
  bool revisits_;
  double per_mean_edge_;  // 1 / h
  std::vector<Chunk> chunks_;
  std::vector<Index> order_;       // (k,) in which vertices are listed
  std::vector<Index> satellites_;  // of a frame
  std::vector<Index> unknown_;
  std::vector<Real> s_;
  std::vector<Weighted> d_;      // (k,)
  std::vector<Weighted> means_;  // (k,) those of the next iteration
};

}  // namespace dynmesh
