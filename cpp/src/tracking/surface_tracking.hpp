/// Finds a template again in what sensors measured of a frame; docs/reference/tracking.md has the
/// method.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "detail/memory.hpp"
#include "detail/rotations.hpp"
#include "detail/shape_system.hpp"
#include "support/workers.hpp"
#include "tracking/constants.hpp"
#include "tracking/correspondence.hpp"
#include "tracking/surface_fit.hpp"

namespace dynmesh {

class SurfaceTracking {
 public:
  using Field = std::span<const Vector3<double>>;

  SurfaceTracking(std::vector<Triangle> faces, const Topology& topology, Workers& workers,
                  const TrackingConstants& constants = {});

  void reset(Field first_frame);
  Field find(const Measurement& measurement, Field viewpoints);

  TrackingConstants constants_;
 private:
  void correspond(const Measurement& measurement, Field viewpoints, double radius, double scale,
                  double weight);

  std::vector<Triangle> faces_;
  const Topology& topology_;
  Workers& workers_;
  DetailConstants detail_constants_;
  ShapeSystem system_;
  Rotations rotations_;
  SurfaceFit fit_;
  Anchors anchors_;
  double mean_edge_ = 1;
  std::vector<Vector3<double>> first_shape_, shape_, target_, x_, previous_, before_, normals_;
  std::vector<Correspondence> found_;
};

}  // namespace dynmesh
