#include <pybind11/stl.h>

#include <algorithm>
#include <dynmesh/topology.hpp>

#include "arrays.hpp"
#include "bindings.hpp"

namespace dynmesh {
namespace {

py::tuple cells(const py::object& faces, const py::object& n_vertices) {
  const std::size_t k = count_argument("n_vertices", n_vertices);
  const IndicesArgument indices("faces", faces, 3, "(m, 3)");
  Topology topology;
  {
    const py::gil_scoped_release release;
    topology = build_topology(indices.faces(), k);
  }
  const auto to_numpy = [](const std::vector<Index>& values) {
    return py::array_t<Index>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  return py::make_tuple(to_numpy(topology.cells.offsets), to_numpy(topology.cells.neighbours));
}

std::vector<std::pair<std::size_t, std::string>> refused_faces(const TopologyReport& report) {
  std::vector<std::pair<std::size_t, std::string>> faces;
  for (const auto& face : report.refused_faces) faces.emplace_back(face.index, face.reason);
  return faces;
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
    refused_faces: (index, reason) of each degenerate, duplicate or non-manifold face. Its edges
        still count in the cells.)doc";

}  // namespace

void bind_topology(py::module_& module) {
  module.def("cells", &cells, py::arg("faces"), py::arg("n_vertices"), cells_doc);
  py::class_<TopologyReport>(module, "TopologyReport", report_doc)
      .def_readonly("components", &TopologyReport::components)
      .def_readonly("isolated_vertices", &TopologyReport::isolated_vertices)
      .def_readonly("boundary_edges", &TopologyReport::boundary_edges)
      .def_property_readonly("refused_faces", &refused_faces)
      .def("__repr__", [](const TopologyReport& report) {
        return py::str(
                   "TopologyReport(components={}, isolated_vertices={}, boundary_edges={}, "
                   "refused_faces=<{}>)")
            .format(report.components, report.isolated_vertices, report.boundary_edges,
                    report.refused_faces.size());
      });
}

}  // namespace dynmesh
