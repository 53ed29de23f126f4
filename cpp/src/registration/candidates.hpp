/// Where a registration begins: rigid motions of the template, and landmarks.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "registration/constants.hpp"
#include "registration/targets.hpp"
#include "registration/tips.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// A rigid motion of the template, and landmarks between which it then bends.
struct Candidate {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  Targets landmarks = {};
};

struct TemplateShape {
  std::span<const Triangle> faces;
  std::span<const Vector3<double>> frame;
  double mean_edge;
};

/// The tips of the limbs of a template, and of a scan.
struct TipsOfBoth {
  Tips ours, theirs;
  std::vector<Index> vertices;             ///< of our tips
  std::vector<Vector3<double>> positions;  ///< of their tips
};

/// About as many points of the scan as places of the template tell what is connected.
TipsOfBoth tips_of_both(const TemplateShape& shape, const PointScan& scan,
                        const TipConstants& constants);

/// Landmarks that bring the tips to those of the scan, in the most likely ways, and the motions
/// that these determine.
std::vector<Candidate> candidates_by_tips(const TemplateShape& shape, const TipsOfBoth& tips,
                                          const TipConstants& constants);

/// For a result x, which has left tips of the scan out: landmarks that bring one of the tips of the
/// template to one of these, and hold the others where they are in x.
std::vector<Candidate> candidates_by_tips_left_out(const TemplateShape& shape,
                                                   const TipsOfBoth& tips,
                                                   const Eigen::Isometry3d& motion,
                                                   std::span<const Vector3<double>> x,
                                                   const TipConstants& constants);

/// The same, where two of the tips take each other's place, for limbs that were exchanged.
std::vector<Candidate> candidates_by_exchanged_tips(const TipsOfBoth& tips,
                                                    const Eigen::Isometry3d& motion,
                                                    std::span<const Vector3<double>> x);

}  // namespace dynmesh
