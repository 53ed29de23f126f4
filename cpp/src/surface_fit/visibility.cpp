#include "surface_fit/visibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "surface_fit/view.hpp"

namespace dynmesh {

Visibility find_visibility(std::span<const Triangle> faces, std::span<const Index> component,
                           Field x, Field normals, std::span<const std::uint8_t> is_sheet,
                           Field sensors, double mean_edge, Workers& workers) {
  const std::size_t k = x.size();
  Eigen::AlignedBox3d box;
  for (const Vector3& position : x) box.extend(to_eigen(position));
  const std::vector<Viewpoint> from = drawn_from(sensors, box);
  constexpr std::uint8_t faces_it = 1;
  constexpr std::uint8_t sees_it = 2;
  std::vector<std::vector<std::uint8_t>> views(from.size());
  std::vector<std::vector<double>> pixels(from.size());
  const Index last = component.empty() ? -1 : *std::ranges::max_element(component);
  workers.for_each_in_chunks(
      from.size(),
      [&](std::size_t s) {
        views[s].resize(k);
        const Eigen::Vector3d& sensor = from[s].position;
        const bool is_inside = box.contains(sensor);
        const View* view = nullptr;
        std::vector<View> made;
        if (!is_inside) view = &made.emplace_back(faces, component, x, sensor, box, mean_edge);
        pixels[s].resize(at(last + 1));
        if (view != nullptr) view->count(pixels[s]);
        for (std::size_t v = 0; v < k; ++v) {
          const auto towards = from_eigen(sensor) - x[v];
          if (is_sheet[v] == 0 && !(dot(normals[v], towards) > 0)) continue;
          views[s][v] = faces_it;
          if (view == nullptr || !view->hides(v)) views[s][v] |= sees_it;
        }
      },
      static_cast<Index>(k));
  Visibility found{std::vector<std::uint8_t>(k), {}, {}};
  std::vector<std::uint8_t> is_hidden(k);
  for (std::size_t v = 0; v < k; ++v) {
    std::uint8_t any = 0;
    for (const auto& view : views) any |= view[v];
    is_hidden[v] = any == faces_it ? 1 : 0;
    found.is_seen[v] = (any & sees_it) != 0 ? 1 : 0;
  }
  for (const Triangle& face : faces) {
    const auto hides = [&](Index v) { return is_hidden[at(v)] != 0; };
    found.is_hidden.push_back(std::ranges::all_of(face, hides) ? 1 : 0);
  }
  found.shares.resize(at(last + 1));
  double sum = 0;
  for (const auto& counted : pixels) {
    for (std::size_t c = 0; c < counted.size(); ++c) {
      found.shares[c] += counted[c];
      sum += counted[c];
    }
  }
  for (double& share : found.shares) share = sum > 0 ? share / sum : 0;
  return found;
}

}  // namespace dynmesh
