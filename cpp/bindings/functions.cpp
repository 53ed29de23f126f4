/// Topology, metrics, baselines, alignment, registration, whole frames and summaries of training.
#include <dynmesh/alignment.hpp>
#include <dynmesh/baselines.hpp>
#include <dynmesh/metrics.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/whole_frame.hpp>
#include <optional>
#include <variant>

#include "arrays.hpp"

namespace dynmesh {
namespace {

using Release = py::call_guard<py::gil_scoped_release>;
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

template <class Real>
struct Request {
  const Exact<Index>& faces;
  const Exact<Real>& positions;
  const Exact<Index>& vertices;
  const Exact<Real>& landmarks;
  RegistrationSettings settings;
  const Training<Real>* training;

  template <class Scan>
  py::tuple registered(const Scan& scan) const {
    const Registration<Real> found = [&] {
      const py::gil_scoped_release release;
      const Landmarks<Real> pairs = {{vertices.data(), static_cast<std::size_t>(vertices.size())},
                                     view(landmarks)};
      return register_template<Real>(view(faces), view(positions), scan, pairs, settings, training);
    }();
    return py::make_tuple(array_of(found.vertices), array_of(found.observed),
                          array_of(found.standard_error), fields_of(found));
  }
};

template <class Real>
py::tuple py_whole_frame(const Exact<Index>& faces, const Exact<Real>& first, std::size_t n_frames,
                         const py::function& source, const WholeFrameSettings& settings,
                         const py::function& progress) {
  const FrameSource<Real> read = [&](std::size_t frame, Points<Real> points,
                                     std::span<std::uint8_t> known) {
    const py::gil_scoped_acquire acquire;
    const auto [given, mask] = source(frame).template cast<std::pair<Exact<Real>, Exact<bool>>>();
    std::copy_n(given.data(), 3 * points.count, points.data);
    std::copy_n(mask.data(), points.count, known.begin());
  };
  const Progress step = [&](std::size_t done, std::size_t of) {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    progress(done, of);
  };
  const WholeFrame<Real> whole = [&] {
    const py::gil_scoped_release release;
    return whole_frame<Real>(view(faces), rows_in(first), n_frames, read, settings, step);
  }();
  return py::make_tuple(array_of(whole.positions), array_of(whole.known), array_of(whole.seen),
                        array_of(whole.standard_error), whole.frame, whole.doubtful);
}

template <class Real>
void bind_functions_of(py::module_& module) {
  module.def(
      "register",
      [](const Exact<Index>& faces, const Exact<Real>& positions, const Exact<Real>& points,
         const std::optional<Exact<Real>>& normals, const std::optional<Exact<Real>>& viewpoints,
         const Exact<Index>& vertices, const Exact<Real>& landmarks, bool align, bool scale,
         const Training<Real>* training, bool uncertainty, Index threads) {
        return Request<Real>{
            faces, positions, vertices, landmarks, {align, scale, uncertainty, threads}, training}
            .registered(scan_of(points, normals, viewpoints));
      });
  module.def(
      "register", [](const Exact<Index>& faces, const Exact<Real>& positions, const Images& images,
                     const Exact<Index>& vertices, const Exact<Real>& landmarks, bool align,
                     bool scale, const Training<Real>* training, bool uncertainty, Index threads) {
        const std::vector<DepthImage> views = view(images);
        return Request<Real>{
            faces, positions, vertices, landmarks, {align, scale, uncertainty, threads}, training}
            .registered(std::span<const DepthImage>(views));
      });
  module.def("whole_frame", [](const Exact<Index>& faces, const Exact<Real>& first,
                               std::size_t n_frames, const py::function& source,
                               std::optional<std::size_t> frame, std::optional<double> noise,
                               bool outliers, Index threads, const py::function& progress) {
    return py_whole_frame(faces, first, n_frames, source, {frame, noise, outliers, threads},
                          progress);
  });
}

}  // namespace

void bind_functions(py::module_& module) {
  module.def("cells", [](const Exact<Index>& faces, std::size_t n_vertices) {
    const Cells cells = build_topology(view(faces), n_vertices).cells;
    return std::pair(array_of(cells.offsets), array_of(cells.neighbours));
  });
  module.def("nmsve", &py_nmsve, Release());
  module.def("vertex_error", &py_vertex_error, Release());
  module.def("find_alignment",
             [](const Exact<Index>& faces, const Positions& first_frame, const Positions& scan) {
               const Alignment found = [&] {
                 const py::gil_scoped_release release;
                 return find_alignment(view(faces), view(first_frame), view(scan));
               }();
               return fields_of(found);
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
  bind_functions_of<float>(module);
  bind_functions_of<double>(module);
}

}  // namespace dynmesh
