#include <pybind11/stl.h>

#include <dynmesh/completer.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "arrays.hpp"
#include "bindings.hpp"
#include "completer/one_at_a_time.hpp"
#include "completer/settings_table.hpp"
#include "rehearsal.hpp"
#include "scalars.hpp"

namespace dynmesh {
namespace {

bool value_of(const char* name, const bool& /*old*/, py::handle given) {
  return truth_argument(name, given);
}
Index value_of(const char* name, const Index& /*old*/, py::handle given) {
  return integer_argument(name, given);
}
std::optional<double> value_of(const char* name, const std::optional<double>& /*old*/,
                               py::handle given) {
  if (given.is_none()) return std::nullopt;
  return number_argument(name, given);
}
template <class Enumeration>
Enumeration value_of(const char* name, const Enumeration& /*old*/, py::handle given) {
  return from_name<Enumeration>(name, text_argument(name, given));
}

constexpr const char* rehearsal_name = "rehearsal";  // the argument beside the settings

template <class Value>
py::object python_value(const Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    return py::str(names_of<Value>[static_cast<std::size_t>(value)]);
  } else {
    return py::cast(value);
  }
}

Settings settings_of(const py::kwargs& given) {
  Settings settings;
  std::size_t n_taken = given.contains(rehearsal_name) ? 1 : 0;
  try {
    for_each_setting([&](const Setting& setting, auto member) {
      if (!given.contains(setting.name)) return;
      settings.*member = value_of(setting.name, settings.*member, given[setting.name]);
      ++n_taken;
    });
  } catch (const ValueRefused& error) {
    throw SettingError(error.argument(), error.reason());
  }
  // Continue with the overload that refuses calls: see calls.cpp.
  if (n_taken < given.size()) throw py::reference_cast_error();
  return settings;
}

py::object rehearsal_in(const py::kwargs& given) {
  return given.contains(rehearsal_name) ? py::object(given[rehearsal_name]) : py::none();
}

/// Raises a SettingError of C++ as that of dynmesh._errors, with the setting as an attribute.
void translate_setting_error(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(std::move(thrown));
  } catch (const SettingError& error) {
    const py::object kind = py::module_::import("dynmesh._errors").attr("SettingError");
    const py::object raised = kind(error.reason(), py::arg("argument") = error.setting());
    PyErr_SetObject(kind.ptr(), raised.ptr());
  }
}

/// A Python class for both precisions. Python may call it from any thread while another thread is
/// using it with the GIL released, which Completer does not allow. Such calls are refused.
class AnyCompleter {
  template <class Real>
  void construct(const IndicesArgument& faces, const py::array& first_frame,
                 const Settings& settings, const py::object& rehearsal) {
    const PointsArgument<Real> frame("first_frame", first_frame, "(k, 3)");
    if (rehearsal.is_none()) {
      const py::gil_scoped_release release;
      completer_ = std::make_unique<Completer<Real>>(faces.faces(), frame.view(), settings);
    } else {
      const auto rehearsed = rehearsal_of<Real>(rehearsal, frame.view().count);
      const py::gil_scoped_release release;
      completer_ =
          std::make_unique<Completer<Real>>(faces.faces(), frame.view(), settings, rehearsed);
    }
  }

  template <class Call>
  static void released(const Call& call) {
    const py::gil_scoped_release release;
    call();
  }

  template <class Call>
  auto exclusively(const Call& call) {
    return turns_.enter(
        [&] { return std::visit([&](auto& completer) { return call(*completer); }, completer_); });
  }

  static py::array_t<Index> copy(std::span<const Index> values) {
    return py::array_t<Index>(static_cast<py::ssize_t>(values.size()), values.data());
  }

 public:
  AnyCompleter(const py::object& faces, const py::object& first_frame, const Settings& settings,
               const py::object& rehearsal) {
    const IndicesArgument indices("faces", faces, 3, "(m, 3)");
    const py::array frame = to_array("first_frame", first_frame);
    check_floating("first_frame", frame);
    if (frame.itemsize() == sizeof(float)) {
      construct<float>(indices, frame, settings, rehearsal);
    } else {
      construct<double>(indices, frame, settings, rehearsal);
    }
  }

  py::object push(const py::object& points, const py::object& known, const py::object& out) {
    return exclusively([&]<class Real>(Completer<Real>& completer) {
      const PointsArgument<Real> given("points", points, "(k, 3)");
      OutputArgument<Real> output(out, completer.n_vertices());
      if (known.is_none()) {
        released([&] { completer.push(given.view(), output.view()); });
      } else {
        const KnownArgument mask(known);
        released([&] { completer.push(given.view(), mask.view(), output.view()); });
      }
      return output.array();
    });
  }

