#include "surface_fit/cloth.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

Boundary::Boundary(std::span<const Triangle> faces, const Topology& topology, double mean_edge,
                   std::span<const Material> materials, const TrackingConstants& constants)
    : topology_(topology),
      constants_(constants),
      mean_edge_(mean_edge),
      next_sides_(next_sides(faces)),
      materials_(materials),
      is_boundary_(topology.component.size()) {
  for (std::size_t side = 0; side < next_sides_.size(); ++side) {
    if (next_sides_[side] != side) continue;
    for (const std::size_t end : {side + 1, side + 2}) {
      is_boundary_[faces[side / 3][end % 3]] = 1;
    }
  }
}

/// Whether a place is on the boundary: a vertex or a side of it.
bool Boundary::contains(const Place& place) const {
  if (is_boundary_[place.nearest_corner()] == 0) return false;
  const auto n_zero = std::ranges::count(place.shares, 0.0);
  const auto zero = std::ranges::find(place.shares, 0.0) - place.shares.begin();
  const std::size_t side = 3 * place.face + static_cast<std::size_t>(zero);
  return n_zero == 2 || (n_zero == 1 && next_sides_[side] == side);
}

/// The unit direction in which the surface ends at a vertex of its boundary; 0 where it has none.
Vector3 Boundary::conormal(std::uint32_t vertex, Field x, Field normals) const {
  Vector3 sum;
  for (const Index other : topology_.cells[vertex]) {
    sum = sum + (1 / mean_edge_) * (x[vertex] - x[other]);
  }
  sum = sum - dot(sum, normals[vertex]) * normals[vertex];
  const double length = std::sqrt(squared_norm(sum));
  return length > 0 ? (1 / length) * sum : Vector3{};
}

void Boundary::draw(Field x, Field normals, std::vector<SurfaceRow>& rows) const {
  const std::size_t n = rows.size();
  std::vector<Vector3> conormals(x.size());
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    if (is_boundary_[v] != 0) conormals[v] = conormal(v, x, normals);
  }
  const auto outwards = [&](const SurfaceRow& row) {
    const auto offset = row.point - row.on(x);
    return offset - dot(offset, row.normal) * row.normal;
  };
  // Of the points around a boundary vertex, along its conormal: the outermost place of one that is
  // not far, and how far points lie beyond it.
  std::vector<double> outermost(x.size(), -std::numeric_limits<double>::infinity());
  std::vector<double> beyond(x.size());
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t s = 0; s < 3; ++s) {
      const auto v = rows[r].corners[s];
      if (is_boundary_[v] == 0) continue;
      const double along = dot(conormals[v], rows[r].on(x) - x[v]) / mean_edge_;
      if (rows[r].squared < mean_edge_ * mean_edge_) outermost[v] = std::max(outermost[v], along);
      if (!contains(rows[r]) || rows[r].shares[s] == 0) continue;
      beyond[v] = std::max(beyond[v], std::sqrt(squared_norm(outwards(rows[r]))) / mean_edge_);
    }
  }
  for (std::size_t r = 0; r < n; ++r) {
    if (!contains(rows[r])) continue;
    SurfaceRow row = rows[r];
    const auto direction = outwards(row);
    const double length = std::sqrt(squared_norm(direction));
    // Where the points go on farther, it is the template that ends, as at a cut limb.
    bool draws = length > 0;
    for (std::size_t s = 0; s < 3; ++s) {
      draws = draws && (row.shares[s] == 0 || beyond[row.corners[s]] < constants_.farthest_end);
    }
    if (!draws) continue;
    row.normal = (1 / length) * direction;
    row.weight *= constants_.boundary_weight;
    rows.push_back(row);
  }
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    const double end = outermost[v];
    // That of a body, which keeps no lengths, would follow single points.
    if (!materials_[topology_.component[v]].slides) continue;
    if (!(end > -constants_.farthest_end && end < -constants_.resolution)) continue;
    SurfaceRow row;
    row.corners = {v, v, v};
    row.normal = conormals[v];
    row.point = x[v] + mean_edge_ * (end + constants_.resolution) * conormals[v];
    row.weight = constants_.boundary_weight;
    rows.push_back(row);
  }
}

}  // namespace dynmesh
