/// How the surface has turned since the last frame, as far as the anchors tell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
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
struct ComponentRotation {
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

/// How the surface has turned since the last frame.
struct ClusterRotations {
  ClusterRotations(std::size_t n_clusters, std::size_t n_components)
      : of_clusters(n_clusters),
        of_components(n_components),
        first(n_components),
        anchors(n_components),
        is_known(n_components),
        is_seen(n_components) {}

  std::vector<Quaternion> of_clusters;    ///< D
  std::vector<Quaternion> of_components;  ///< D of one of the clusters of each
  // (components,) each:
  std::vector<Quaternion> first;                ///< R, with which its clusters begin
  std::vector<Moments> anchors;                 ///< in both frames
  std::vector<std::uint8_t> is_known, is_seen;  ///< whether R is known, and whether any anchor is
  Index farthest = 0;     ///< the largest number of steps from a cluster to one with anchors
  bool are_found = true;  ///< false if nothing needed to turn, so that D are not set
};

/// Finds D_c, the rotation of each cluster c from the last completed frame X' to the current one,
/// from the positions x of the anchors alone; docs/method.md, "Rotations before positions".
///
/// A component whose anchors determine a rotation begins with that of all its anchors, R. Others
/// begin with the rotation of what leads them, which is near them there. Then D_c = exp(omega_c) R,
/// where omega is found by steps of Gauss and Newton (11) towards the minimum of (9). Where a
/// motion is rigid, q = R p and omega = 0. A cluster only needs the sums of p p^T and q p^T, so
/// that each anchor is read once a frame.
///
/// Allocates memory only in the constructor.
class AnchorRotations {
 public:
  /// `model`, `leaders` and `workers` must outlive this object. `noise` is the standard deviation
  /// of a coordinate of an anchor, 0 if they are exact.
  AnchorRotations(const ShapeModel& model, double noise, Leaders& leaders, Workers& workers);

  /// `previous` is X', and `observed` (k,) holds the positions of the anchors. `departures` are
  /// those of the leaders.
  Lent<ClusterRotations> find(Field previous, Field observed, const Generations& generations,
                              std::span<const double> departures);
  /// The rotations of a frame in which nothing needs to turn, since all is known, or nothing.
  Lent<ClusterRotations> at_rest(bool is_known);

  /// (components,) how each component has turned compared with what leads it.
  Lent<std::vector<ComponentRotation>> turns(const ClusterRotations& of,
                                             std::span<const double> departures);

 private:
  /// The anchors of each cluster, in both frames, (clusters,) each.
  struct ClusterAnchors {
    explicit ClusterAnchors(std::size_t n) : are_any(n), are_none(n), moments(n) {}

    std::vector<std::uint8_t> are_any, are_none;
    std::vector<Moments> moments;
  };
  /// H omega = s.
  struct Equation {
    Eigen::Matrix3d h;
    Eigen::Matrix3d inverse;  // of H and the couplings of this cluster alone
    Vector3 s;
  };

  Lent<ClusterAnchors> anchors_of(Field previous, Field observed, const Generations& generations);
  Lent<std::vector<Arms>> arms_of(const ClusterAnchors& anchors,
                                  std::span<const ClusterPair> pairs);
  void begin(ClusterRotations& found) const;
  void turn_clusters(std::span<const Arms> arms, std::span<Vector3> omega, ClusterRotations& found);
  void follow_leaders(Field previous, std::span<const double> departures,
                      std::span<const Arms> arms, std::span<Vector3> omega,
                      ClusterRotations& found);
  void predict(Field previous, const ClusterRotations& found, std::span<Vector3> predicted) const;
  template <class ForEach>
  [[nodiscard]] Quaternion mean_rotation(const ClusterRotations& of, const ForEach& for_each) const;
  Lent<std::vector<Equation>> equations_of(std::span<const Arms> arms, Field omega,
                                           const ClusterRotations& found);
  double take_step(std::span<const Equation> equations, std::span<Vector3> omega,
                   ClusterRotations& found);

  const Topology& topology_;
  const Clusters& clusters_;
  Workers& workers_;
  double mean_edge_;
  double squared_noise_;             // of an anchor
  std::vector<Index> component_of_;  // (clusters,)
  Cells clusters_of_;                // of the components
  Leaders& leaders_;
  ClusterGraph graph_;
  SparseMatrix couplings_;  // beta L, plus what holds where nothing else does
  MaskedFactor factor_;     // of these, of the clusters without anchors

  Lender<ClusterRotations> rotations_;
  Lender<std::vector<ComponentRotation>> turns_;
  Lender<ClusterAnchors> anchors_;
  Lender<std::vector<Arms>> arms_;
  Lender<std::vector<Equation>> equations_;
  FieldLender of_clusters_, of_vertices_;
};

}  // namespace dynmesh