  py::object push_sparse(const py::object& indices, const py::object& points,
                         const py::object& out) {
    return exclusively([&]<class Real>(Completer<Real>& completer) {
      const IndicesArgument observed("indices", indices, 0, "(n,)");
      const PointsArgument<Real> given("points", points, "(n, 3)");
      OutputArgument<Real> output(out, completer.n_vertices());
      released([&] { completer.push_sparse(observed.view(), given.view(), output.view()); });
      return output.array();
    });
  }

  py::object skip(const py::object& out) {
    return exclusively([&]<class Real>(Completer<Real>& completer) {
      OutputArgument<Real> output(out, completer.n_vertices());
      released([&] { completer.skip(output.view()); });
      return output.array();
    });
  }

  void reset(const py::object& frame) {
    exclusively([&]<class Real>(Completer<Real>& completer) {
      const PointsArgument<Real> given("frame", frame, "(k, 3)");
      released([&] { completer.reset(given.view()); });
    });
  }

  py::bytes state() {
    return exclusively([]<class Real>(Completer<Real>& completer) {
      const auto bytes = completer.state();
      return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    });
  }

  void restore(const py::object& state) {
    exclusively([&]<class Real>(Completer<Real>& completer) {
      if (PyObject_CheckBuffer(state.ptr()) == 0) {
        throw py::type_error("state: must be bytes, not " + type_name(state));
      }
      const py::buffer_info buffer = py::reinterpret_borrow<py::buffer>(state).request();
      if (buffer.itemsize != 1 || buffer.ndim != 1 || buffer.strides[0] != 1) {
        throw py::type_error("state: must be contiguous bytes");
      }
      completer.restore(
          {static_cast<const std::byte*>(buffer.ptr), static_cast<std::size_t>(buffer.size)});
    });
  }

  py::array_t<Index> generation() {
    return exclusively(
        []<class Real>(Completer<Real>& completer) { return copy(completer.generation()); });
  }
  py::array_t<Index> age() {
    return exclusively(
        []<class Real>(Completer<Real>& completer) { return copy(completer.age()); });
  }
  FrameReport report() {
    return exclusively([]<class Real>(Completer<Real>& completer) { return completer.report(); });
  }

  std::size_t n_frames() {
    return exclusively([]<class Real>(Completer<Real>& completer) { return completer.n_frames(); });
  }

  // Properties that never change can be read at any time.
  [[nodiscard]] py::dict settings() const {
    py::dict found;
    const Settings& chosen = std::visit(
        [](const auto& completer) -> const Settings& { return completer->settings(); }, completer_);
    for_each_setting([&](const Setting& setting, auto member) {
      found[setting.name] = python_value(chosen.*member);
    });
    return found;
  }
  [[nodiscard]] std::size_t n_edges() const {
    return std::visit([](const auto& completer) { return completer->n_edges(); }, completer_);
  }
  [[nodiscard]] TopologyReport topology() const {
    return std::visit([](const auto& completer) { return completer->topology(); }, completer_);
  }
  [[nodiscard]] std::size_t n_vertices() const {
    return std::visit([](const auto& completer) { return completer->n_vertices(); }, completer_);
  }
  [[nodiscard]] py::dtype dtype() const {
    return std::holds_alternative<std::unique_ptr<Completer<float>>>(completer_)
               ? py::dtype::of<float>()
               : py::dtype::of<double>();
  }

 private:
  std::variant<std::unique_ptr<Completer<float>>, std::unique_ptr<Completer<double>>> completer_;
  OneAtATime turns_;
};

/// The words are made in Python, by a module that is only imported if a completer is shown.
py::object in_words(const char* function, const py::object& completer) {
  return py::module_::import("dynmesh.draw.notebook").attr(function)(completer);
}

constexpr const char* completer_doc =
    R"doc(Completes a dynamic mesh, one frame at a time.

    completer = dynmesh.Completer(faces, first_frame)
    for points, known in sensor:
        frame = completer.push(points, known)

Each frame is completed from the frame itself and earlier frames only. `push`, `push_sparse` and
`skip` return the completed frame, an array (k, 3) with the dtype of `first_frame`. Known vertices
are returned exactly as given, and all others are estimated. With `noise`, known vertices move as
well; vertices rejected by `reject_outliers` are estimated. These methods release the GIL. Bad input
raises ValueError, or TypeError for a wrong type, with a message that says what is wrong, where, and
with which value. The completer is then unchanged.

A completer may be used by one thread at a time. A call while another thread is using it raises
RuntimeError.

