#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "mesh/template_files.hpp"
#include "support/paths.hpp"

namespace dynmesh {
namespace {

std::filesystem::path checked_path(const std::string& path) {
  try {
    return path_of(path);
  } catch (const std::filesystem::filesystem_error&) {
    refuse_file(path, "is not a name in UTF-8");
  }
}

/// Checks what the readers do not: finite coordinates and valid indices.
void check(const std::string& path, const TemplateMesh& mesh) {
  const std::size_t k = mesh.points().count;
  const auto wrong =
      std::ranges::find_if_not(mesh.vertices, [](float x) { return std::isfinite(x); });
  if (wrong != mesh.vertices.end()) {
    const auto vertex = static_cast<std::size_t>(wrong - mesh.vertices.begin()) / 3;
    refuse_file(path, "vertex " + std::to_string(vertex) + ", counted from 0, is not finite; " +
                          "a template must be complete");
  }
  for (const Index corner : mesh.faces) {
    if (corner >= 0 && static_cast<std::size_t>(corner) < k) continue;
    refuse_file(path, "a face refers to vertex " + std::to_string(corner) + ", but there are " +
                          std::to_string(k) + ", counted from 0");
  }
}

}  // namespace

TemplateMesh read_template(const std::string& path) {
  const std::filesystem::path system_path = checked_path(path);
  const std::string suffix = lowercase_suffix(path);
  if (suffix != ".obj" && suffix != ".ply" && suffix != ".off") {
    refuse_file(path, "a template must be an .obj, .ply or .off file");
  }
  std::ifstream file(system_path, std::ios::binary);
  if (!file || std::filesystem::is_directory(system_path)) refuse_file(path, "cannot be opened");
  TemplateMesh mesh = suffix == ".obj"   ? read_obj(path, file)
                      : suffix == ".ply" ? read_ply(path, file)
                                         : read_off(path, file);
  const std::size_t most = std::max(mesh.points().count, mesh.triangles().count);
  if (mesh.vertices.empty()) refuse_file(path, "has no vertices");
  if (most > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
    refuse_file(path, "has more than 2^31 - 1 vertices or triangles");
  }
  check(path, mesh);
  return mesh;
}

}  // namespace dynmesh
