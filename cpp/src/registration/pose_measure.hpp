/// How well a template in some pose fits a scan.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "registration/constants.hpp"
#include "registration/pose.hpp"
#include "registration/targets.hpp"
#include "support/workers.hpp"
#include "tracking/agreement.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

class PoseMeasure {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `frame` is the template, in the unit of the scans. All arguments must outlive this object.
  PoseMeasure(std::span<const Triangle> faces, const Topology& topology, Field frame,
              const Targets& targets, Workers& workers, const RegistrationConstants& constants);

  [[nodiscard]] double mean_edge() const { return mean_edge_; }
  /// The misfit of a surface, before it is drawn into the scan.
  [[nodiscard]] double misfit_of(Field x, const PointScan& scan) const;
  /// Compares the positions of a pose with the scan, and sets what they tell.
  void measure(const PointScan& scan, Pose& pose) const;
  /// Whether the vertex of a landmark is not where the caller says. What no sensor measured follows
  /// the shape alone.
  [[nodiscard]] bool has_misplaced_landmarks(const Pose& pose, const PointScan& scan) const;
  /// Whether two surfaces differ by more than a little, on average.
  [[nodiscard]] bool are_elsewhere(Field a, Field b) const;

 private:
  [[nodiscard]] Agreement agreement_of(const PointScan& scan, Field x, Field normals,
                                       std::span<const std::uint8_t> is_either) const;
  [[nodiscard]] RegistrationQuality quality_of(const Pose& pose, const PointScan& scan) const;

  std::span<const Triangle> faces_;
  const Topology& topology_;
  Field frame_;
  const Targets& targets_;
  const RegistrationConstants& constants_;
  TrackingConstants tracking_;
  Workers& workers_;
  double mean_edge_;
};

}  // namespace dynmesh
