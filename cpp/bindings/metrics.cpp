#include <dynmesh/metrics.hpp>

#include "arrays.hpp"
#include "bindings.hpp"

namespace dynmesh {
namespace {

/// A reference and a completion, both (k, 3) or both (n, k, 3), converted to double precision.
class Pair {
 public:
  Pair(const py::object& reference, const py::object& completed)
      : reference_(load("reference", reference)), completed_(load("completed", completed)) {
    if (!reference_.attr("shape").equal(completed_.attr("shape"))) {
      throw py::value_error(
          "completed: has shape " + std::string(py::str(completed_.attr("shape"))) +
          ", but the reference has " + std::string(py::str(reference_.attr("shape"))));
    }
  }

  [[nodiscard]] bool is_sequence() const { return reference_.ndim() == 3; }
  [[nodiscard]] py::ssize_t n_frames() const { return is_sequence() ? reference_.shape(0) : 1; }
  [[nodiscard]] py::ssize_t n_vertices() const { return reference_.shape(reference_.ndim() - 2); }
  [[nodiscard]] Points<const double> reference(py::ssize_t frame) const {
    return view_frame(reference_, reference_.data(), frame);
  }
  [[nodiscard]] Points<const double> completed(py::ssize_t frame) const {
    return view_frame(completed_, completed_.data(), frame);
  }

 private:
  static py::array_t<double> load(const char* argument, const py::object& object) {
    const py::array array = to_positions(argument, object);
    check_shape(argument, array, array.ndim() == 3 ? 3 : 2, 3, "(k, 3) or (n, k, 3)");
    return as_type<double>(array);
  }

  py::array_t<double> reference_;
  py::array_t<double> completed_;
};

py::object py_nmsve(const py::object& faces, const py::object& reference,
                    const py::object& completed) {
  const Pair pair(reference, completed);
  const auto k = static_cast<std::size_t>(pair.n_vertices());
  const FacesArgument triangles(faces, k);
  py::array_t<double> values(pair.n_frames());
  double* value = values.mutable_data();
  {
    const py::gil_scoped_release release;
    const Topology topology = build_topology(triangles.view(), k);
    for (py::ssize_t frame = 0; frame < pair.n_frames(); ++frame) {
      value[frame] = nmsve(topology.cells, pair.reference(frame), pair.completed(frame));
    }
  }
  if (pair.is_sequence()) return values;
  return py::float_(value[0]);
}

py::array_t<double> py_vertex_error(const py::object& reference, const py::object& completed) {
  const Pair pair(reference, completed);
  const auto k = static_cast<std::size_t>(pair.n_vertices());
  py::array_t<double> errors = pair.is_sequence()
                                   ? py::array_t<double>({pair.n_frames(), pair.n_vertices()})
                                   : py::array_t<double>(pair.n_vertices());
  double* first = errors.mutable_data();
  const py::gil_scoped_release release;
  for (py::ssize_t frame = 0; frame < pair.n_frames(); ++frame) {
    vertex_error(pair.reference(frame), pair.completed(frame),
                 std::span(first + static_cast<std::size_t>(frame) * k, k));
  }
  return errors;
}

ErrorSummary py_summary(const py::object& errors) {
  const py::array array = to_positions("errors", errors);
  const py::array_t<double, py::array::c_style | py::array::forcecast> packed(array);
  return summary({packed.data(), static_cast<std::size_t>(packed.size())});
}

constexpr const char* nmsve_doc = R"doc(nmsve(faces, reference, completed)
--

Normalised mean square visual error (paper, eq. 5 and 6).

1/(2k) times the sum of |v_i - v'_i| + |GL(v_i) - GL(v'_i)| over all vertices, where GL(v_i) is v_i
minus the mean of its neighbours weighted by inverse distance. The time is linear in the number of
edges.

Args:
    faces: The triangles, (m, 3) integers.
    reference: A frame (k, 3) or n frames (n, k, 3), float32 or float64, finite.
    completed: The completed frame or frames, of the same shape.

Returns:
    The error in the unit of the positions: a float, or (n,) float64 for n frames.)doc";

constexpr const char* vertex_error_doc = R"doc(vertex_error(reference, completed)
--

The error |v_i - v'_i| of each vertex, the heatmap of the paper.

Args:
    reference: A frame (k, 3) or n frames (n, k, 3), float32 or float64, finite.
    completed: The completed frame or frames, of the same shape.

Returns:
    The errors (k,) or (n, k), float64, in the unit of the positions.)doc";

constexpr const char* summary_doc = R"doc(summary(errors)
--

Mean, root mean square, 99th percentile and maximum of errors.

Args:
    errors: An array of any shape, float32 or float64, not empty and without NaN.)doc";

}  // namespace

void bind_metrics(py::module_& module) {
  py::class_<ErrorSummary>(module, "ErrorSummary",
                           "Statistics of errors, in their unit: mean, rms, p99 and maximum.")
      .def_readonly("mean", &ErrorSummary::mean)
      .def_readonly("rms", &ErrorSummary::rms)
      .def_readonly("p99", &ErrorSummary::p99)
      .def_readonly("maximum", &ErrorSummary::maximum)
      .def("__repr__", [](const ErrorSummary& summary) {
        return py::str("ErrorSummary(mean={:.6g}, rms={:.6g}, p99={:.6g}, maximum={:.6g})")
            .format(summary.mean, summary.rms, summary.p99, summary.maximum);
      });
  module.def("nmsve", &py_nmsve, py::arg("faces"), py::arg("reference"), py::arg("completed"),
             nmsve_doc);
  module.def("vertex_error", &py_vertex_error, py::arg("reference"), py::arg("completed"),
             vertex_error_doc);
  module.def("summary", &py_summary, py::arg("errors"), summary_doc);
}

}  // namespace dynmesh
