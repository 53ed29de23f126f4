/// Topology, metrics, baselines, alignment, registration and files.
#include <algorithm>
#include <dynmesh/baselines.hpp>
#include <dynmesh/metrics.hpp>
#include <dynmesh/quality.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/topology.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "arrays.hpp"
#include "base/checks.hpp"
#include "io/mesh_files.hpp"
#include "io/mesh_text.hpp"
#include "quality/limits.hpp"
#include "registration/constants.hpp"
#include "registration/rigid_alignment.hpp"

namespace dynmesh {
namespace {

using Positions = Exact<double>;

/// The frames of an array (n, k, 3), one after another.
Points<const double> frame_of(const Positions& frames, std::size_t number) {
  const auto k = static_cast<std::size_t>(frames.shape(1));
  return {frames.data() + 3 * k * number, k};
}

void py_nmsve(const Exact<Index>& faces, const Positions& reference, const Positions& completed,
              Positions& errors) {
  const Topology topology =
      build_topology(view(faces), static_cast<std::size_t>(reference.shape(1)));
  const std::span all(errors.mutable_data(), static_cast<std::size_t>(errors.size()));
  for (std::size_t n = 0; n < all.size(); ++n) {
    all[n] = nmsve(topology.cells, frame_of(reference, n), frame_of(completed, n));
  }
}

void py_vertex_error(const Positions& reference, const Positions& completed, Positions& errors) {
  const auto k = static_cast<std::size_t>(errors.shape(1));
  const std::span all(errors.mutable_data(), static_cast<std::size_t>(errors.size()));
  for (std::size_t n = 0; n < static_cast<std::size_t>(errors.shape(0)); ++n) {
    vertex_error(frame_of(reference, n), frame_of(completed, n), all.subspan(n * k, k));
  }
}

/// Binds the creation of a baseline, a function of this name, and the baseline.
template <class Baseline, class Create>
void bind_baseline(py::module_& module, const char* name, const Create& create) {
  module.def(name, create, Release());
  py::class_<Baseline>(py::handle(), name)
      .def(
          "complete",
          [](Baseline& baseline, const Positions& points, const Exact<bool>& known,
             const std::optional<Positions>& previous, Positions& out) {
            const auto before = previous ? view(*previous) : Points<const double>();
            baseline.complete(view(points), view(known), before, writable(out));
          },
          Release());
}

/// Points, normals, viewpoints and colours.
template <class Real>
using ScanArrays = std::tuple<Exact<Real>, std::optional<Exact<Real>>, std::optional<Exact<Real>>,
                              std::optional<Exact<Real>>>;

template <class Real>
py::tuple py_register(const Exact<Index>& faces, const Exact<Real>& positions,
                      const std::variant<ScanArrays<Real>, Images>& scan,
                      const Exact<Index>& vertices, const Exact<Real>& landmarks, bool align,
                      bool scale, const Training<Real>* training, bool uncertainty, Index threads) {
  const auto stop_if_interrupted = [] {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  };
  const Registration<Real> found = without_gil([&] {
    const Landmarks<Real> pairs = {{vertices.data(), static_cast<std::size_t>(vertices.size())},
                                   view(landmarks)};
    const auto registered = [&](const auto& measured) {
      return register_template<Real>(view(faces), view(positions), measured, pairs,
                                     {align, scale, uncertainty, threads, stop_if_interrupted},
                                     training);
    };
    if (const auto* images = std::get_if<Images>(&scan)) {
      const std::vector<DepthImage> views = view(*images);
      return registered(std::span<const DepthImage>(views));
    }
    return registered(std::apply(scan_of<Real>, std::get<ScanArrays<Real>>(scan)));
  });
  return py::make_tuple(array_of(found.vertices), array_of(found.observed),
                        array_of(found.standard_error), fields_of(found));
}

py::array numbers_of(const PlyNumbers& numbers) {
  return std::visit([](const auto& values) -> py::array { return array_of(values); }, numbers);
}

/// Files do not state the encoding of names. In Latin-1, any bytes are valid.
py::str to_text(std::string_view bytes) {
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeLatin1(bytes.data(), static_cast<py::ssize_t>(bytes.size()), nullptr));
}

template <class Texts>
py::list to_list(const Texts& texts) {
  py::list result;
  for (const auto& text : texts) result.append(to_text(text));
  return result;
}

py::tuple py_parse_obj(const py::bytes& data) {
  const std::string_view text = data;
  const ObjFile file = without_gil([&] { return parse_obj(text); });
  return py::make_tuple(array_of(file.mesh.positions).reshape({-1, 3}), array_of(file.mesh.sizes),
                        array_of(file.mesh.corners), to_list(file.comments), to_list(file.further),
                        file.has_colours);
}

py::tuple py_parse_ply(const py::bytes& data) {
  const std::string_view view = data;
  const PlyFile file = without_gil([&] { return parse_ply(view); });
  py::dict elements;
  for (const PlyElement& element : file.elements) {
    py::dict columns;
    for (const PlyProperty& property : element.properties) {
      py::object column = numbers_of(property.values);
      if (property.counts) {
        column = py::make_tuple(numbers_of(*property.counts).attr("astype")("int64"), column);
      }
      columns[to_text(property.name)] = column;
    }
    elements[to_text(element.name)] = columns;
  }
  return py::make_tuple(elements, to_list(file.comments));
}

}  // namespace

