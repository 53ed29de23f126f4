/// Mesh files with arbitrary bytes: consistent content, or an error of one line; a valid template
/// or an error that names the file.
#include <cmath>
#include <dynmesh/template_mesh.hpp>
#include <numeric>
#include <stdexcept>

#include "input.hpp"
#include "io/mesh_files.hpp"
#include "io/mesh_text.hpp"

using namespace dynmesh;
using namespace dynmesh::fuzz;

namespace {

void check(const PolygonMesh& mesh, std::size_t n_bytes) {
  const auto k = static_cast<std::int64_t>(mesh.positions.size() / 3);
  require(mesh.positions.size() % 3 == 0, "positions have three coordinates");
  require(mesh.positions.size() <= n_bytes && mesh.corners.size() <= n_bytes,
          "every number has its own bytes");
  const std::int64_t n_corners = std::accumulate(mesh.sizes.begin(), mesh.sizes.end(), 0LL);
  require(n_corners == static_cast<std::int64_t>(mesh.corners.size()), "corners belong to faces");
  for (const std::int64_t size : mesh.sizes) require(size >= 3, "faces have an area");
  for (const std::int64_t v : mesh.corners) require(v >= 0 && v < k, "corners are vertices");
}

void check(const PlyFile& file, std::size_t n_bytes) {
  const auto size_of = [](const PlyNumbers& numbers) {
    return std::visit([](const auto& values) { return values.size(); }, numbers);
  };
  for (const PlyElement& element : file.elements) {
    for (const PlyProperty& property : element.properties) {
      std::size_t n_values = element.n_records;
      if (property.counts) {
        require(size_of(*property.counts) == element.n_records, "every list has a length");
        const auto sum = [](const auto& counts) {
          return std::accumulate(counts.begin(), counts.end(), 0.0);
        };
        n_values = static_cast<std::size_t>(std::visit(sum, *property.counts));
      }
      require(size_of(property.values) == n_values, "every number was read");
      require(n_values <= n_bytes, "every number has its own bytes");
    }
  }
}

/// Parses the content without the checks of a template.
void parse(std::size_t format, std::string_view text) {
  try {
    if (format == 0) {
      check(parse_obj(text).mesh, text.size());
    } else {
      check(parse_ply(text), text.size());
    }
  } catch (const MalformedFile& error) {
    for (const char c : std::string_view(error.what())) {
      require(c >= ' ' && c <= '~', "the error is one line of ASCII");
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static constexpr std::array<const char*, 2> names = {"a.obj", "a.ply"};
  Input input(data, size);
  const std::size_t format = input.below(names.size());
  const char* name = names[format];
  const auto content = input.take_rest();
  parse(format, {reinterpret_cast<const char*>(content.data()), content.size()});
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
  } catch (const std::runtime_error& error) {
    require(std::string(error.what()).starts_with(path + ": "), "the error names the file");
  }
  return 0;
}
