#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "stream/disconnected.hpp"
#include "support/geometry.hpp"
#include "support/point_tree.hpp"

namespace dynmesh {
namespace {

/// In units in which squares of coordinates are in range.
template <class Real>
std::vector<Vector3<double>> scaled(std::span<const Vector3<Real>> frame) {
  double largest = 0;
  for (const auto& x : frame) {
    const auto v = in_double(x);
    largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  }
  const double scale = largest > 0 ? std::exp2(-std::ilogb(largest)) : 1;
  std::vector<Vector3<double>> result;
  for (const auto& x : frame) result.push_back(scale * in_double(x));
  return result;
}

}  // namespace

/// Two components differ in a bit of their numbers. So the nearest vertex of another component is
/// the nearest one over all bits of those whose component has the other value of the bit, which
/// takes two trees for each bit. In one tree of all vertices, a search from inside a large
/// component would visit all of that component first.
template <class Real>
std::vector<Index> find_donors(std::span<const Vector3<Real>> frame,
                               std::span<const Index> component) {
  const auto positions = arrays_of(scaled(frame));
  std::vector<Index> donors(frame.size(), -1);
  std::vector<double> squared_distances(frame.size(), std::numeric_limits<double>::infinity());
  const auto last = static_cast<std::uint32_t>(component.empty() ? 0 : std::ranges::max(component));
  for (std::uint32_t bit = 0; last >> bit > 0; ++bit) {
    std::array<std::vector<Index>, 2> sides;
    for (std::size_t v = 0; v < frame.size(); ++v) {
      sides[component[v] >> bit & 1].push_back(static_cast<Index>(v));
    }
    for (std::size_t side = 0; side < 2; ++side) {
      std::vector<std::array<double, 3>> points;
      for (const Index v : sides[side]) points.push_back(positions[v]);
      const PointTree<3> tree(std::move(points));
      for (const Index v : sides[1 - side]) {
        tree.search(positions[v], squared_distances[v], [&](std::uint32_t i, double squared) {
          donors[v] = sides[side][i];
          return squared_distances[v] = squared;
        });
      }
    }
  }
  return donors;
}

template std::vector<Index> find_donors(std::span<const Vector3<float>>, std::span<const Index>);
template std::vector<Index> find_donors(std::span<const Vector3<double>>, std::span<const Index>);

}  // namespace dynmesh
