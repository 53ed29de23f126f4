/// Views of scans and depth images.
#pragma once

#include <algorithm>
#include <dynmesh/tracker.hpp>
#include <optional>
#include <tuple>
#include <vector>

#include "arrays.hpp"

namespace dynmesh {

template <class Real>
Scan<Real> scan_of(const Exact<Real>& points, const std::optional<Exact<Real>>& normals,
                   const std::optional<Exact<Real>>& viewpoints) {
  Scan<Real> scan = {view(points)};
  if (normals) scan.normals = view(*normals);
  if (viewpoints) scan.viewpoints = view(*viewpoints);
  return scan;
}

/// Of each camera: depths (h, w), intrinsics (3, 3) and pose (4, 4).
using Images = std::vector<std::tuple<Exact<float>, Exact<double>, Exact<double>>>;

inline std::vector<DepthImage> view(const Images& images) {
  std::vector<DepthImage> views;
  for (const auto& [depth, intrinsics, pose] : images) {
    DepthImage& image = views.emplace_back();
    image.data = depth.data();
    image.height = static_cast<std::size_t>(depth.shape(0));
    image.width = static_cast<std::size_t>(depth.shape(1));
    image.row_stride = depth.shape(1);
    std::copy_n(intrinsics.data(), image.intrinsics.size(), image.intrinsics.begin());
    std::copy_n(pose.data(), image.pose.size(), image.pose.begin());
  }
  return views;
}

}  // namespace dynmesh