void bind_functions(py::module_& module) {
  module.def("cells", [](const Exact<Index>& faces, std::size_t n_vertices) {
    const Cells cells = build_topology(view(faces), n_vertices).cells;
    return std::pair(array_of(cells.offsets), array_of(cells.neighbours));
  });
  module.def("nmsve", &py_nmsve, Release());
  module.def("vertex_error", &py_vertex_error, Release());
  module.def("is_hardly_known", &is_hardly_known);
  module.def("quality_of_frames", [](const std::vector<std::string>& names) {
    std::vector<Quality> frames;
    for (const auto& name : names) {
      const auto found = std::ranges::find(quality_names, name);
      if (found == quality_names.end()) refuse("quality", "is none: ", name);
      frames.push_back(static_cast<Quality>(found - quality_names.begin()));
    }
    return quality_names[static_cast<std::size_t>(quality_of_frames(frames))];
  });
  module.def("falling_sight", [](const std::vector<double>& seen) { return falling_sight(seen); });
  // Those by which Python judges cameras and scans before they are tracked or registered.
  module.attr("ruined_far") = quality_limits.ruined_far;
  module.attr("large_hole") = quality_limits.hole;
  module.attr("other_size") = quality_limits.other_size;
  module.attr("other_unit") = registration_constants.other_unit;
  module.def("align_rigidly", [](const Exact<Index>& faces, const Positions& first_frame,
                                 const Positions& scan) {
    const RigidAlignment found =
        without_gil([&] { return align_rigidly(view(faces), view(first_frame), view(scan)); });
    return py::make_tuple(array_of(found.motion).reshape({4, 4}), found.mean_edge,
                          array_of(found.surface).reshape({-1, 3}),
                          array_of(found.scan).reshape({-1, 3}));
  });
  bind_baseline<LeastSquaresMesh>(
      module, "least_squares_mesh", [](const Exact<Index>& faces, std::size_t n_vertices) {
        return LeastSquaresMesh(build_topology(view(faces), n_vertices));
      });
  bind_baseline<LaplacianInterpolation>(
      module, "laplacian_interpolation",
      [](const Exact<Index>& faces, std::size_t n_vertices, const std::string& objective,
         const std::string& weights, const std::optional<Positions>& reference) {
        return LaplacianInterpolation(build_topology(view(faces), n_vertices),
                                      objective_from_name(objective), weights_from_name(weights),
                                      reference ? view(*reference) : Points<const double>());
      });
  module.def("parse_number", &number_in);
  module.def("parse_obj", &py_parse_obj);
  module.def("parse_ply", &py_parse_ply);
  module.def("register", &py_register<float>);
  module.def("register", &py_register<double>);
}

}  // namespace dynmesh
