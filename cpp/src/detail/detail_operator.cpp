#include "detail/detail_operator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

struct Entry {
  Index row;
  Index column;
  double value;
};

void add_edge(std::vector<Entry>& entries, Index a, Index b, double weight) {
  if (a == b) return;
  entries.push_back({a, a, weight});
  entries.push_back({b, b, weight});
  entries.push_back({a, b, -weight});
  entries.push_back({b, a, -weight});
}

/// Sums the entries into rows.
void assemble(std::vector<Entry>& entries, DetailOperator& target) {
  // A stable sort sums both halves of a symmetric matrix in the same order.
  std::ranges::stable_sort(entries, {},
                           [](const Entry& entry) { return std::pair(entry.row, entry.column); });
  target.offsets.assign(target.size() + 1, 0);
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const Entry& entry = entries[e];
    if (e == 0 || entries[e - 1].row != entry.row || entries[e - 1].column != entry.column) {
      target.columns.push_back(entry.column);
      target.values.push_back(0);
      ++target.offsets[static_cast<std::size_t>(entry.row) + 1];
    }
    target.values.back() += entry.value;
  }
  std::partial_sum(target.offsets.begin(), target.offsets.end(), target.offsets.begin());
}

/// Refuses a mesh in which a vertex has too many neighbours. The normal matrix couples all
/// neighbours of a vertex with each other, so its memory grows with the square of their number.
void check_size(const DetailOperator& k) {
  const double most = std::min(2'147'483'647.0, 6e7 + 1e3 * static_cast<double>(k.size()));
  double entries = 0;
  Index widest = 0;
  const auto width = [&](Index v) {
    const auto i = static_cast<std::size_t>(v);
    return k.offsets[i + 1] - k.offsets[i];
  };
  for (Index v = 0; v < static_cast<Index>(k.size()); ++v) {
    entries += static_cast<double>(width(v)) * width(v);
    if (width(v) > width(widest)) widest = v;
  }
  if (entries <= most) return;
  throw std::invalid_argument("faces: vertex " + std::to_string(widest) + " has " +
                              std::to_string(width(widest) - 1) +
                              " neighbours, too many for method detail");
}

}  // namespace

DetailOperator build_detail_operator(std::span<const Triangle> faces, const Cells& cells,
                                     std::span<const Vector3<double>> frame,
                                     const DetailConstants& constants) {
  DetailOperator result;
  auto& areas = result.scale;
  areas.assign(frame.size(), 0);
  std::vector<Entry> entries;
  const auto h = static_cast<double>(mean_edge_length(cells, frame));
  for (const IntrinsicTriangle& triangle : intrinsic_delaunay(faces, frame, h)) {
    for (std::size_t side = 0; side < 3; ++side) {
      const Index a = triangle.vertices[side];
      add_edge(entries, a, triangle.vertices[(side + 1) % 3], triangle.cotangent(side) / 2);
      areas[static_cast<std::size_t>(a)] += triangle.area() / 3;
    }
  }
  for (const auto& [a, b, c] : faces) {
    if (a != b && b != c && c != a) continue;
    const Index other = a == b ? c : b;
    add_edge(entries, a, other, constants.bare_edge_weight);
  }
  assemble(entries, result);

  const double mean =
      std::accumulate(areas.begin(), areas.end(), 0.0) / static_cast<double>(areas.size());
  const double floor = mean > 0 ? constants.least_area * mean : 1;
  for (double& area : areas) area = 1 / std::sqrt(std::max(area, floor));
  return result;
}

void apply_operator(const DetailOperator& k, std::span<const Vector3<double>> x, int fields,
                    std::span<Vector3<double>> products, Workers& workers) {
  const OperatorData data = data_of(k);
  workers.for_each_short_chunk(static_cast<Index>(k.size()), [&](Index first, Index last) {
    best_kernels().products.apply(data, x.data(), fields, products.data(), first, last);
  });
}

SymmetricMatrix normal_matrix(const DetailOperator& k, std::span<const double> membrane) {
  check_size(k);
  SymmetricMatrix normal;
  normal.offsets.push_back(0);
  std::vector<double> sums(k.size(), 0);
  std::vector<std::uint8_t> is_set(k.size(), 0);
  std::vector<Index> rows;
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  for (std::size_t j = 0; j < k.size(); ++j) {
    rows.clear();
    for (Index e = k.offsets[j]; e < k.offsets[j + 1]; ++e) {
      const std::size_t l = at(k.columns[at(e)]);
      const double weight = k.values[at(e)] * k.scale[l] * k.scale[l];
      for (Index f = k.offsets[l]; f < k.offsets[l + 1]; ++f) {
        const Index i = k.columns[at(f)];
        if (is_set[at(i)] == 0) rows.push_back(i);
        is_set[at(i)] = 1;
        sums[at(i)] += weight * k.values[at(f)];
      }
      if (!membrane.empty()) sums[l] += membrane[l] * k.values[at(e)];
    }
    std::sort(rows.begin(), rows.end());
    for (const Index i : rows) {
      normal.rows.push_back(i);
      normal.values.push_back(sums[at(i)]);
      sums[at(i)] = 0;
      is_set[at(i)] = 0;
    }
    normal.offsets.push_back(static_cast<Index>(normal.rows.size()));
  }
  return normal;
}

}  // namespace dynmesh
