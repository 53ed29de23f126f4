#include <algorithm>
#include <array>
#include <dynmesh/tracker.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "completer/one_at_a_time.hpp"
#include "scalars.hpp"
#include "tracker_docs.hpp"
#include "training.hpp"

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

/// A Python class for both precisions; see AnyCompleter.
class AnyTracker {
  template <class Call>
  static void released(const Call& call) {
    const py::gil_scoped_release release;
    call();
  }

  template <class Call>
  auto exclusively(const Call& call) {
    return turns_.enter(
        [&] { return std::visit([&](auto& tracker) { return call(*tracker); }, tracker_); });
  }

  template <class Real>
  void construct(const IndicesArgument& faces, const py::array& first_frame,
                 const TrackerSettings& settings, const py::object& training) {
    const PointsArgument<Real> frame("first_frame", first_frame, "(k, 3)");
    if (training.is_none()) {
      released([&] {
        tracker_ = std::make_unique<Tracker<Real>>(faces.faces(), frame.view(), settings);
      });
    } else {
      const auto trained = training_of<Real>(training, frame.view().count);
      released([&] {
        tracker_ = std::make_unique<Tracker<Real>>(faces.faces(), frame.view(), settings, trained);
      });
    }
  }

 public:
  AnyTracker(const py::object& faces, const py::object& first_frame, const py::object& threads,
             const py::object& training, const py::object& uncertainty) {
    const IndicesArgument indices("faces", faces, 3, "(m, 3)");
    const py::array frame = to_array("first_frame", first_frame);
    check_floating("first_frame", frame);
    const TrackerSettings settings = {.threads = integer_argument("threads", threads),
                                      .uncertainty = truth_argument("uncertainty", uncertainty)};
    if (frame.itemsize() == sizeof(float)) {
      construct<float>(indices, frame, settings, training);
    } else {
      construct<double>(indices, frame, settings, training);
    }
  }

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

  py::object skip(const py::object& out) {
    return exclusively([&]<class Real>(Tracker<Real>& tracker) {
      OutputArgument<Real> output(out, tracker.n_vertices());
      released([&] { tracker.skip(output.view()); });
      return output.array();
    });
  }

  void reset(const py::object& frame) {
    exclusively([&]<class Real>(Tracker<Real>& tracker) {
      const PointsArgument<Real> given("frame", frame, "(k, 3)");
      released([&] { tracker.reset(given.view()); });
    });
  }

  py::bytes state() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) {
      const auto bytes = tracker.state();
      return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    });
  }

  void restore(const py::object& state) {
    const BytesArgument bytes("state", state);
    exclusively([&]<class Real>(Tracker<Real>& tracker) { tracker.restore(bytes.view()); });
  }

  py::array_t<Index> generation() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) {
      const auto values = tracker.generation();
      return py::array_t<Index>(static_cast<py::ssize_t>(values.size()), values.data());
    });
  }
  py::array_t<Index> age() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) {
      const auto values = tracker.age();
      return py::array_t<Index>(static_cast<py::ssize_t>(values.size()), values.data());
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
  py::array standard_error() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) -> py::array {
      const std::span<const Real> values = tracker.standard_error();
      return py::array_t<Real>(static_cast<py::ssize_t>(values.size()), values.data());
    });
  }
  TrackingReport report() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) { return tracker.report(); });
  }
  std::size_t n_frames() {
    return exclusively([]<class Real>(Tracker<Real>& tracker) { return tracker.n_frames(); });
  }

  // Properties that never change can be read at any time.
  [[nodiscard]] TopologyReport topology() const {
    return std::visit([](const auto& tracker) { return tracker->topology(); }, tracker_);
  }
  [[nodiscard]] std::size_t n_vertices() const {
    return std::visit([](const auto& tracker) { return tracker->n_vertices(); }, tracker_);
  }
  [[nodiscard]] std::size_t n_edges() const {
    return std::visit([](const auto& tracker) { return tracker->n_edges(); }, tracker_);
  }
  [[nodiscard]] py::dtype dtype() const {
    return std::holds_alternative<std::unique_ptr<Tracker<float>>>(tracker_)
               ? py::dtype::of<float>()
               : py::dtype::of<double>();
  }

 private:
  std::variant<std::unique_ptr<Tracker<float>>, std::unique_ptr<Tracker<double>>> tracker_;
  OneAtATime turns_{"tracker"};
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

  py::class_<AnyTracker>(module, "Tracker", tracker_doc)
      .def(py::init([](const py::object& faces, const py::object& first_frame,
                       const py::object& threads, const py::object& training,
                       const py::object& uncertainty) {
             return std::make_unique<AnyTracker>(faces, first_frame, threads, training,
                                                 uncertainty);
           }),
           py::arg("faces"), py::arg("first_frame"), py::kw_only(), py::arg("threads") = 1,
           py::arg("training") = py::none(), py::arg("uncertainty") = false, tracker_init_doc)
      .def("push", &AnyTracker::push, py::arg("points"), py::arg("normals") = py::none(),
           py::kw_only(), py::arg("viewpoints") = py::none(), py::arg("out") = py::none(),
           tracker_push_doc)
      .def("push_depth", &AnyTracker::push_depth, py::arg("depth"), py::arg("intrinsics"),
           py::arg("pose"), py::kw_only(), py::arg("out") = py::none(), tracker_push_depth_doc)
      .def("skip", &AnyTracker::skip, py::kw_only(), py::arg("out") = py::none(), tracker_skip_doc)
      .def("reset", &AnyTracker::reset, py::arg("frame"), tracker_reset_doc)
      .def("state", &AnyTracker::state, tracker_state_doc)
      .def("restore", &AnyTracker::restore, py::arg("state"), tracker_restore_doc)
      .def_property_readonly("observed", &AnyTracker::observed,
                             "(k,) bool: whether the vertex has a measured point in the last "
                             "frame.")
      .def_property_readonly("generation", &AnyTracker::generation,
                             "(k,) int32, for the last frame: 0 for an observed vertex, g for one "
                             "that g edges separate from it, -1 where there is none.")
      .def_property_readonly("age", &AnyTracker::age,
                             "(k,) int32: the number of frames since the vertex was last observed.")
      .def_property_readonly("standard_error", &AnyTracker::standard_error,
                             tracker_standard_error_doc)
      .def_property_readonly("report", &AnyTracker::report, "The TrackingReport of the last frame.")
      .def_property_readonly("topology", &AnyTracker::topology, "The TopologyReport of the mesh.")
      .def_property_readonly("n_frames", &AnyTracker::n_frames,
                             "The number of frames since construction or `reset`; `restore` "
                             "restores it.")
      .def_property_readonly("n_vertices", &AnyTracker::n_vertices, "The number of vertices, k.")
      .def_property_readonly("n_edges", &AnyTracker::n_edges, "The number of edges of the mesh.")
      .def_property_readonly("dtype", &AnyTracker::dtype,
                             "float32 or float64, the dtype of first_frame.")
      .def("__repr__", [](const AnyTracker& tracker) {
        return py::str("Tracker({} vertices, {} edges)")
            .format(tracker.n_vertices(), tracker.n_edges());
      });
}

}  // namespace dynmesh
