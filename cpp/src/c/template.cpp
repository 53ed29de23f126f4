/// Template files in the C interface.
#include <dynmesh/dynmesh.h>

#include <cstdint>
#include <dynmesh/template_mesh.hpp>
#include <utility>

#include "c/arguments.hpp"
#include "c/status.hpp"

namespace dynmesh {
namespace {

/// The owner of the arrays to which a dynmesh_template points.
struct OwnedTemplate : dynmesh_template {
  explicit OwnedTemplate(TemplateMesh read) : dynmesh_template{}, mesh(std::move(read)) {
    vertices = mesh.vertices.data();
    n_vertices = static_cast<std::int64_t>(mesh.points().count);
    faces = mesh.faces.data();
    n_faces = static_cast<std::int64_t>(mesh.triangles().count);
  }
  TemplateMesh mesh;
};

}  // namespace
}  // namespace dynmesh

using namespace dynmesh;  // C has no namespaces

dynmesh_status dynmesh_read_template(const char* path, const dynmesh_template** mesh) {
  return guarded([&] {
    check_pointer("mesh", mesh);
    *mesh = nullptr;
    check_pointer("path", path);
    *mesh = new OwnedTemplate(read_template(path));
  });
}

void dynmesh_free_template(const dynmesh_template* mesh) {
  // Each of them was made as one. NOLINTNEXTLINE(cppcoreguidelines-pro-type-static-cast-downcast)
  delete static_cast<const OwnedTemplate*>(mesh);
}
