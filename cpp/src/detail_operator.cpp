#include "detail_operator.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry.hpp"

namespace dynmesh {
namespace {

constexpr double least_cotangent = 0.05;
constexpr double largest_cotangent = 1000;
constexpr double least_area = 0.2;  // of a vertex, in mean vertex areas

Vector3<double> cross(const Vector3<double>& a, const Vector3<double>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

double dot(const Vector3<double>& a, const Vector3<double>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Sums edge weights into the rows of C, whose pattern is that of the cells and the diagonal.
class Assembly {
 public:
  explicit Assembly(const Cells& cells) {
    operator_.offsets.push_back(0);
    for (std::size_t v = 0; v < cells.size(); ++v) {
      const auto vertex = static_cast<Index>(v);
      const auto cell = cells[vertex];
      const auto middle = std::lower_bound(cell.begin(), cell.end(), vertex);
      auto& columns = operator_.columns;
      columns.insert(columns.end(), cell.begin(), middle);
      columns.push_back(vertex);
      columns.insert(columns.end(), middle, cell.end());
      operator_.offsets.push_back(static_cast<Index>(columns.size()));
    }
    operator_.values.assign(operator_.columns.size(), 0);
    operator_.scale.assign(cells.size(), 0);
  }

  void add_edge(Index a, Index b, double weight) {
    entry(a, a) += weight;
    entry(b, b) += weight;
    entry(a, b) -= weight;
    entry(b, a) -= weight;
  }
  void add_area(Index vertex, double area) {
    operator_.scale[static_cast<std::size_t>(vertex)] += area;
  }

  DetailOperator finish() {
    auto& scale = operator_.scale;
    const double mean =
        std::accumulate(scale.begin(), scale.end(), 0.0) / static_cast<double>(scale.size());
    const double floor = mean > 0 ? least_area * mean : 1;
    for (double& area : scale) area = 1 / std::sqrt(std::max(area, floor));
    return std::move(operator_);
  }

 private:
  double& entry(Index row, Index column) {
    const auto i = static_cast<std::size_t>(row);
    const auto first = operator_.columns.begin() + operator_.offsets[i];
    const auto last = operator_.columns.begin() + operator_.offsets[i + 1];
    const auto found = std::lower_bound(first, last, column);
    return operator_.values[static_cast<std::size_t>(found - operator_.columns.begin())];
  }

  DetailOperator operator_;
};

}  // namespace

template <class Real>
DetailOperator build_detail_operator(std::span<const Triangle> faces, const Cells& cells,
                                     std::span<const Vector3<Real>> frame) {
  const auto h = static_cast<double>(mean_edge_length(cells, frame));
  const auto edge = [&](Index from, Index to) -> Vector3<double> {
    const auto& a = frame[static_cast<std::size_t>(from)];
    const auto& b = frame[static_cast<std::size_t>(to)];
    return {static_cast<double>(b.x) / h - static_cast<double>(a.x) / h,
            static_cast<double>(b.y) / h - static_cast<double>(a.y) / h,
            static_cast<double>(b.z) / h - static_cast<double>(a.z) / h};
  };
  Assembly assembly(cells);
  for (const Triangle& face : faces) {
    const bool is_triangle = face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Index a = face[corner];
      const Index b = face[(corner + 1) % 3];
      const Index c = face[(corner + 2) % 3];
      if (!is_triangle) {
        if (a != b) assembly.add_edge(a, b, least_cotangent / 2);
        continue;
      }
      const Vector3<double> to_b = edge(a, b);
      const Vector3<double> to_c = edge(a, c);
      const double doubled_area = std::sqrt(squared_norm(cross(to_b, to_c)));
      const double cotangent = dot(to_b, to_c) / std::max(doubled_area, squared_length_floor);
      assembly.add_edge(b, c, std::clamp(cotangent, least_cotangent, largest_cotangent) / 2);
      assembly.add_area(a, doubled_area / 6);
    }
  }
  return assembly.finish();
}

template DetailOperator build_detail_operator(std::span<const Triangle>, const Cells&,
                                              std::span<const Vector3<float>>);
template DetailOperator build_detail_operator(std::span<const Triangle>, const Cells&,
                                              std::span<const Vector3<double>>);

}  // namespace dynmesh
