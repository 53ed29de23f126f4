#include <dynmesh/whole_frame.hpp>
#include <string>
#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"

namespace dynmesh {
namespace {

/// Copies what the Python function `source` returns for a frame: the points, (k, 3), and the known
/// mask, (k,).
template <class Real>
void read(const py::object& source, std::size_t frame, Points<Real> points,
          std::span<std::uint8_t> known) {
  const py::gil_scoped_acquire acquire;
  const py::tuple returned = source(frame);
  const std::string name = "frame " + std::to_string(frame) + ": points";
  const PointsArgument<Real> given(name.c_str(), returned[0], "(k, 3)");
  const KnownArgument mask(returned[1]);
  if (given.view().count != points.count || mask.view().count != points.count) {
    throw py::value_error("frame " + std::to_string(frame) + ": has " +
                          std::to_string(given.view().count) + " rows and a mask of " +
                          std::to_string(mask.view().count) + ", but frame 0 has " +
                          std::to_string(points.count) + " vertices");
  }
  for (std::size_t v = 0; v < points.count; ++v) {
    known[v] = mask.view()[v] ? 1 : 0;
    for (std::size_t c = 0; c < 3; ++c) points(v, c) = given.view()(v, c);
  }
}

template <class Real>
py::tuple whole_frame_of(const FacesArgument& faces, std::size_t n_vertices, std::size_t n_frames,
                         const py::object& source, const WholeFrameSettings& settings,
                         const py::object& progress) {
  const FrameSource<Real> read_one = [&](std::size_t frame, Points<Real> points,
                                         std::span<std::uint8_t> known) {
    read(source, frame, points, known);
  };
  const Progress step = [&](std::size_t done, std::size_t of) {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!progress.is_none()) progress(done, of);
  };
  WholeFrame<Real> whole;
  {
    const py::gil_scoped_release release;
    whole = whole_frame<Real>(faces.view(), n_vertices, n_frames, read_one, settings, step);
  }
  return py::make_tuple(array_of(whole.positions), array_of(whole.known), array_of(whole.seen),
                        array_of(whole.standard_error), whole.frame, whole.doubtful);
}

py::tuple py_whole_frame(const py::object& faces, const py::object& source,
                         const py::object& n_frames, const py::object& frame,
                         const py::object& noise, const py::object& outliers,
                         const py::object& threads, const py::object& progress) {
  WholeFrameSettings settings;
  if (!frame.is_none()) settings.frame = count_argument("frame", frame);
  if (!noise.is_none()) settings.noise = number_argument("noise", noise);
  settings.outliers = truth_argument("outliers", outliers);
  settings.threads = integer_argument("threads", threads);
  const py::tuple first = source(0);
  const py::array points = to_positions("points", first[0]);
  check_shape("points", points, 2, 3, "(k, 3)");
  const auto k = static_cast<std::size_t>(points.shape(0));
  const FacesArgument triangles(faces, k);
  const std::size_t n = count_argument("n_frames", n_frames);
  return points.itemsize() == sizeof(float)
             ? whole_frame_of<float>(triangles, k, n, source, settings, progress)
             : whole_frame_of<double>(triangles, k, n, source, settings, progress);
}

constexpr const char* whole_frame_doc =
    R"doc(whole_frame(faces, source, n_frames, frame, noise, outliers, threads, progress)
--

Put a whole frame together; dynmesh.whole_frame is the function for users.

Args:
    faces: The triangles, (m, 3) integers.
    source: Called with the number of a frame, ascending twice; returns its points, (k, 3) float32
        or float64, and its known mask, (k,) bool. Frame 0 is asked for once more at first.
    n_frames: The number of frames.
    frame: The number of the frame to be made whole, or None for the one that knows most.
    noise: The standard deviation of the noise, or None.
    outliers: Whether outliers are left out.
    threads: The number of threads.
    progress: Called with the steps that are done and their number, or None.

Returns:
    The positions, (3 k,), the masks of the vertices that are known in this frame and in any frame,
    (k,) uint8, the standard errors, (k,), the number of the frame, and whether the result is
    doubtful.)doc";

}  // namespace

void bind_whole_frame(py::module_& module) {
  module.def("whole_frame", &py_whole_frame, py::arg("faces"), py::arg("source"),
             py::arg("n_frames"), py::arg("frame"), py::arg("noise"), py::arg("outliers"),
             py::arg("threads"), py::arg("progress"), whole_frame_doc);
}

}  // namespace dynmesh
