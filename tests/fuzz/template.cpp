/// Mesh files with arbitrary bytes: a valid template or an error that names the file. A template is
/// the same after it is written and read again.
#include <cmath>
#include <dynmesh/template_mesh.hpp>
#include <stdexcept>

#include "input.hpp"

using namespace dynmesh;
using namespace dynmesh::fuzz;

namespace {

std::string as_obj(const TemplateMesh& mesh) {
  std::string text;
  char line[128];
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 3) {
    (void)std::snprintf(
        line, sizeof line, "v %.9g %.9g %.9g\n", static_cast<double>(mesh.vertices[v]),
        static_cast<double>(mesh.vertices[v + 1]), static_cast<double>(mesh.vertices[v + 2]));
    text += line;
  }
  for (std::size_t f = 0; f < mesh.faces.size(); f += 3) {
    (void)std::snprintf(line, sizeof line, "f %d %d %d\n", mesh.faces[f] + 1, mesh.faces[f + 1] + 1,
                        mesh.faces[f + 2] + 1);
    text += line;
  }
  return text;
}

bool has_distinct_corners(const TemplateMesh& mesh) {
  for (std::size_t f = 0; f < mesh.faces.size(); f += 3) {
    const Index a = mesh.faces[f];
    const Index b = mesh.faces[f + 1];
    const Index c = mesh.faces[f + 2];
    if (a == b || b == c || a == c) return false;
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static constexpr std::array<const char*, 3> names = {"a.obj", "a.ply", "a.off"};
  Input input(data, size);
  const char* name = names[input.below(names.size())];
  const auto content = input.take_rest();
  const std::string path = write_scratch(name, content);
  try {
    const TemplateMesh mesh = read_template(path);
    const std::size_t k = mesh.points().count;
    require(k > 0 && mesh.vertices.size() == 3 * k, "there are vertices");
    require(mesh.faces.size() % 3 == 0, "faces are triangles");
    for (const float x : mesh.vertices) require(std::isfinite(x), "positions are finite");
    for (const Index v : mesh.faces) {
      require(v >= 0 && static_cast<std::size_t>(v) < k, "faces refer to vertices");
    }
    require(k <= content.size() && mesh.faces.size() <= 3 * content.size(),
            "no more comes out than goes in");
    if (!has_distinct_corners(mesh)) return 0;  // OBJ refuses such faces
    const std::string text = as_obj(mesh);
    const TemplateMesh again = read_template(write_scratch(
        "again.obj", {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
    require(again.vertices == mesh.vertices && again.faces == mesh.faces, "reads back");
  } catch (const std::runtime_error& error) {
    require(std::string(error.what()).starts_with(path + ": "), "the error names the file");
  }
  return 0;
}
