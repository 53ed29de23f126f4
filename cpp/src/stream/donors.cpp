#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "stream/disconnected.hpp"
#include "support/geometry.hpp"
#include "support/quiet_nanoflann.hpp"

namespace dynmesh {
namespace {

/// Some vertices, as nanoflann reads them.
struct Cloud {
  std::span<const Vector3<double>> frame;
  std::vector<Index> vertices;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return vertices.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return (&frame[vertices[i]].x)[axis];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud,
                                                 3, Index>;

/// The nearest vertex of several searches. A search ends where there is no nearer one.
struct Nearest {
  const std::vector<Index>* vertices = nullptr;
  Index found = -1;
  double squared_distance = std::numeric_limits<double>::infinity();

  [[nodiscard]] std::size_t size() const { return found < 0 ? 0 : 1; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] double worstDist() const { return squared_distance; }
  bool addPoint(double distance, Index i) {
    if (!(distance < squared_distance)) return true;
    squared_distance = distance;
    found = (*vertices)[i];
    return distance > 0;
  }
};

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

/// Two components differ in a bit of their numbers. So the nearest vertex of another component is
/// the nearest one over all bits of those whose component has the other value of the bit, which
/// takes two trees for each bit. In one tree of all vertices, a search from inside a large
/// component would visit all of that component first.
std::vector<Nearest> nearest_of_others(const std::vector<Vector3<double>>& positions,
                                       std::span<const Index> component) {
  std::vector<Nearest> nearest(positions.size());
  const auto last = static_cast<std::uint32_t>(component.empty() ? 0 : std::ranges::max(component));
  for (std::uint32_t bit = 0; last >> bit > 0; ++bit) {
    Cloud sides[2] = {{positions, {}}, {positions, {}}};
    for (std::size_t v = 0; v < positions.size(); ++v) {
      sides[component[v] >> bit & 1].vertices.push_back(static_cast<Index>(v));
    }
    for (int side = 0; side < 2; ++side) {
      std::vector<Index> searching = sides[1 - side].vertices;
      std::erase_if(searching, [&](Index v) { return nearest[v].squared_distance == 0; });
      if (sides[side].vertices.empty() || searching.empty()) continue;
      const Tree tree(3, sides[side]);
      for (const Index v : searching) {
        nearest[v].vertices = &sides[side].vertices;
        tree.findNeighbors(nearest[v], &positions[v].x, {});
      }
    }
  }
  return nearest;
}

}  // namespace

template <class Real>
std::vector<Index> find_donors(std::span<const Vector3<Real>> frame,
                               std::span<const Index> component) {
  std::vector<Index> donors;
  for (const auto& nearest : nearest_of_others(scaled(frame), component)) {
    donors.push_back(nearest.found);
  }
  return donors;
}

template std::vector<Index> find_donors(std::span<const Vector3<float>>, std::span<const Index>);
template std::vector<Index> find_donors(std::span<const Vector3<double>>, std::span<const Index>);

}  // namespace dynmesh
