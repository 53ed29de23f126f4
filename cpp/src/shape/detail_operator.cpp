#include "shape/detail_operator.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/checks.hpp"
#include "mesh/intrinsic_delaunay.hpp"
#include "shape/constants.hpp"

namespace dynmesh {
namespace {

using Entries = std::vector<Eigen::Triplet<double, Index>>;

std::shared_ptr<const DetailOperator::Rows> rows_of(const Entries& entries, std::size_t k) {
  const auto rows = std::make_shared<DetailOperator::Rows>(k, k);
  rows->setFromTriplets(entries.begin(), entries.end());
  return rows;
}

void add_edge(Entries& entries, Index a, Index b, double weight) {
  if (a == b) return;
  entries.emplace_back(a, a, weight);
  entries.emplace_back(b, b, weight);
  entries.emplace_back(a, b, -weight);
  entries.emplace_back(b, a, -weight);
}

/// Refuses a mesh in which a vertex has too many neighbours. The normal matrix couples all
/// neighbours of a vertex with each other, so its memory grows with the square of their number.
void check_size(const DetailOperator& k) {
  const double most = std::min(2'147'483'647.0, 6e7 + 1e3 * static_cast<double>(k.size()));
  const Index* offsets = k.c->outerIndexPtr();
  const auto width = [&](Index v) { return offsets[v + 1] - offsets[v]; };
  double entries = 0;
  Index widest = 0;
  for (Index v = 0; v < k.c->rows(); ++v) {
    entries += static_cast<double>(width(v)) * width(v);
    if (width(v) > width(widest)) widest = v;
  }
  if (entries <= most) return;
  refuse("faces", "vertex ", widest, " has ", width(widest) - 1,
         " neighbours, too many for method detail");
}

}  // namespace

DetailOperator build_detail_operator(std::span<const Triangle> faces, const Cells& cells,
                                     Field frame) {
  DetailOperator result;
  auto& areas = result.scale;
  areas.assign(frame.size(), 0);
  Entries entries;
  const auto h = mean_edge_length(cells, frame);
  for (const IntrinsicTriangle& triangle : intrinsic_delaunay(faces, frame, h)) {
    for (std::size_t side = 0; side < 3; ++side) {
      const Index a = triangle.vertices[side];
      add_edge(entries, a, triangle.vertices[(side + 1) % 3], triangle.cotangent(side) / 2);
      areas[a] += triangle.area() / 3;
    }
  }
  for (const auto& [a, b, c] : faces) {
    if (a != b && b != c && c != a) continue;
    const Index other = a == b ? c : b;
    add_edge(entries, a, other, detail_constants.bare_edge_weight);
  }
  result.c = rows_of(entries, frame.size());

  const double mean =
      std::accumulate(areas.begin(), areas.end(), 0.0) / static_cast<double>(areas.size());
  const double floor = mean > 0 ? detail_constants.least_area * mean : 1;
  for (double& area : areas) area = 1 / std::sqrt(std::max(area, floor));
  return result;
}

void apply_operator(const DetailOperator& k, Field x, int fields, std::span<Vector3> products,
                    Workers& workers) {
  const OperatorData data = data_of(k);
  workers.for_each_short_chunk(static_cast<Index>(k.size()), [&](Index first, Index last) {
    best_kernels().rotations.multiply(data, x.data(), fields, nullptr, products.data(), first,
                                      last);
  });
}

void multiply_by_c(const DetailOperator& k, Field x, std::span<Vector3> products,
                   Workers& workers) {
  OperatorData c = data_of(k);
  c.scale = nullptr;
  workers.for_each_short_chunk(static_cast<Index>(k.size()), [&](Index first, Index last) {
    best_kernels().rotations.multiply(c, x.data(), 1, nullptr, products.data(), first, last);
  });
}

DetailOperator smoother_of(const Cells& cells) {
  Entries entries;
  for (Index v = 0; v < std::ssize(cells.offsets) - 1; ++v) {
    const auto cell = cells[v];
    entries.emplace_back(v, v, cell.empty() ? 1 : 0.5);
    for (const Index n : cell) {
      entries.emplace_back(v, n, 0.5 / static_cast<double>(cell.size()));
    }
  }
  return {rows_of(entries, cells.size()), std::vector<double>(cells.size(), 1.0)};
}

void smooth(const DetailOperator& smoother, int fields, int times, std::vector<Vector3>& values,
            std::vector<Vector3>& scratch, Workers& workers) {
  for (int n = 0; n < times; ++n) {
    apply_operator(smoother, values, fields, scratch, workers);
    std::swap(values, scratch);
  }
}

// Matrices are assigned, not constructed: if memory runs out, the constructors of Eigen that
// compute a matrix leak.
SparseMatrix normal_matrix(const DetailOperator& k, std::span<const double> membrane) {
  check_size(k);
  const Eigen::Map<const Eigen::VectorXd> scale(k.scale.data(), k.c->rows());
  SparseMatrix c, scaled, normal;
  c = *k.c;
  scaled = scale.asDiagonal() * c;
  scaled = scale.asDiagonal() * scaled;
  normal = c * scaled;
  if (membrane.empty()) return normal;
  scaled = Eigen::Map<const Eigen::VectorXd>(membrane.data(), k.c->rows()).asDiagonal() * c;
  normal += scaled;
  return normal;
}

}  // namespace dynmesh
