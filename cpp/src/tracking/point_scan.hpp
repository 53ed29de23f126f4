/// A scan: loose points of the surface with normals.
#pragma once

#include <cstdint>
#include <dynmesh/types.hpp>
#include <memory>
#include <nanoflann.hpp>
#include <span>
#include <vector>

#include "tracking/correspondence.hpp"

namespace dynmesh {

class PointScan final : public Measurement {
 public:
  PointScan();

  std::vector<Vector3<double>> points;
  std::vector<Vector3<double>> normals;
  std::vector<Vector3<double>> viewpoints;

  void index();

  [[nodiscard]] Correspondence nearest(const Vector3<double>& position,
                                       const Vector3<double>& normal, double radius,
                                       double agreement) const override;

 private:
  struct Cloud {
    const std::vector<Vector3<double>>* points;
    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points->size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t c) const {
      const auto& p = (*points)[i];
      return c == 0 ? p.x : c == 1 ? p.y : p.z;
    }
    template <class Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
  };
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>,
                                                   Cloud, 3, std::uint32_t>;
  Cloud cloud_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace dynmesh
