#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <type_traits>

#include "base/checks.hpp"
#include "base/default_arithmetic.hpp"
#include "io/mesh_files.hpp"
#include "io/mesh_text.hpp"
#include "io/paths.hpp"

namespace dynmesh {
namespace {

[[noreturn]] void refuse_file(const std::string& path, const std::string& why) {
  throw UnreadableFile(path + ": " + why);
}

/// Returns the positions and faces of a PLY file.
PolygonMesh mesh_of_ply(const std::string& data) {
  const PlyFile file = parse_ply(data);
  PolygonMesh mesh;
  if (const PlyElement* vertices = find_named(file.elements, "vertex")) {
    mesh.positions.resize(3 * vertices->n_records);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const PlyProperty* property =
          find_named(vertices->properties, std::string_view("xyz").substr(axis, 1));
      if (!property) throw MalformedFile("its vertices need x, y and z");
      const auto copy = [&](const auto& values) {
        if (property->counts || std::is_integral_v<std::decay_t<decltype(values[0])>>) {
          throw MalformedFile("the coordinates of its vertices must be float or double");
        }
        for (std::size_t v = 0; v < values.size(); ++v) mesh.positions[3 * v + axis] = values[v];
      };
      std::visit(copy, property->values);
    }
  }
  if (const PlyElement* faces = find_named(file.elements, "face"); faces && faces->n_records > 0) {
    const PlyProperty* indices = find_named(faces->properties, "vertex_indices");
    const PlyProperty* index = find_named(faces->properties, "vertex_index");
    const PlyProperty* list = indices ? indices : index;
    if ((indices && index) || !list || !list->counts) {
      throw MalformedFile("its faces need one list 'vertex_indices'");
    }
    const auto copy = [](const auto& values, std::vector<std::int64_t>& copied) {
      if (std::is_floating_point_v<std::decay_t<decltype(values[0])>>) {
        throw MalformedFile("the vertices of its faces must be integers");
      }
      for (const auto value : values) copied.push_back(static_cast<std::int64_t>(value));
    };
    std::visit([&](const auto& counts) { copy(counts, mesh.sizes); }, *list->counts);
    std::visit([&](const auto& values) { copy(values, mesh.corners); }, list->values);
  }
  return mesh;
}

/// Returns positions in single precision. Refuses those beyond its range and, of a template, which
/// must be complete, those that are not finite.
std::vector<float> checked_positions(const std::vector<double>& positions, bool is_template) {
  constexpr double largest = std::numeric_limits<float>::max();
  std::vector<float> vertices;
  for (const double coordinate : positions) {
    const bool is_missing = !is_template && !std::isfinite(coordinate);
    if (!is_missing && !(std::abs(coordinate) <= largest)) {
      throw MalformedFile(joined("vertex ", vertices.size() / 3,
                                 ", counted from 0, has the coordinate ", to_text(coordinate, 6),
                                 is_template ? "; a template must be complete, with" : "; it needs",
                                 " coordinates in the range of float"));
    }
    vertices.push_back(static_cast<float>(coordinate));
  }
  return vertices;
}

/// Splits every polygon into a fan of triangles from its first vertex. Refuses polygons of fewer
/// than three corners and vertices that do not exist.
std::vector<Index> checked_triangles(const PolygonMesh& mesh) {
  const auto n_vertices = static_cast<std::int64_t>(mesh.positions.size() / 3);
  std::vector<Index> faces;
  auto first = mesh.corners.begin();
  for (std::size_t f = 0; f < mesh.sizes.size(); first += mesh.sizes[f++]) {
    const std::span polygon(first, static_cast<std::size_t>(mesh.sizes[f]));
    const auto refuse = [&](const std::string& why) {
      throw MalformedFile("face " + std::to_string(f) + " " + why + ", both counted from 0");
    };
    if (polygon.size() < 3) refuse("has " + std::to_string(polygon.size()) + " vertices");
    for (const std::int64_t vertex : polygon) {
      if (vertex >= 0 && vertex < n_vertices) continue;
      refuse("refers to vertex " + std::to_string(vertex) + ", but there are " +
             std::to_string(n_vertices));
    }
    for (std::size_t c = 2; c < polygon.size(); ++c) {
      for (const std::int64_t vertex : {polygon[0], polygon[c - 1], polygon[c]}) {
        faces.push_back(static_cast<Index>(vertex));
      }
    }
  }
  return faces;
}

/// Returns what `convert` makes of the mesh of a file.
template <class Convert>
auto read_mesh(const std::string& path, const Convert& convert) {
  std::filesystem::path system_path;
  try {
    system_path = path_of(path);
  } catch (const std::filesystem::filesystem_error&) {
    refuse_file(path, "is not a name in UTF-8");
  }
  const std::string suffix = lowercase_suffix(path);
  if (suffix != ".obj" && suffix != ".ply") {
    refuse_file(path, "a template must be an .obj or a .ply file");
  }
  std::ifstream file(system_path, std::ios::binary);
  if (!file || std::filesystem::is_directory(system_path)) refuse_file(path, "cannot be opened");
  const std::string data(std::istreambuf_iterator<char>(file), {});
  try {
    return convert(suffix == ".obj" ? parse_obj(data).mesh : mesh_of_ply(data));
  } catch (const MalformedFile& error) {
    refuse_file(path, error.what());
  }
}

}  // namespace

TemplateMesh read_template(const std::string& path) {
  const DefaultArithmetic arithmetic;
  return read_mesh(path, [](const PolygonMesh& mesh) {
    if (mesh.positions.empty()) throw MalformedFile("has no vertices");
    TemplateMesh checked{checked_positions(mesh.positions, true), checked_triangles(mesh)};
    const std::size_t most = std::max(checked.points().count, checked.triangles().count);
    if (most > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
      throw MalformedFile("has more than 2^31 - 1 vertices or triangles");
    }
    return checked;
  });
}

std::vector<float> read_positions(const std::string& path) {
  const DefaultArithmetic arithmetic;
  return read_mesh(
      path, [](const PolygonMesh& mesh) { return checked_positions(mesh.positions, false); });
}

}  // namespace dynmesh
