/// What method detail measures shape by: K = M^-1/2 C of frame 0, from which it is built once.
#pragma once

#include <array>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

using Triangle = std::array<Index, 3>;

/// C is symmetric, so K^T r = C (M^-1/2 r): one matrix serves both products.
struct DetailOperator {
  // Row i of C is columns[offsets[i]] to columns[offsets[i + 1] - 1], ascending, with its values.
  std::vector<Index> offsets;
  std::vector<Index> columns;
  std::vector<double> values;
  std::vector<double> scale;  ///< (k,) M^-1/2

  [[nodiscard]] std::size_t size() const { return scale.size(); }
};

/// C: the cotangent Laplacian; M: vertex areas, a third of the triangles around, floored at 0.2 of
/// their mean. Lengths are in mean edges of `frame`, so that the scale of the mesh cancels.
///
/// Everything is finite whatever the mesh: cotangents below 0.05 (obtuse angles and right ones)
/// count as 0.05 and beyond 1000 (needles) as 1000, each triangle adds to its own edges however
/// many share them, and an edge that no triangle of three distinct vertices has weighs 0.05.
template <class Real>
DetailOperator build_detail_operator(std::span<const Triangle> faces, const Cells& cells,
                                     std::span<const Vector3<Real>> frame);

}  // namespace dynmesh
