#include <pybind11/stl.h>

#include <algorithm>
#include <dynmesh/topology.hpp>

#include "arrays.hpp"
#include "bindings.hpp"

namespace dynmesh {
namespace {

py::tuple cells(const py::object& faces, const py::object& n_vertices) {
  const std::size_t k = count_argument("n_vertices", n_vertices);
  const FacesArgument triangles(faces, k);
  Topology topology;
  {
    const py::gil_scoped_release release;
    topology = build_topology(triangles.view(), k);
  }
  const auto to_numpy = [](const std::vector<Index>& values) {
    return py::array_t<Index>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  return py::make_tuple(to_numpy(topology.cells.offsets), to_numpy(topology.cells.neighbours));
}

const char* name_of(Refusal kind) {
  switch (kind) {
    case Refusal::degenerate:
      return "degenerate";
    case Refusal::duplicate:
      return "duplicate";
    case Refusal::flipped:
      return "flipped";
    case Refusal::non_manifold_edge:
      return "non_manifold_edge";
    case Refusal::non_manifold_vertex:
      return "non_manifold_vertex";
  }
  return "";  // not reached
}

constexpr const char* cells_doc = R"doc(cells(faces, n_vertices)
--

The one-ring of every vertex.

Args:
    faces: The triangles, (m, 3) integers.
    n_vertices: The number of vertices, k.

Returns:
    offsets (k + 1,) int32 and neighbours int32. The neighbours of vertex i, in ascending order, are
    neighbours[offsets[i]:offsets[i + 1]].)doc";

constexpr const char* report_doc = R"doc(Statistics of the connectivity of a mesh.

Attributes:
    components: The number of connected components, including isolated vertices.
    isolated_vertices: The number of vertices without an edge.
    boundary_edges: The number of edges with one face, among the faces that are not refused.
    refused_faces: A RefusedFace for each degenerate, duplicate, flipped or non-manifold face. Its
        edges still count in the cells.)doc";

constexpr const char* refused_face_doc = R"doc(A face that the half-edge mesh cannot represent.

Attributes:
    index: The row of `faces`.
    kind: "degenerate": a vertex is repeated; "duplicate": an earlier face has the same three
        vertices; "flipped": a neighbouring face has the shared edge in the same direction;
        "non_manifold_edge": an edge already has two faces; "non_manifold_vertex": the faces around
        a vertex would not form a single fan.
    reason: What is wrong, with the vertices or the other face, as text.)doc";

}  // namespace

void bind_topology(py::module_& module) {
  module.def("cells", &cells, py::arg("faces"), py::arg("n_vertices"), cells_doc);
  py::class_<RefusedFace>(module, "RefusedFace", refused_face_doc)
      .def_readonly("index", &RefusedFace::index)
      .def_property_readonly("kind", [](const RefusedFace& face) { return name_of(face.kind); })
      .def_readonly("reason", &RefusedFace::reason)
      .def("__repr__", [](const RefusedFace& face) {
        return py::str("RefusedFace(index={}, kind={!r}, reason={!r})")
            .format(face.index, name_of(face.kind), face.reason);
      });
  py::class_<TopologyReport>(module, "TopologyReport", report_doc)
      .def_readonly("components", &TopologyReport::components)
      .def_readonly("isolated_vertices", &TopologyReport::isolated_vertices)
      .def_readonly("boundary_edges", &TopologyReport::boundary_edges)
      .def_readonly("refused_faces", &TopologyReport::refused_faces)
      .def("__repr__", [](const TopologyReport& report) {
        return py::str(
                   "TopologyReport(components={}, isolated_vertices={}, boundary_edges={}, "
                   "refused_faces=<{}>)")
            .format(report.components, report.isolated_vertices, report.boundary_edges,
                    report.refused_faces.size());
      });
}

}  // namespace dynmesh
