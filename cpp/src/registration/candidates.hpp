/// Where a registration begins: rigid motions of the template, and landmarks.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "registration/coarse_fit.hpp"
#include "registration/constants.hpp"
#include "registration/tips.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// A rigid motion of the template, landmarks in the axes of the scan, and what became of them on
/// the coarse mesh.
struct Candidate {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  std::vector<TemplateLandmark> landmarks = {};
  double distance = 0;  ///< of the rigid start, if it was sought
  double score = 0;
  std::vector<Vector3<double>> x = {};
};

/// A template in the unit of the scan.
struct TemplateShape {
  std::span<const Triangle> faces;
  std::span<const Vector3<double>> frame;
  double mean_edge;
};

/// The rigid motions that bring the surface to the points; where it is in place already, only that
/// one.
std::vector<Candidate> candidates_by_points(const TemplateShape& shape, const PointScan& scan,
                                            const std::vector<TemplateLandmark>& landmarks,
                                            const RegistrationConstants& constants);

/// The tips of the limbs of a template, and of a scan.
struct TipsOfBoth {
  Tips ours, theirs;
  std::vector<Index> vertices;             ///< of our tips
  std::vector<Vector3<double>> positions;  ///< of their tips
};

/// About `points` of the scan and as many places of the template tell what is connected. Other
/// numbers find other tips, where limbs touch or are thin.
TipsOfBoth tips_of_both(const TemplateShape& shape, const PointScan& scan, std::size_t points,
                        const TipConstants& constants);

/// Landmarks that bring the tips to those of the scan, in the most likely ways, and the motions
/// that these determine.
std::vector<Candidate> candidates_by_tips(const TemplateShape& shape, const TipsOfBoth& tips,
                                          const TipConstants& constants);

/// For a result x, which has left tips of the scan out: landmarks that bring one of the tips of the
/// template to one of the farthest of these, and hold the others where they are in x.
std::vector<Candidate> candidates_by_tips_left_out(const TemplateShape& shape,
                                                   const TipsOfBoth& tips,
                                                   const Eigen::Isometry3d& motion,
                                                   std::span<const Vector3<double>> x,
                                                   const TipConstants& constants);

/// The same, where two of the tips take each other's place, for limbs that were exchanged.
std::vector<Candidate> candidates_by_exchanged_tips(const TemplateShape& shape,
                                                    const TipsOfBoth& tips,
                                                    const Eigen::Isometry3d& motion,
                                                    std::span<const Vector3<double>> x);

}  // namespace dynmesh
