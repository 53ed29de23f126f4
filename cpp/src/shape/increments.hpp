/// How the surface has turned since the last frame, as far as the anchors tell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/rigid_motion.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "kernels/kernels.hpp"
#include "linear/masked_factor.hpp"
#include "mesh/leaders.hpp"
#include "shape/cluster_pairs.hpp"
#include "shape/model.hpp"

namespace dynmesh {

/// What the anchors of a component tell of its rotation since the last frame.
struct Turn {
  /// The number of axes about which they tell it: 3, or 2 if they are near a line, or 0 if there is
  /// none but one.
  int axes = 0;
  Eigen::Vector3d line = Eigen::Vector3d::Zero();    ///< along them, of unit length, for 2 axes
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< their mean position
  Quaternion rotation{1, 0, 0, 0};                   ///< D
  /// The squared angle by which they tell that it turned otherwise than what leads it, and about
  /// how many axes; none if nothing leads it.
  double squared_angle = 0;
  int compared_axes = 0;
};

/// Finds D_c, the rotation of each cluster c from the last completed frame X' to the current one,
/// from the positions x of the anchors alone; see docs/method.md, "Rotations before positions".
///
/// A component whose anchors determine a rotation begins with that of all its anchors, R. Others
/// begin with the rotation of what leads them, which is near them there. Then D_c = exp(omega_c) R,
/// where omega is found by steps of Gauss and Newton towards the minimum of
///
///     sum w |q - D_c p|^2 + sum w / 2 (|q - D_c p|^2 + |q - D_d p|^2)
///         + beta sum |omega_c - omega_d|^2.
///
/// The first sum is over the anchors, with p and q the arm from the mean position of the anchors of
/// a cluster to an anchor, in X' and in x. The second one is over the pairs (c, d) of clusters with
/// anchors that are beside each other, with p and q the way from one mean position to the other.
/// The third one is over clusters that an edge connects. Where a motion is rigid, q = R p and
/// omega = 0. A cluster only needs the sums of p p^T and q p^T, so that each anchor is read once a
/// frame.
///
/// Allocates memory only in the constructor.
class Increments {
 public:
  /// `model`, `leaders` and `workers` must outlive this object. `noise` is the standard deviation
  /// of a coordinate of an anchor, 0 if they are exact.
  Increments(const ShapeModel& model, double noise, Leaders& leaders, Workers& workers);

  /// Returns D (clusters,), valid until the next call. `previous` is X', and `observed` (k,) holds
  /// the positions of the anchors. `departures` are those of the leaders.
  std::span<const Quaternion> find(Field previous, Field observed, const Generations& generations,
                                   std::span<const double> departures);

  /// The largest number of steps from a cluster to the nearest one with anchors, in the last call.
  [[nodiscard]] Index farthest() const { return cluster_pairs_.farthest(); }

  /// (components,) how each component has turned as a whole: D of one of its clusters.
  [[nodiscard]] std::span<const Quaternion> of_components() const { return of_components_; }

  /// (components,) how each component has turned compared with what leads it, in the last frame
  /// that was found. Valid until the next call.
  std::span<const Turn> turns(std::span<const double> departures);

 private:
  /// R of a component.
  struct First {
    Quaternion rotation{};
    bool is_known = false;
  };
  /// H omega = s.
  struct Equation {
    Eigen::Matrix3d h;
    Eigen::Matrix3d inverse;  // of H and the couplings of this cluster alone
    Vector3 s;
  };

  [[nodiscard]] double nearness(const ClusterPair& pair) const;
  void find_pairs(const Generations& generations);
  void find_moments(Field previous, Field observed);
  void find_arms();
  void find_first();
  void turn_clusters();
  void follow(Field previous, std::span<const double> departures);
  Field predicted(Field previous);
  [[nodiscard]] Quaternion rotation_around(const Leaders::Lead& lead) const;
  void add_rotation(Index v, double weight, Quaternion& sum) const;
  [[nodiscard]] Quaternion rotation_at(const Leaders::Lead& lead) const;
  [[nodiscard]] static First first_of(const Moments& moments, double least_across);
  void find_equations();
  double take_step();

  const Topology& topology_;
  const Clusters& clusters_;
  Workers& workers_;
  double mean_edge_;
  double squared_noise_;             // of an anchor
  std::vector<Index> component_of_;  // (clusters,)
  Cells clusters_of_;                // of the components
  Leaders& leaders_;
  SparseMatrix couplings_;  // beta L, plus what holds where nothing else does
  MaskedFactor factor_;     // of these, of the clusters without anchors

  // Of one mask:
  std::vector<Index> generation_;
  std::vector<double> anchors_;  // (clusters,) their number
  ClusterPairs cluster_pairs_;
  std::vector<std::uint8_t> has_anchors_, has_none_;  // (clusters,)
  std::span<const ClusterPair> pairs_;

  // Of one frame:
  std::vector<Moments> moments_;                  // of the anchors of each cluster
  std::vector<Moments> moments_of_components_;    // the sums of these
  std::vector<Arms> arms_;                        // (clusters,) with their weights, and the pairs
  std::vector<First> first_;                      // (components,)
  std::vector<std::uint8_t> is_known_, is_seen_;  // (components,) whether R or anchors are known
  std::vector<Turn> turns_;
  std::vector<Vector3> predicted_;
  std::vector<Equation> equations_;  // (clusters,)
  std::vector<Vector3> omega_, step_, residual_, preconditioned_, direction_, product_;
  std::vector<Quaternion> increments_, of_components_;  // D
};

}  // namespace dynmesh
