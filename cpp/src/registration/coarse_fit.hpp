/// Finds large motions of a template on its coarse mesh.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/rotations.hpp"
#include "registration/coarse_mesh.hpp"
#include "registration/constants.hpp"
#include "support/workers.hpp"
#include "tracking/matches.hpp"
#include "tracking/nonrigid_step.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// A position to which a vertex of the template belongs.
struct TemplateLandmark {
  Index vertex = 0;
  Vector3<double> start;  ///< in the template
  Vector3<double> position;
};

/// Bends the coarse mesh in the axes of the template. Everything that is given is in these axes.
class CoarseFit {
 public:
  using Field = std::span<const Vector3<double>>;
  using Cloud = std::vector<Vector3<double>>;

  /// All arguments must outlive this object.
  CoarseFit(const CoarseMesh& mesh, Workers& workers, const RegistrationConstants& constants);

  struct Fitted {
    Cloud x;
    std::vector<Quaternion> rotations;
    /// The share of the points that are far or whose normal is opposed, and the mean stretch.
    double misfit = 0;
  };
  /// First bends the template until its landmarks are at their positions, and then takes passes to
  /// the points of the scan. The number of points matters for the time.
  Fitted fit(const PointScan& scan, std::span<const TemplateLandmark> landmarks, int passes);

 private:
  void bend(std::span<const TemplateLandmark> landmarks, std::span<Vector3<double>> x);
  void draw(const PointScan& scan, std::span<const TemplateLandmark> landmarks, int passes,
            std::span<Vector3<double>> x);
  [[nodiscard]] std::vector<Landmark> targets(std::span<const TemplateLandmark> landmarks,
                                              double weight) const;
  [[nodiscard]] double far_share(const PointScan& scan, Field x) const;

  const CoarseMesh& mesh_;
  Workers& workers_;
  const RegistrationConstants& constants_;
  TrackingConstants tracking_;
  TrackingConstants bending_;
  double mean_edge_;
  std::vector<std::uint8_t> nobody_, everybody_;  // is of cloth
  NonrigidStep shape_;
  NonrigidStep bent_;  // with a membrane, for landmarks
  Matches matches_;
};

}  // namespace dynmesh
