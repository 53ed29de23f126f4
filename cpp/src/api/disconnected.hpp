/// Completes the vertices that are not connected to any anchor.
#pragma once

#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "frame/generations.hpp"
#include "kernels/rotation_kernels.hpp"

namespace dynmesh {

/// Moves the components of a frame that contain no anchor. Allocates memory only in the
/// constructor.
class Disconnected {
 public:
  /// For a sequence whose frame 0 is `first_frame`. The donor of each vertex is the vertex of
  /// another component that is nearest to it in that frame. `topology` must outlive this object.
  Disconnected(const Topology& topology, DisconnectedRule rule, Field first_frame);

  /// Estimates the disconnected vertices of `points`, in which the anchors and satellites are
  /// already complete.
  ///
  /// Under `follow`, a component moves with the rigid motion, from the previous to the current
  /// frame, of its distinct donors whose component contains at least four anchors. If there are
  /// fewer than four such donors, it moves with that of all anchors. If there are fewer than three
  /// anchors or all lie on a line, it moves with their mean translation, and without any anchor it
  /// stays. The time is linear in the number of vertices, and nothing is done if no vertex is
  /// disconnected.
  ///
  /// (components,) `rotations` are those of the components from the previous frame, or empty. With
  /// them, donors count if their component contains any anchor, and a component with fewer than
  /// four such donors is turned by its own rotation, and shifted as they are on average.
  void complete(Field previous, std::span<Vector3> points, const Generations& generations,
                std::span<const Quaternion> rotations = {});

 private:
  struct Component {
    std::vector<Index> members;  // its vertices
    std::vector<Index> donors;   // their distinct donors
    Index anchors = 0;           // of the frame
  };

  const Topology& topology_;
  DisconnectedRule rule_;
  std::vector<Component> components_;
  std::vector<Index> chosen_;  // the vertices to which a motion is fitted
};

}  // namespace dynmesh
