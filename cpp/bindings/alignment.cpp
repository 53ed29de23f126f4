#include <dynmesh/alignment.hpp>

#include "arrays.hpp"
#include "bindings.hpp"

namespace dynmesh {
namespace {

Alignment py_find_alignment(const py::object& faces, const py::object& first_frame,
                            const py::object& scan) {
  const PointsArgument<double> frame("first_frame", first_frame, "(k, 3)");
  const FacesArgument triangles(faces, frame.view().count);
  const PointsArgument<double> points("scan", scan, "(n, 3)");
  const py::gil_scoped_release release;
  return find_alignment(triangles.view(), frame.view(), points.view());
}

constexpr const char* alignment_doc =
    R"doc(A rigid motion of a template, and what is known of it and a scan.

Distances are typical ones between the surface of the template and the scan, small if one of them
covers the other: the smaller one of the distance of the median point of the scan from the template
and of that within which 40 % of the template have a point of the scan.

Attributes:
    rotation: (3, 3) float64; the new positions are ``points @ rotation.T + shift``.
    shift: (3,) float64, in the unit of the positions.
    mean_edge: Of the template, in the unit of the positions.
    before: The distance without the motion, in mean edges.
    after: The distance with it, in mean edges.
    ratio: How many times as large as the template the scan is.
    lies_in_scan: Whether the template lies in the scan as it is, so that a tracker can bridge the
        distance in its first frame. Then, the motion is the identity.
    matches: Whether the template lies in the scan with the motion. If not, it has another pose than
        the scan, or is another mesh, and should not be tracked.
    other_unit: Whether one is at least 20 times as large as the other, so that a unit of length is
        probably wrong. Then, no motion is sought, and the template does not match.)doc";

constexpr const char* find_alignment_doc = R"doc(find_alignment(faces, first_frame, scan)
--

Find the rigid motion that puts a template into a scan, from any rotation and position.

A tracker follows the template from there; `Tracker` itself bridges small distances only. The motion
is found by iterative closest points, of which the farthest fifth is ignored (Chetverikov et al.
2002), from 28 rotations; points are first drawn to points (Besl and McKay 1992), and the best
results then to tangent planes (Chen and Medioni 1991). Shapes with symmetries match in several
rotations, of which one is returned. At most 1000 points and 4000 places of the template are
compared, so the time is linear in the size of both, for reading them, plus some hundredths of a
second. Computes in double precision.

Args:
    faces: The triangles of the template, (m, 3) integers.
    first_frame: Its vertices, (k, 3) float32 or float64, finite.
    scan: Points of the surface in the same unit of length, (n, 3) float32 or float64, finite, at
        least one.

Returns:
    The `Alignment`.

Raises:
    ValueError: There are no faces, vertices or points, or one of them is not as described.)doc";

}  // namespace

void bind_alignment(py::module_& module) {
  py::class_<Alignment>(module, "Alignment", alignment_doc)
      .def_property_readonly("rotation",
                             [](const Alignment& found) {
                               return py::array_t<double>({3, 3}, found.rotation.data());
                             })
      .def_property_readonly(
          "shift",
          [](const Alignment& found) { return py::array_t<double>(3, found.shift.data()); })
      .def_readonly("mean_edge", &Alignment::mean_edge)
      .def_readonly("before", &Alignment::before)
      .def_readonly("after", &Alignment::after)
      .def_readonly("ratio", &Alignment::ratio)
      .def_readonly("lies_in_scan", &Alignment::lies_in_scan)
      .def_readonly("matches", &Alignment::matches)
      .def_readonly("other_unit", &Alignment::other_unit)
      .def("__repr__", [](const Alignment& found) {
        return py::str(
                   "Alignment(before={:.6g}, after={:.6g}, ratio={:.6g}, lies_in_scan={}, "
                   "matches={}, other_unit={})")
            .format(found.before, found.after, found.ratio, found.lies_in_scan, found.matches,
                    found.other_unit);
      });
  module.def("find_alignment", &py_find_alignment, py::arg("faces"), py::arg("first_frame"),
             py::arg("scan"), find_alignment_doc);
}

}  // namespace dynmesh
