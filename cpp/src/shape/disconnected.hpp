/// Completes the vertices that are not connected to any anchor.
#pragma once

#include <cstdint>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/rigid_motion.hpp"
#include "frame/generations.hpp"
#include "kernels/rotation_kernels.hpp"
#include "mesh/leaders.hpp"
#include "shape/memory.hpp"

namespace dynmesh {

/// Moves the components of a frame that contain no anchor. Allocates memory only in the
/// constructor.
class Disconnected {
 public:
  /// `leaders` must outlive this object. A component may lead others if it contains
  /// at least so many anchors.
  Disconnected(const Topology& topology, DisconnectedRule rule, Leaders& leaders,
               Index fewest_anchors);

  /// Estimates the disconnected vertices of `next.last`, in which the anchors and satellites are
  /// already complete.
  ///
  /// Under `follow`, a component moves with the rigid motion, from the previous to the current
  /// frame, of the vertices of its leaders that are near it. If these are near a line, compared
  /// with its distance from them, it is turned by its own rotation, and shifted as they are on
  /// average. If nothing leads it, it moves with the rigid motion of all anchors, or their mean
  /// translation if these are fewer than three or on a line, and without any anchor it stays.
  /// Nothing is done if no vertex is disconnected.
  ///
  /// (components,) `rotations` are those of the components from the previous frame. Without any,
  /// only vertices on a line do not turn what they lead.
  void complete(const Memory& memory, Memory& next, std::span<const Quaternion> rotations = {});

  /// Remembers which components the completed frame shows together or apart.
  void remember(const Memory& memory, Memory& next);

 private:
  /// The anchors of a frame, by components.
  struct Seen {
    explicit Seen(std::size_t n_components) : has_anchors(n_components), may_lead(n_components) {}

    std::vector<std::uint8_t> has_anchors, may_lead;  // (components,)
    std::vector<Index> anchors;                       // of all components
  };

  Lent<Seen> seen_in(const Generations& generations);
  [[nodiscard]] RigidMotion motion_of(const Leaders::Lead& lead, const Leaders::Leads& leads,
                                      Field previous, Field points,
                                      std::span<const Quaternion> rotations) const;

  DisconnectedRule rule_;
  Leaders& leaders_;
  Index fewest_anchors_;
  Cells members_;  // of the components
  Lender<Seen> seen_;
};

}  // namespace dynmesh
