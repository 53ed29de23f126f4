#include <dynmesh/registration.hpp>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "depth_images.hpp"
#include "scan.hpp"
#include "training.hpp"

namespace dynmesh {
namespace {

/// What both functions take beside the scan.
struct Request {
  py::object faces, positions, landmarks, training;
  RegistrationSettings settings;
};

template <class Real>
class LandmarksArgument {
 public:
  explicit LandmarksArgument(const py::object& given) {
    if (given.is_none()) return;
    const bool is_pair = (py::isinstance<py::tuple>(given) || py::isinstance<py::list>(given)) &&
                         py::len(given) == 2;
    if (!is_pair) {
      throw py::type_error("landmarks: must be a pair of vertices (n,) and positions (n, 3), not " +
                           type_name(given));
    }
    const auto pair = py::reinterpret_borrow<py::sequence>(given);
    vertices_.emplace("landmarks", pair[0], 0, "(n,)");
    positions_.emplace("landmarks", pair[1], "(n, 3)");
  }
  [[nodiscard]] Landmarks<Real> view() const {
    if (!vertices_) return {};
    return {vertices_->view(), positions_->view()};
  }

 private:
  std::optional<IndicesArgument> vertices_;
  std::optional<PointsArgument<Real>> positions_;
};

/// Calls `call` with what `register_template` takes before and after the scan.
template <class Real, class Call>
py::tuple registered(const Request& request, const Call& call) {
  const PointsArgument<Real> positions("template", request.positions, "(k, 3)");
  const FacesArgument faces(request.faces, positions.view().count);
  const LandmarksArgument<Real> landmarks(request.landmarks);
  std::optional<Training<Real>> training;
  if (!request.training.is_none()) {
    training = training_of<Real>(request.training, positions.view().count);
  }
  const Registration<Real> found = call([&](const auto& scan) {
    const py::gil_scoped_release release;
    return register_template<Real>(faces.view(), positions.view(), scan, landmarks.view(),
                                   request.settings, training ? &*training : nullptr);
  });
  const py::object errors = request.settings.uncertainty
                                ? py::object(array_of(found.standard_error))
                                : py::object(py::none());
  constexpr const char* qualities[] = {"good", "doubtful", "ruined"};
  return py::make_tuple(array_of(found.vertices), array_of(found.observed), errors,
                        py::array_t<double>({4, 4}, found.transform.data()), found.far_share,
                        found.hole, found.overlap, found.distance, found.rounds, found.converged,
                        qualities[static_cast<std::size_t>(found.quality)]);
}

template <class Call>
py::tuple with_type_of(const py::object& positions, const Call& call) {
  const py::array array = to_positions("template", positions);
  return array.itemsize() == sizeof(float) ? call(float{}) : call(double{});
}

Request request_of(const py::object& faces, const py::object& positions,
                   const py::object& landmarks, const py::object& align, const py::object& scale,
                   const py::object& training, const py::object& uncertainty,
                   const py::object& threads) {
  return {faces,
          positions,
          landmarks,
          training,
          {truth_argument("align", align), truth_argument("scale", scale),
           truth_argument("uncertainty", uncertainty), integer_argument("threads", threads)}};
}

py::tuple py_register(const py::object& faces, const py::object& positions,
                      const py::object& points, const py::object& normals,
                      const py::object& viewpoints, const py::object& landmarks,
                      const py::object& align, const py::object& scale, const py::object& training,
                      const py::object& uncertainty, const py::object& threads) {
  const Request request =
      request_of(faces, positions, landmarks, align, scale, training, uncertainty, threads);
  return with_type_of(positions, [&]<class Real>(Real) {
    return registered<Real>(request, [&](const auto& run) {
      const ScanArgument<Real> scan(points, normals, viewpoints);
      return run(scan.view());
    });
  });
}

py::tuple py_register_depth(const py::object& faces, const py::object& positions,
                            const py::object& depth, const py::object& intrinsics,
                            const py::object& pose, const py::object& landmarks,
                            const py::object& align, const py::object& scale,
                            const py::object& training, const py::object& uncertainty,
                            const py::object& threads) {
  const Request request =
      request_of(faces, positions, landmarks, align, scale, training, uncertainty, threads);
  return with_type_of(positions, [&]<class Real>(Real) {
    return registered<Real>(request, [&](const auto& run) {
      const ImagesArgument images(depth, intrinsics, pose);
      return run(images.view());
    });
  });
}

constexpr const char* register_doc =
    R"doc(register(faces, template, points, normals, viewpoints, landmarks, align, scale, training, uncertainty, threads)
--

Register a template with a scan; dynmesh.register is the function for users.

Returns:
    The attributes of dynmesh.Registration, in their order; vertices as (3 k,), observed as uint8.)doc";

constexpr const char* depth_doc =
    R"doc(register_depth(faces, template, depth, intrinsics, pose, landmarks, align, scale, training, uncertainty, threads)
--

Register a template with depth images; dynmesh.register_depth is the function for users.

Returns:
    As register.)doc";

}  // namespace

void bind_registration(py::module_& module) {
  module.def("register", &py_register, py::arg("faces"), py::arg("template"), py::arg("points"),
             py::arg("normals"), py::arg("viewpoints"), py::arg("landmarks"), py::arg("align"),
             py::arg("scale"), py::arg("training"), py::arg("uncertainty"), py::arg("threads"),
             register_doc);
  module.def("register_depth", &py_register_depth, py::arg("faces"), py::arg("template"),
             py::arg("depth"), py::arg("intrinsics"), py::arg("pose"), py::arg("landmarks"),
             py::arg("align"), py::arg("scale"), py::arg("training"), py::arg("uncertainty"),
             py::arg("threads"), depth_doc);
}

}  // namespace dynmesh
