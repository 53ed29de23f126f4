#include "tracking/point_scan.hpp"

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// The nearest point whose normal agrees.
struct NearestAgreeing {
  using DistanceType = double;
  using CountType = std::size_t;

  const std::vector<Vector3<double>>& normals;
  const Vector3<double>& normal;
  double agreement;
  double squared_distance;
  std::uint32_t found = 0;
  bool any = false;

  [[nodiscard]] std::size_t size() const { return any ? 1 : 0; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] double worstDist() const { return squared_distance; }
  bool addPoint(double squared, std::uint32_t index) {
    if (squared < squared_distance && dot(normals[index], normal) >= agreement) {
      squared_distance = squared;
      found = index;
      any = true;
    }
    return true;
  }
};

}  // namespace

PointScan::PointScan() : cloud_{&points} {}

void PointScan::index() {
  tree_ = std::make_unique<Tree>(3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(16));
}

Correspondence PointScan::nearest(const Vector3<double>& position, const Vector3<double>& normal,
                                  double radius, double agreement) const {
  NearestAgreeing result{normals, normal, agreement, radius * radius};
  const double query[3] = {position.x, position.y, position.z};
  tree_->findNeighbors(result, query, nanoflann::SearchParams());
  if (!result.any) return {};
  return {points[result.found], normals[result.found], 1};
}

}  // namespace dynmesh
