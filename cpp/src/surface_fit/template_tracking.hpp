/// Tracks a template, on a coarse mesh first.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "surface_fit/coarse_surface.hpp"
#include "surface_fit/surface_tracking.hpp"

namespace dynmesh {

/// The iterations of a frame run on a coarse mesh of a large template, from which the template
/// follows. Some with all points then follow on the template itself, unless it is tracked live.
/// Holds nothing on which a later frame depends. Frames allocate memory.
class TemplateTracking {
 public:
  /// How a template is tracked.
  struct Settings {
    std::size_t resolution = 0;  ///< the vertices of the coarse mesh, if live; 0: the best result
    bool uncertainty = false;
    double epsilon = 0;  ///< of the type in which positions are given
  };
  using Found = SurfaceTracking::Found;

  /// All references and `first_frame` must outlive this object. `training` is a training sequence,
  /// or empty.
  TemplateTracking(const std::vector<Triangle>& faces, const Topology& topology, Workers& workers,
                   Field first_frame, const TrainingFrames& training, const Settings& settings);

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;
  /// As those of SurfaceTracking.
  Found fit(const Memory& memory, const PointScan& measurement, Memory& next);
  void remember(const Memory& memory, bool moves, bool is_lost, Memory& next);
  void measure_errors(const Memory& memory, bool is_lost, Memory& next) {
    whole_.measure_errors(memory, is_lost, next);
  }
  void place(Field frame, Memory& memory) { whole_.place(frame, memory); }

  [[nodiscard]] double mean_edge() const { return whole_.mean_edge(); }
  [[nodiscard]] const TrackingConstants& constants() const { return whole_.constants(); }

 private:
  struct Coarse {
    Coarse(DecimatedMesh mesh, SurfaceTracking& whole, const TrainingFrames& training,
           double epsilon, Workers& workers);

    CoarseSurface surface;
    SurfaceTracking tracking;
    Memory memory, next;  // of the current frame
    FitMemory first_fit;
    std::vector<double> no_departures;
  };

  SurfaceTracking whole_;
  std::unique_ptr<Coarse> coarse_;  // null if the template itself is small enough
  bool is_live_;
};

}  // namespace dynmesh