Args:
    faces: The triangles, (m, 3) integers. Faces that a half-edge mesh cannot represent are listed
        in `topology`; their edges still count.
    first_frame: Frame 0, (k, 3) float32 or float64, complete and finite. Later positions are
        converted to its dtype. When float64 is converted to float32, a finite number out of range
        becomes the largest float32 of its sign; a known position with such a coordinate is refused
        as too large and does not count as missing.
    method: "motion", the default, averages motion vectors as in the paper (Arvanitis et al. 2017,
        section 3). "detail" preserves the shape of frame 0 and of the last frame, rotated with the
        motion. Its error is a fraction of that of "motion", but a frame takes milliseconds instead
        of tenths of a millisecond. Both are described in docs/method.md.
    revisit: If True, the default, every iteration estimates all satellites reached so far. If
        False, each satellite is estimated once, and errors accumulate from frame to frame. "detail"
        requires True.
    extra_iterations: The number of iterations after the one that reaches the last satellite, from
        0, the default, to 1 000 000. They have no effect without `revisit`. "detail" requires 0.
    unseen: How vertices are completed that are not connected to any known vertex. "follow", the
        default: their component moves rigidly, with the nearest surface. "hold": they keep their
        previous positions.
    noise: The standard deviation of the known positions, positive and in the unit of the
        positions. Known vertices then move as well, according to the shape around them. With None,
        the default, known positions are exact. Requires "detail".
    reject_outliers: If True, known vertices whose motion contradicts that of the known vertices
        around them are treated as unknown, estimated, and counted as `report.rejected`. The default
        is False. Requires "detail".
    threads: The number of threads that may work on a frame, from 1, the default, to 256. They are
        used for meshes of 23 553 vertices or more, and with "detail" of 5 889 or more; smaller
        meshes are completed by the calling thread alone. Without `revisit`, threads are only used
        to read and write positions. Results are identical for any number of threads. Whether more
        threads are faster depends on the machine and the mesh.
    rehearsal: Complete frames of the same mesh, of this subject or one like it: an array (n, k, 3)
        or any iterable of at least three frames, of which at most 75 are kept. From them, "detail"
        learns how the shape of the subject varies, which makes hidden parts several times more
        accurate. A rehearsal that does not help is noticed and not used. Requires "detail".)doc";

constexpr const char* init_doc =
    R"doc(__init__(self, faces, first_frame, *, method="motion", revisit=True, extra_iterations=0,
         unseen="follow", noise=None, reject_outliers=False, threads=1, rehearsal=None)
--

Start at a complete frame.)doc";

constexpr const char* push_doc = R"doc(push(self, points, known=None, *, out=None)
--

Complete the next frame.

Args:
    points: Positions, (k, 3) float32 or float64 with any strides. Rows that are not known are
        ignored.
    known: The known mask, (k,) bool: True for vertices that were observed. If None, rows of
        `points` that are not finite are missing, and all others are known.
    out: An array (k, 3) of the completer's dtype to which the completed frame is written. It may be
        `points` itself, but must not overlap the input in any other way. If None, a new array is
        allocated.

Returns:
    The completed frame, (k, 3): `out`, or the new array.)doc";

constexpr const char* push_sparse_doc = R"doc(push_sparse(self, indices, points, *, out=None)
--

Complete the next frame from the observed vertices only.

Args:
    indices: The observed vertices, (n,) integers, in any order and without duplicates.
    points: Their positions, (n, 3).
    out: See `push`.

Returns:
    The completed frame, (k, 3).)doc";

constexpr const char* skip_doc = R"doc(skip(self, *, out=None)
--

Complete a frame in which no vertex was observed.

Args:
    out: See `push`.

Returns:
    The completed frame, (k, 3).)doc";

constexpr const char* reset_doc = R"doc(reset(self, frame)
--

Start again with a new frame 0.

Args:
    frame: The new frame 0, (k, 3), complete and finite.)doc";

constexpr const char* state_doc = R"doc(state(self)
--

Return everything that later frames depend on, to be stored or sent.

Returns:
    Little-endian bytes for `restore`. They contain no times, so completers that received the same
        frames have identical states.)doc";

constexpr const char* restore_doc = R"doc(restore(self, state)
--

Continue from a state, with the same results.

The seconds of `report` become 0.

Args:
    state: The bytes that `state` returned, from a completer with the same faces, dtype and
        settings, on any machine.)doc";

constexpr const char* frame_report_doc = R"doc(Statistics of one frame.

