/// Measures and judges how a surface lies in a scan.
#pragma once

#include <dynmesh/quality.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <functional>
#include <span>

#include "mesh/ties.hpp"
#include "quality/evidence.hpp"
#include "shape/memory.hpp"
#include "surface_fit/surface_level.hpp"

namespace dynmesh {

/// How the edges of a frame differ from those of another one. Of large meshes, some are measured.
struct Change {
  double growth = 1;   ///< how many times as long they have become, by their median
  double stretch = 0;  ///< by which share of their length they have changed beside that, on average
};

Change change_of(const Cells& cells, Field before, Field after);

/// Of how the edges around vertices have changed since frame 0, the share that is more than three
/// times as much as if they had changed everywhere in proportion to what they had before. Joints
/// bend farther in what moves fast, and other places in a mesh that slid along a surface.
double bent_elsewhere(const Cells& cells, Field first, Field before, Field after);

/// Of the places where components touch, by the weights of their ties, the share that came apart,
/// or together, by more than three mean edges. 0 without any.
double parted_share(std::span<const Tie> ties, Field before, Field after, double mean_edge);

/// How the points and the edges agree with a surface that was found. Nothing is unexplained, and
/// the quality is not judged.
Measure measured(const FittedSurface& surface, const Evidence& evidence, const Cells& cells,
                 Field first_frame);

/// What is known beside the measure of a frame.
struct Before {
  RecentFrames recent = {};     ///< of a tracker; none in a registration
  bool knows_sensors = true;    ///< otherwise, what should be seen follows from recent frames
  bool was_registered = false;  ///< with a good result: whatever the shape was before
  bool was_misplaced = false;   ///< in the frame before: lost, with points on it
  /// How many times as likely it is that the pose was lost as the changes of edges tell, by how
  /// many times they are what is likely. Asked only if these leave it open; none if empty.
  std::function<double(double leap)> times_likely = {};
};

/// Sets the doubt, the leap and the quality.
Quality judged(Measure& measure, const Before& before = {});

/// The quality that follows from the doubt and the leap.
Quality quality_of(const Measure& measure);

/// Adds a frame that is not lost to those before. Only good ones tell of the shape.
void add_frame(const Measure& measure, RecentFrames& recent);

}  // namespace dynmesh
