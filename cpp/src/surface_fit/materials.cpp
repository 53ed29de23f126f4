#include "surface_fit/materials.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/symmetric_eigen.hpp"

namespace dynmesh {
namespace {

/// A piece of a component, with the plane in which it lies.
struct Piece {
  Vector3 middle, normal;
  double n_vertices = 0;
  std::vector<std::size_t> neighbours;  ///< in the list of pieces
};

/// The clusters of each component as pieces.
std::vector<std::vector<Piece>> pieces_of(const Topology& topology, const Clusters& clusters,
                                          Field x, Field normals) {
  std::vector<std::vector<Piece>> pieces(topology.report.components);
  std::vector<std::size_t> place(clusters.size());
  const auto component_of = [&](std::size_t c) {
    return topology.component[static_cast<std::size_t>(clusters.centres[c])];
  };
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    Piece piece;
    for (const Index v : clusters.members[c]) {
      piece.middle = piece.middle + x[static_cast<std::size_t>(v)];
      piece.normal = piece.normal + normals[static_cast<std::size_t>(v)];
      piece.n_vertices += 1;
    }
    piece.middle = (1 / piece.n_vertices) * piece.middle;
    auto& of = pieces[component_of(c)];
    place[c] = of.size();
    of.push_back(piece);
  }
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    for (const Index other : clusters.neighbours[c]) {
      auto& neighbours = pieces[component_of(c)][place[c]].neighbours;
      neighbours.push_back(place[static_cast<std::size_t>(other)]);
    }
  }
  return pieces;
}

/// Averages the normals over a share of the extent: wrinkles do not hold a sheet.
void smooth_normals(std::vector<Piece>& pieces, double extent, double share) {
  double spacing = 0;
  double n = 0;
  for (const Piece& piece : pieces) {
    for (const std::size_t other : piece.neighbours) {
      spacing += std::sqrt(squared_norm(pieces[other].middle - piece.middle));
      n += 1;
    }
  }
  if (!(spacing > 0)) return;
  const auto times = static_cast<int>(std::round(std::pow(share * extent * n / spacing, 2)));
  for (int i = 0; i < times; ++i) {
    std::vector<Vector3> averages;
    for (const Piece& piece : pieces) {
      Vector3 sum;
      for (const std::size_t other : piece.neighbours) sum = sum + pieces[other].normal;
      const double weight =
          0.5 / static_cast<double>(std::max<std::size_t>(piece.neighbours.size(), 1));
      averages.push_back(0.5 * piece.normal + weight * sum);
    }
    for (std::size_t p = 0; p < pieces.size(); ++p) pieces[p].normal = averages[p];
  }
}

/// The mean square of how far the planes of pieces move in the rigid motion that they notice least,
/// where it moves the vertices by 1.
double slippage(std::vector<Piece> pieces, double smoothed_share) {
  double n = 0;
  Vector3 centre;
  for (const Piece& piece : pieces) {
    n += piece.n_vertices;
    centre = centre + piece.n_vertices * piece.middle;
  }
  centre = (1 / n) * centre;
  double square = 0;
  for (const Piece& piece : pieces) {
    square += piece.n_vertices / n * squared_norm(piece.middle - centre);
  }
  if (!(square > 0) || !std::isfinite(square)) return 1;
  const double extent = std::sqrt(square);
  smooth_normals(pieces, extent, smoothed_share);
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  for (const Piece& piece : pieces) {
    const double length = std::sqrt(squared_norm(piece.normal));
    const auto normal = (length > 0 ? 1 / length : 0) * piece.normal;
    const auto turn = cross((1 / extent) * (piece.middle - centre), normal);
    const Eigen::Vector<double, 6> row(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z);
    sum += piece.n_vertices / n * row * row.transpose();
  }
  std::array<double, 6> values{};
  symmetric_eigen({sum.data(), 36}, values);
  return values[0];
}

}  // namespace

std::vector<std::uint8_t> find_sheets(std::span<const Triangle> faces,
                                      std::span<const Index> component) {
  std::vector<double> n_boundary(component.size()), n_vertices(component.size());  // by component
  const auto next = next_sides(faces);
  for (std::size_t side = 0; side < next.size(); ++side) {
    if (next[side] == side) n_boundary[component[faces[side / 3][(side + 1) % 3]]] += 1;
  }
  for (const Index of : component) n_vertices[of] += 1;
  std::vector<std::uint8_t> is_sheet;
  for (const Index of : component) {
    is_sheet.push_back(n_boundary[of] * n_boundary[of] >= n_vertices[of] ? 1 : 0);
  }
  return is_sheet;
}

std::vector<Material> find_materials(std::span<const Triangle> faces, const Topology& topology,
                                     const Clusters& clusters, Field first_frame,
                                     const TrackingConstants& constants) {
  const auto is_sheet = find_sheets(faces, topology.component);
  auto pieces = pieces_of(topology, clusters, first_frame, vertex_normals(faces, first_frame));
  std::vector<Material> materials(pieces.size(),
                                  {false, false, constants.pull, constants.membrane, 1});
  for (std::size_t v = 0; v < first_frame.size(); ++v) {
    materials[topology.component[v]].is_sheet = is_sheet[v] != 0;
  }
  for (std::size_t of = 0; of < pieces.size(); ++of) {
    if (materials[of].is_sheet &&
        slippage(std::move(pieces[of]), constants.smoothed_share) < constants.largest_slippage) {
      materials[of] = {true, true, constants.cloth_pull, constants.cloth_membrane,
                       constants.cloth_weights};
    }
  }
  return materials;
}

}  // namespace dynmesh
