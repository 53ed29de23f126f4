#include <dynmesh/baselines.hpp>
#include <optional>

#include "arrays.hpp"
#include "bindings.hpp"

namespace dynmesh {
namespace {

Topology topology_of(const py::object& faces, const py::object& n_vertices) {
  const std::size_t k = count_argument("n_vertices", n_vertices);
  const FacesArgument triangles(faces, k);
  const py::gil_scoped_release release;
  return build_topology(triangles.view(), k);
}

/// A (k, 3) array of positions, or None.
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

Complete one frame, independently of all others.

Args:
    points: Positions, (k, 3) float32 or float64. Rows that are not known are ignored.
    known: The known mask, (k,) bool. At least one vertex of each component must be known.
    previous: A complete frame, (k, 3). If given, the method is applied to the motion vectors from
        it instead of to the positions.

Returns:
    The completed frame, (k, 3) float64.)doc";

constexpr const char* mesh_doc =
    R"doc(Least-squares meshes (Sorkine and Cohen-Or 2004), in which known vertices move as well.

Minimises |L x|^2 + sum over the known vertices of |x_i - given_i|^2, where L is the combinatorial
Laplacian. An object may be used by one thread at a time.

Args:
    faces: The triangles, (m, 3) integers.
    n_vertices: The number of vertices, k.)doc";

constexpr const char* mesh_init_doc = R"doc(__init__(self, faces, n_vertices)
--

Prepare the mesh that all frames share.)doc";

constexpr const char* interpolation_doc =
    R"doc(Laplacian interpolation (Oostendorp et al. 1989), in which known vertices do not move.

An object may be used by one thread at a time.

Args:
    faces: The triangles, (m, 3) integers.
    n_vertices: The number of vertices, k.
    objective: "harmonic" sets (L x)_i = 0 at the unknown vertices; "least_squares" minimises |L x|.
    weights: "uniform", or "inverse_distance", measured on `reference`.
    reference: A frame, (k, 3). Required for weights "inverse_distance" only.)doc";

constexpr const char* interpolation_init_doc =
    R"doc(__init__(self, faces, n_vertices, *, objective="least_squares", weights="uniform",
         reference=None)
--

Prepare the mesh that all frames share.)doc";

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
