#include <algorithm>
#include <dynmesh/tracker.hpp>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "depth_images.hpp"
#include "scan.hpp"
#include "stream.hpp"
#include "tracker_docs.hpp"

namespace dynmesh {
namespace {

class AnyTracker : public AnyStream<Tracker, TrackerSettings> {
 public:
  static constexpr const char* name = "tracker";  // in messages

  AnyTracker(const py::object& faces, const py::object& first_frame, const py::kwargs& settings)
      : AnyStream(faces, first_frame, settings, name) {}

  py::object push(const py::object& points, const py::object& normals, const py::object& viewpoints,
                  const py::object& out) {
    return exclusively([&]<class Real>(Tracker<Real>& tracker) {
      const ScanArgument<Real> scan(points, normals, viewpoints);
      OutputArgument<Real> output(out, tracker.n_vertices());
      released([&] { tracker.push(scan.view(), output.view()); });
      return output.array();
    });
  }

  py::object push_depth(const py::object& depth, const py::object& intrinsics,
                        const py::object& pose, const py::object& out) {
    return exclusively([&]<class Real>(Tracker<Real>& tracker) {
      const ImagesArgument images(depth, intrinsics, pose);
      OutputArgument<Real> output(out, tracker.n_vertices());
      released([&] { tracker.push_depth(images.view(), output.view()); });
      return output.array();
    });
  }

  std::vector<Agreement> agreement_of_sensors() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) {
      const auto found = tracker.agreement_of_sensors();
      return std::vector<Agreement>(found.begin(), found.end());
    });
  }

  py::array_t<bool> observed() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) {
      const auto values = tracker.observed();
      py::array_t<bool> mask(static_cast<py::ssize_t>(values.size()));
      std::transform(values.begin(), values.end(), mask.mutable_data(),
                     [](std::uint8_t value) { return value != 0; });
      return mask;
    });
  }
};

}  // namespace

void bind_tracker(py::module_& module) {
  py::class_<Agreement>(module, "Agreement", agreement_doc)
      .def_readonly("points", &Agreement::points)
      .def_readonly("far", &Agreement::far_share)
      .def_readonly("disagreeing", &Agreement::disagreeing)
      .def_readonly("distance", &Agreement::distance)
      .def("__repr__", [](const Agreement& agreement) {
        return py::str("Agreement(points={}, far={:.4g}, disagreeing={:.4g}, distance={:.6g})")
            .format(agreement.points, agreement.far_share, agreement.disagreeing,
                    agreement.distance);
      });
  py::class_<TrackingReport, FrameReport>(module, "TrackingReport", tracking_report_doc)
      .def(report_pickle<TrackingReport>())
      .def_property_readonly("points", [](const TrackingReport& r) { return r.agreement.points; })
      .def_property_readonly("far", [](const TrackingReport& r) { return r.agreement.far_share; })
      .def_property_readonly("disagreeing",
                             [](const TrackingReport& r) { return r.agreement.disagreeing; })
      .def_property_readonly("distance",
                             [](const TrackingReport& r) { return r.agreement.distance; })
      .def_readonly("recovered", &TrackingReport::recovered)
      .def("__repr__", [](const TrackingReport& report) {
        return py::str(
                   "TrackingReport(known={}, filled={}, disconnected={}, far={:.4g}, "
                   "disagreeing={:.4g}, distance={:.6g}, recovered={}, iterations={}, "
                   "seconds={:.6f})")
            .format(report.known, report.filled, report.disconnected, report.agreement.far_share,
                    report.agreement.disagreeing, report.agreement.distance, report.recovered,
                    report.iterations, report.seconds);
      });

  const std::string doc =
      tracker_doc + ("\n" + settings_doc<TrackerSettings>()) + tracker_training_doc;
  py::class_<AnyTracker> tracker(module, "Tracker", doc.c_str());
  const std::string init_doc = init_doc_of<TrackerSettings>("Start at a template.");
  bind_stream(tracker, {init_doc.c_str(), tracker_skip_doc, tracker_reset_doc, tracker_state_doc,
                        tracker_restore_doc,
                        "(k,) int32, for the last frame: 0 for an observed vertex, the number of "
                        "edges to the nearest observed vertex for others, -1 where there is none.",
                        tracker_standard_error_doc, "The TrackingReport of the last frame.",
                        "The number of frames since construction or `reset`; `restore` restores "
                        "it."});
  tracker
      .def("push", &AnyTracker::push, py::arg("points"), py::arg("normals") = py::none(),
           py::kw_only(), py::arg("viewpoints") = py::none(), py::arg("out") = py::none(),
           tracker_push_doc)
      .def("push_depth", &AnyTracker::push_depth, py::arg("depth"), py::arg("intrinsics"),
           py::arg("pose"), py::kw_only(), py::arg("out") = py::none(), tracker_push_depth_doc)
      .def_property_readonly("observed", &AnyTracker::observed,
                             "(k,) bool: whether the vertex has a measured point in the last "
                             "frame.")
      .def_property_readonly("agreement_of_sensors", &AnyTracker::agreement_of_sensors,
                             tracker_agreement_of_sensors_doc)
      .def("__repr__", [](const AnyTracker& self) {
        return py::str("Tracker({} vertices, {} edges)").format(self.n_vertices(), self.n_edges());
      });
}

}  // namespace dynmesh
