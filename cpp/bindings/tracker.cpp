#include <algorithm>
#include <array>
#include <dynmesh/tracker.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "stream.hpp"
#include "tracker_docs.hpp"

namespace dynmesh {
namespace {

/// The depth images of a frame, with the arrays that they view.
class ImagesArgument {
 public:
  ImagesArgument(const py::object& depth, const py::object& intrinsics, const py::object& pose) {
    const auto images = several("depth", depth, 2);
    const auto cameras = several("intrinsics", intrinsics, 2);
    const auto poses = several("pose", pose, 2);
    for (const auto& [name, count] :
         {std::pair{"intrinsics", cameras.size()}, std::pair{"pose", poses.size()}}) {
      if (count == images.size()) continue;
      throw py::value_error(std::string(name) + ": there are " + std::to_string(count) + ", but " +
                            std::to_string(images.size()) + " depth images");
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto array = floating("depth", images[i]);
      check_shape("depth", array, 2, 0, "(h, w)");
      const auto& pixels = pixels_.emplace_back(Pixels(array));
      DepthImage image;
      image.data = pixels.data();
      image.height = static_cast<std::size_t>(pixels.shape(0));
      image.width = static_cast<std::size_t>(pixels.shape(1));
      image.row_stride = pixels.shape(1);
      fill("intrinsics", cameras[i], 3, image.intrinsics);
      fill("pose", poses[i], 4, image.pose);
      views_.push_back(image);
    }
  }
  [[nodiscard]] std::span<const DepthImage> view() const { return views_; }

 private:
  using Pixels = py::array_t<float, py::array::c_style | py::array::forcecast>;

  /// One array is that of one camera; a list or a stack has one for each.
  static std::vector<py::object> several(const char* name, const py::object& given,
                                         py::ssize_t axes) {
    const bool is_array = py::isinstance<py::array>(given);
    if (is_array && py::reinterpret_borrow<py::array>(given).ndim() <= axes) return {given};
    if (!is_array && !py::isinstance<py::list>(given) && !py::isinstance<py::tuple>(given)) {
      throw py::type_error(std::string(name) + ": must be an array, or a list of arrays, not " +
                           type_name(given));
    }
    std::vector<py::object> found;
    for (const auto& item : given) found.push_back(py::reinterpret_borrow<py::object>(item));
    return found;
  }

  static py::array floating(const char* name, const py::object& object) {
    const auto array = to_array(name, object);
    if (array.dtype().kind() != 'f') {
      throw py::type_error(std::string(name) +
                           ": must be float32 or float64, in the unit of the "
                           "template, not " +
                           dtype_name(array) +
                           (array.dtype().kind() == 'u' || array.dtype().kind() == 'i'
                                ? "; multiply the counts of a sensor by the depth of one count"
                                : ""));
    }
    return array;
  }

  template <std::size_t size>
  static void fill(const char* name, const py::object& object, py::ssize_t rows,
                   std::array<double, size>& values) {
    const auto array = to_array(name, object);
    if (array.dtype().kind() != 'f' && array.dtype().kind() != 'i') {
      throw py::type_error(std::string(name) + ": must be numbers, not " + dtype_name(array));
    }
    const bool is_square = array.ndim() == 2 && array.shape(0) == rows && array.shape(1) == rows;
    if (!is_square) {
      const std::string side = std::to_string(rows);
      throw py::value_error(std::string(name) + ": must have shape (" + side + ", " + side +
                            "), not " + std::string(py::str(array.attr("shape"))));
    }
    const auto wide = py::array_t<double, py::array::c_style | py::array::forcecast>(array);
    std::copy_n(wide.data(), size, values.begin());
  }

  std::vector<Pixels> pixels_;
  std::vector<DepthImage> views_;
};

class AnyTracker : public AnyStream<Tracker, TrackerSettings> {
 public:
  AnyTracker(const py::object& faces, const py::object& first_frame, const py::kwargs& settings)
      : AnyStream(faces, first_frame, settings, "tracker") {}

  py::object push(const py::object& points, const py::object& normals, const py::object& viewpoints,
                  const py::object& out) {
    return exclusively([&]<class Real>(Tracker<Real>& tracker) {
      const PointsArgument<Real> given("points", points, "(n, 3)");
      Scan<Real> scan = {given.view()};
      std::optional<PointsArgument<Real>> directions;
      std::optional<PointsArgument<Real>> sensors;
      if (!normals.is_none()) {
        scan.normals = directions.emplace("normals", normals, "(n, 3)").view();
        // An empty array may have no memory, and null would mean that there are no normals.
        if (scan.normals.count != scan.points.count) {
          throw py::value_error("normals: has " + std::to_string(scan.normals.count) +
                                " rows, but points has " + std::to_string(scan.points.count));
        }
      }
      if (!viewpoints.is_none()) {
        scan.viewpoints = sensors.emplace("viewpoints", viewpoints, "(c, 3)").view();
      }
      OutputArgument<Real> output(out, tracker.n_vertices());
      released([&] { tracker.push(scan, output.view()); });
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
  py::class_<TrackingReport, FrameReport>(module, "TrackingReport", tracking_report_doc)
      .def_readonly("distance", &TrackingReport::distance)
      .def_readonly("aligned", &TrackingReport::aligned)
      .def("__repr__", [](const TrackingReport& report) {
        return py::
            str("TrackingReport(known={}, filled={}, disconnected={}, distance={:.6g}, aligned={}, "
                "iterations={}, seconds={:.6f})")
                .format(report.known, report.filled, report.disconnected, report.distance,
                        report.aligned, report.iterations, report.seconds);
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
      .def("__repr__", [](const AnyTracker& self) {
        return py::str("Tracker({} vertices, {} edges)").format(self.n_vertices(), self.n_edges());
      });
}

}  // namespace dynmesh
