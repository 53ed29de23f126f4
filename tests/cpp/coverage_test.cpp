/// A surface that was bent into a scan.
#include "quality/coverage.hpp"

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "surface_fit/surface_places.hpp"

namespace dynmesh::testing {
namespace {

/// Ten equal tori beside each other.
struct Tori {
  static constexpr std::size_t number = 10;

  Mesh<double> torus = bumpy_torus(24);
  Mesh<double> mesh = all();
  std::vector<Triangle> faces = triangles_of(mesh);
  std::vector<Vector3> frame = rows_of(mesh.vertices), x = frame;
  std::vector<Vector3> normals = vertex_normals(faces, frame);
  Topology topology = build_topology(mesh.faces(), mesh.size());

  [[nodiscard]] Mesh<double> all() const {
    Mesh<double> found = torus;
    for (std::size_t i = 1; i < number; ++i) {
      const double distance = 50.0 * static_cast<double>(i);
      found = join(found, {translated(torus.vertices, distance, 0.0, 0.0), torus.indices});
    }
    return found;
  }
  /// Moves the last torus to the first one.
  void put_last_on_first() {
    for (std::size_t v = 0; v < torus.size(); ++v) x[x.size() - torus.size() + v] = frame[v];
  }
  [[nodiscard]] double overlap() const {
    const std::vector<std::uint8_t> is_sheet(x.size());
    return overlap_of({faces, topology, frame, x, normals, is_sheet,
                       mean_edge_length(topology.cells, frame), size_of(frame)});
  }
};

TEST_CASE("parts that lie on the same points overlap unless they face opposite ways") {
  Tori tori;
  CHECK(tori.overlap() == 0);
  tori.put_last_on_first();
  CHECK(tori.overlap() == doctest::Approx(0.2));
  for (std::size_t v = 0; v < tori.torus.size(); ++v) tori.normals[v] = -1.0 * tori.normals[v];
  CHECK(tori.overlap() < 0.01);
}

}  // namespace
}  // namespace dynmesh::testing
