#include "training.hpp"

#include "bindings.hpp"
#include "completer/training_summary.hpp"

namespace dynmesh {
namespace {

template <class Real>
TrainingSummary summary_of(const py::object& faces, const py::array& first_frame,
                           const py::object& frames) {
  const PointsArgument<Real> frame("first_frame", first_frame, "(k, 3)");
  const FacesArgument triangles(faces, frame.view().count);
  const auto training = training_of<Real>(frames, frame.view().count);
  const py::gil_scoped_release release;
  return summarise(triangles.view(), Points<const Real>(frame.view()), training);
}

TrainingSummary training_summary(const py::object& faces, const py::object& first_frame,
                                 const py::object& frames) {
  const py::array frame = to_positions("first_frame", first_frame);
  return frame.itemsize() == sizeof(float) ? summary_of<float>(faces, frame, frames)
                                           : summary_of<double>(faces, frame, frames);
}

constexpr const char* training_summary_doc =
    R"doc(training_summary(faces, first_frame, frames)
--

What a completer with this frame 0 learns from a training sequence.

Args:
    faces: The triangles, (m, 3) integers.
    first_frame: Frame 0, (k, 3), complete and finite.
    frames: The training sequence, as Completer takes it.

Returns:
    A TrainingSummary.)doc";

constexpr const char* training_summary_class_doc =
    R"doc(What a training sequence says about a subject.

The distance of a frame is the root mean square distance of its vertices from those of frame 0,
after the rigid motion that fits it best, in the unit of the positions.

Attributes:
    frames: The number of frames.
    variance_held: The share of the variance of shape that the global modes hold, from 0 to 1.
    rms_distance: The root mean square of the distances of the frames.
    largest_distance: The distance of the farthest frame.)doc";

}  // namespace

void bind_training(py::module_& module) {
  py::class_<TrainingSummary>(module, "TrainingSummary", training_summary_class_doc)
      .def_readonly("frames", &TrainingSummary::frames)
      .def_readonly("variance_held", &TrainingSummary::variance_held)
      .def_readonly("rms_distance", &TrainingSummary::rms_distance)
      .def_readonly("largest_distance", &TrainingSummary::largest_distance);
  module.def("training_summary", &training_summary, py::arg("faces"), py::arg("first_frame"),
             py::arg("frames"), training_summary_doc);
}

}  // namespace dynmesh
