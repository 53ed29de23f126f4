#include <dynmesh/baselines.hpp>
#include <optional>

#include "arrays.hpp"
#include "bindings.hpp"

namespace dynmesh {
namespace {

Topology topology_of(const py::object& faces, const py::object& n_vertices) {
  const std::size_t k = count_argument("n_vertices", n_vertices);
  const IndicesArgument indices("faces", faces, 3, "(m, 3)");
  const py::gil_scoped_release release;
  return build_topology(indices.faces(), k);
}

/// (k, 3) positions or None.
class OptionalFrame {
 public:
  OptionalFrame(const char* argument, const py::object& frame) {
    if (!frame.is_none()) points_.emplace(argument, frame, "(k, 3)");
  }
  [[nodiscard]] Points<const double> view() const {
    return points_ ? points_->view() : Points<const double>();
  }

 private:
  std::optional<PointsArgument<double>> points_;
};

template <class Baseline>
py::object complete(Baseline& baseline, const py::object& points, const py::object& known,
                    const py::object& previous) {
  const PointsArgument<double> given("points", points, "(k, 3)");
  const KnownArgument mask(known);
  const OptionalFrame before("previous", previous);
  OutputArgument<double> output(py::none(), given.view().count);
  {
    const py::gil_scoped_release release;
    baseline.complete(given.view(), mask.view(), before.view(), output.view());
  }
  return output.array();
}

constexpr const char* complete_doc = R"doc(complete(self, points, known, *, previous=None)
--

Completes one frame, by itself.

Args:
    points: (k, 3) float32 or float64; rows that are not known are ignored.
    known: (k,) bool; at least one vertex of each component.
    previous: (k, 3), a whole frame: work on motion from it instead of on positions. Or None.

Returns:
    (k, 3) float64.)doc";

constexpr const char* mesh_doc =
    R"doc(Least-squares meshes (Sorkine and Cohen-Or 2004): known vertices move.

Minimises |L x|^2 + sum over the known vertices of |x_i - given_i|^2, L the combinatorial Laplacian.
One thread at a time.

Args:
    faces: (m, 3) integers.
    n_vertices: k.)doc";

constexpr const char* mesh_init_doc = R"doc(__init__(self, faces, n_vertices)
--

Takes the mesh, which all frames have in common.)doc";

constexpr const char* interpolation_doc =
    R"doc(Laplacian interpolation (Oostendorp et al. 1989): known vertices stay.

One thread at a time.

Args:
    faces: (m, 3) integers.
    n_vertices: k.
    objective: "harmonic": (L x)_i = 0 at the unknown vertices; "least_squares": minimise |L x|.
    weights: "uniform", or "inverse_distance" as measured on `reference`.
    reference: (k, 3), for "inverse_distance" only.)doc";

constexpr const char* interpolation_init_doc =
    R"doc(__init__(self, faces, n_vertices, *, objective="least_squares", weights="uniform",
         reference=None)
--

Takes the mesh, which all frames have in common, and how to interpolate on it.)doc";

}  // namespace

void bind_baselines(py::module_& module) {
  py::class_<LeastSquaresMesh>(module, "LeastSquaresMesh", mesh_doc)
      .def(py::init([](const py::object& faces, const py::object& n_vertices) {
             return LeastSquaresMesh(topology_of(faces, n_vertices));
           }),
           py::arg("faces"), py::arg("n_vertices"), mesh_init_doc)
      .def("complete", &complete<LeastSquaresMesh>, py::arg("points"), py::arg("known"),
           py::kw_only(), py::arg("previous") = py::none(), complete_doc);
  py::class_<LaplacianInterpolation>(module, "LaplacianInterpolation", interpolation_doc)
      .def(py::init([](const py::object& faces, const py::object& n_vertices,
                       const py::object& objective, const py::object& weights,
                       const py::object& reference) {
             const OptionalFrame frame("reference", reference);
             return LaplacianInterpolation(
                 topology_of(faces, n_vertices),
                 objective_from_name(text_argument("objective", objective)),
                 weights_from_name(text_argument("weights", weights)), frame.view());
           }),
           py::arg("faces"), py::arg("n_vertices"), py::kw_only(),
           py::arg("objective") = "least_squares", py::arg("weights") = "uniform",
           py::arg("reference") = py::none(), interpolation_init_doc)
      .def("complete", &complete<LaplacianInterpolation>, py::arg("points"), py::arg("known"),
           py::kw_only(), py::arg("previous") = py::none(), complete_doc);
}

}  // namespace dynmesh