Attributes:
    known: The number of vertices that were observed.
    filled: The number of vertices that the method estimated.
    unseen: The number of vertices not connected to a known one. known + filled + unseen = k.
    iterations: The number of iterations of the method.
    rejected: The number of vertices that were observed but rejected as outliers.
    seconds: The wall time of the completion.
    blend: b of method "detail", the weight of the shape of frame 0; 0 for "motion".
    trust: With a rehearsal, how far its poses are used, from 0 to 1; else 0.
    explained: With a rehearsal, the share of the residual that its pose explains; else 0.
    factor_seconds, rotation_seconds, solve_seconds: The times of the stages of "detail"; 0 for
        "motion".)doc";

}  // namespace

void bind_completer(py::module_& module) {
  py::register_local_exception_translator(&translate_setting_error);
  py::class_<FrameReport>(module, "FrameReport", frame_report_doc)
      .def_readonly("known", &FrameReport::known)
      .def_readonly("filled", &FrameReport::filled)
      .def_readonly("unseen", &FrameReport::unseen)
      .def_readonly("iterations", &FrameReport::iterations)
      .def_readonly("rejected", &FrameReport::rejected)
      .def_readonly("seconds", &FrameReport::seconds)
      .def_property_readonly("blend", [](const FrameReport& r) { return r.stages.blend; })
      .def_property_readonly("trust", [](const FrameReport& r) { return r.stages.trust; })
      .def_property_readonly("explained", [](const FrameReport& r) { return r.stages.explained; })
      .def_property_readonly("factor_seconds",
                             [](const FrameReport& r) { return r.stages.factor_seconds; })
      .def_property_readonly("rotation_seconds",
                             [](const FrameReport& r) { return r.stages.rotation_seconds; })
      .def_property_readonly("solve_seconds",
                             [](const FrameReport& r) { return r.stages.solve_seconds; })
      .def("__repr__", [](const FrameReport& report) {
        return py::str(
                   "FrameReport(known={}, filled={}, unseen={}, rejected={}, iterations={}, "
                   "seconds={:.6f})")
            .format(report.known, report.filled, report.unseen, report.rejected, report.iterations,
                    report.seconds);
      });

  py::class_<AnyCompleter>(module, "Completer", completer_doc)
      .def(py::init([](const py::object& faces, const py::object& first_frame,
                       const py::kwargs& settings) {
             return std::make_unique<AnyCompleter>(faces, first_frame, settings_of(settings),
                                                   rehearsal_in(settings));
           }),
           py::arg("faces"), py::arg("first_frame"), init_doc)
      .def("push", &AnyCompleter::push, py::arg("points"), py::arg("known") = py::none(),
           py::kw_only(), py::arg("out") = py::none(), push_doc)
      .def("push_sparse", &AnyCompleter::push_sparse, py::arg("indices"), py::arg("points"),
           py::kw_only(), py::arg("out") = py::none(), push_sparse_doc)
      .def("skip", &AnyCompleter::skip, py::kw_only(), py::arg("out") = py::none(), skip_doc)
      .def("reset", &AnyCompleter::reset, py::arg("frame"), reset_doc)
      .def("state", &AnyCompleter::state, state_doc)
      .def("restore", &AnyCompleter::restore, py::arg("state"), restore_doc)
      .def_property_readonly(
          "generation", &AnyCompleter::generation,
          "(k,) int32, for the last frame: 0 for an anchor, g for a satellite of generation "
          "g, -1 for an unseen vertex.")
      .def_property_readonly("age", &AnyCompleter::age,
                             "(k,) int32: the number of frames since the vertex was last observed.")
      .def_property_readonly("report", &AnyCompleter::report, "The FrameReport of the last frame.")
      .def_property_readonly("topology", &AnyCompleter::topology, "The TopologyReport of the mesh.")
      .def_property_readonly("settings", &AnyCompleter::settings,
                             "dict: All settings with their values, by name.")
      .def_property_readonly("n_frames", &AnyCompleter::n_frames,
                             "The number of frames completed since construction or `reset`; "
                             "`restore` restores it.")
      .def_property_readonly("n_vertices", &AnyCompleter::n_vertices, "The number of vertices, k.")
      .def_property_readonly("n_edges", &AnyCompleter::n_edges, "The number of edges of the mesh.")
      .def_property_readonly("dtype", &AnyCompleter::dtype,
                             "float32 or float64, the dtype of first_frame.")
      .def("__repr__", [](const py::object& self) { return in_words("completer_line", self); })
      .def(
          "_repr_html_", [](const py::object& self) { return in_words("completer_shown", self); },
          "_repr_html_(self)\n--\n\nShow the completer in a notebook.");
}

}  // namespace dynmesh
