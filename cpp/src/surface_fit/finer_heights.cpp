#include "surface_fit/finer_heights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/geometry.hpp"

namespace dynmesh {

FinerHeights::FinerHeights(std::span<const Triangle> faces, Field frame, Field normals,
                           double mean_edge, const SurfacePlaces& finer, Field finer_frame,
                           Workers& workers)
    : heights_(faces.size()), faces_(faces.size()) {
  const auto anywhere = [](const Place&) { return true; };
  workers.for_each_in_chunks(faces.size(), [&](std::size_t f) {
    for (std::size_t s = 0; s < 3; ++s) {
      const Index a = faces[f][(s + 1) % 3];
      const Index b = faces[f][(s + 2) % 3];
      const auto middle = 0.5 * (frame[a] + frame[b]);
      const auto sum = normals[a] + normals[b];
      const double length = std::sqrt(squared_norm(sum));
      if (!(length > 0)) continue;
      const auto normal = (1 / length) * sum;
      double height = 0;
      for (int step = 0; step < 3; ++step) {
        const auto point = middle + height * normal;
        const Place place =
            finer.nearest(finer_frame, point, {.squared = mean_edge * mean_edge / 4}, anywhere);
        if (!place.any()) continue;
        height += dot(place.on(finer_frame) - point, normal);
        faces_[f][s] = place.face;
      }
      heights_[f][s] = std::clamp(height, -mean_edge / 2, mean_edge / 2);
    }
  });
}

double FinerHeights::at(const Place& place) const {
  double sum = 0;
  for (std::size_t s = 0; s < 3; ++s) {
    sum += 4 * heights_[place.face][s] * place.shares[(s + 1) % 3] * place.shares[(s + 2) % 3];
  }
  return sum;
}

std::uint32_t FinerHeights::face_near(const Place& place) const {
  const auto side = std::ranges::min_element(place.shares) - place.shares.begin();
  return faces_[place.face][static_cast<std::size_t>(side)];
}

}  // namespace dynmesh
