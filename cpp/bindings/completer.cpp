#include <dynmesh/completer.hpp>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "arrays.hpp"
#include "bindings.hpp"
#include "completer/one_at_a_time.hpp"
#include "scalars.hpp"

namespace dynmesh {
namespace {

Settings settings_of(const py::object& method, const py::object& revisit,
                     const py::object& extra_iterations, const py::object& unseen,
                     const py::object& noise, const py::object& reject_outliers,
                     const py::object& threads) {
  Settings settings;
  try {
    settings.method = method_from_name(text_argument("method", method));
    settings.revisit = truth_argument("revisit", revisit);
    settings.extra_iterations = integer_argument("extra_iterations", extra_iterations);
    settings.unseen = unseen_rule_from_name(text_argument("unseen", unseen));
    if (!noise.is_none()) settings.noise = number_argument("noise", noise);
    settings.reject_outliers = truth_argument("reject_outliers", reject_outliers);
    settings.threads = integer_argument("threads", threads);
  } catch (const ValueRefused& error) {
    throw SettingError(error.argument(), error.reason());
  }
  return settings;
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

/// One Python class for both precisions. Python may call from any thread while another thread is
/// inside with the GIL released, which Completer does not allow: such a call is refused.
class AnyCompleter {
  template <class Real>
  void construct(const IndicesArgument& faces, const py::array& first_frame,
                 const Settings& settings) {
    const PointsArgument<Real> frame("first_frame", first_frame, "(k, 3)");
    const py::gil_scoped_release release;
    completer_ = std::make_unique<Completer<Real>>(faces.faces(), frame.view(), settings);
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
  AnyCompleter(const py::object& faces, const py::object& first_frame, const Settings& settings) {
    const IndicesArgument indices("faces", faces, 3, "(m, 3)");
    const py::array frame = to_array("first_frame", first_frame);
    check_floating("first_frame", frame);
    if (frame.itemsize() == sizeof(float)) {
      construct<float>(indices, frame, settings);
    } else {
      construct<double>(indices, frame, settings);
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
      const IndicesArgument places("indices", indices, 0, "(n,)");
      const PointsArgument<Real> given("points", points, "(n, 3)");
      OutputArgument<Real> output(out, completer.n_vertices());
      released([&] { completer.push_sparse(places.view(), given.view(), output.view()); });
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
        throw py::type_error("state: must be bytes, in one piece");
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

  // What never changes needs no exclusion.
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

constexpr const char* completer_doc =
    R"doc(Completes a dynamic mesh, one frame at a time.

    completer = dynmesh.Completer(faces, first_frame)
    for points, known in sensor:
        frame = completer.push(points, known)

Each frame is completed from itself and the past alone. Calls that take a frame return the completed
one, (k, 3) of the dtype of `first_frame`: known vertices exactly as given, everything else
estimated; with `noise` known vertices move too, and those that `reject_outliers` rejects are
estimated. They release the GIL. Bad input raises ValueError, or TypeError where the kind is wrong,
with what, where and the value; the completer is then as it was before the call.

Args:
    faces: (m, 3) integers, triangles. Faces that no half-edge mesh can hold are listed in
        `topology`; their edges count all the same.
    first_frame: (k, 3) float32 or float64, complete and finite. Positions of the other dtype that
        come later are converted. A float64 that is finite but beyond the range of float32 becomes
        the largest float32 of its sign: known positions with it are refused as too large, and never
        taken as missing.
    method: "motion", the default: the paper's averaged motion vectors (Arvanitis et al. 2017,
        section 3). "detail": keeps the shape of frame 0 and of the last frame, turned with the
        motion: a fraction of the error, in milliseconds where "motion" takes tenths of one;
        docs/method.md says how.
    revisit: of "motion"; "detail" refuses False. True, the default: every iteration estimates all
        satellites reached so far. False: each is estimated once, and errors feed on themselves.
    extra_iterations: of "motion"; "detail" refuses all but 0, the default. Iterations after the one
        that reaches the last satellite, 0 to 1 000 000; without `revisit` they change nothing.
    unseen: for vertices that no chain of edges ties to a known one. "follow", the default: their
        component moves rigidly, as the nearest surface does; "hold": they stay.
    noise: of "detail"; "motion" refuses it. The standard deviation of known positions, in their
        unit, positive: they then move too, as far as the shape around them says. None, the
        default: they are exact.
    reject_outliers: of "detail"; "motion" refuses True. True: known vertices whose motion
        contradicts that of the known ones around them are taken as unknown, estimated, and counted
        as `report.rejected`. False is the default.
    threads: that a frame may use, 1, the default, to 256. They are used for meshes of 23 553
        vertices or more, with "detail" of 5 889 or more; smaller ones are completed on the thread
        that calls. Without `revisit`, threads only take and give back positions. Results are the
        same to the last bit; whether they come sooner depends on the machine and the mesh: measure
        it.

One thread at a time: a call while another thread is inside raises RuntimeError.)doc";

constexpr const char* init_doc =
    R"doc(__init__(self, faces, first_frame, *, method="motion", revisit=True, extra_iterations=0,
         unseen="follow", noise=None, reject_outliers=False, threads=1)
--

Begins at a frame that is complete.)doc";

constexpr const char* push_doc = R"doc(push(self, points, known=None, *, out=None)
--

Completes the next frame.

Args:
    points: (k, 3) float32 or float64, any strides. Rows that are not known are ignored.
    known: (k,) bool, True where the position was observed. None: rows of `points` that are not
        finite are missing, all others known.
    out: (k, 3) array of the completer's dtype to write to, instead of a fresh one. It may be
        `points` itself; it must not overlap the input otherwise.

Returns:
    `out`, or the fresh array.)doc";

constexpr const char* push_sparse_doc = R"doc(push_sparse(self, indices, points, *, out=None)
--

Completes the next frame from what was observed alone.

Args:
    indices: (n,) integers, the observed vertices, each once, in any order.
    points: (n, 3) their positions.
    out: as in `push`.)doc";

constexpr const char* skip_doc = R"doc(skip(self, *, out=None)
--

Completes a frame of which nothing was observed.

Args:
    out: as in `push`.)doc";

constexpr const char* reset_doc = R"doc(reset(self, frame)
--

Makes a complete frame the new frame 0.

Args:
    frame: (k, 3), complete and finite.)doc";

constexpr const char* state_doc = R"doc(state(self)
--

All that later frames depend on, to be stored or sent.

Returns:
    bytes for `restore`, little-endian. There are no times in them: completers that were given the
        same frames have the same bytes.)doc";

constexpr const char* restore_doc = R"doc(restore(self, state)
--

Continues where `state` was taken, with the same results. The seconds of `report` are 0 then.

Args:
    state: bytes, from a completer of the same faces, dtype and settings, on any machine.)doc";

constexpr const char* frame_report_doc = R"doc(What happened to one frame.

Attributes:
    known: vertices that were observed.
    filled: vertices estimated by the method.
    unseen: vertices not tied to a known one. known + filled + unseen = k.
    iterations: of the method.
    rejected: vertices that were observed, but taken as unknown: outliers.
    seconds: wall time inside the core.
    blend: b of method "detail", the share of frame 0's shape; 0 of "motion".
    factor_seconds, rotation_seconds, solve_seconds: where the time of "detail" went, except for
        what both methods do; 0 of "motion".)doc";

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
                       const py::object& method, const py::object& revisit,
                       const py::object& extra_iterations, const py::object& unseen,
                       const py::object& noise, const py::object& reject_outliers,
                       const py::object& threads) {
             return std::make_unique<AnyCompleter>(
                 faces, first_frame,
                 settings_of(method, revisit, extra_iterations, unseen, noise, reject_outliers,
                             threads));
           }),
           py::arg("faces"), py::arg("first_frame"), py::kw_only(), py::arg("method") = "motion",
           py::arg("revisit") = true, py::arg("extra_iterations") = 0, py::arg("unseen") = "follow",
           py::arg("noise") = py::none(), py::arg("reject_outliers") = false,
           py::arg("threads") = 1, init_doc)
      .def("push", &AnyCompleter::push, py::arg("points"), py::arg("known") = py::none(),
           py::kw_only(), py::arg("out") = py::none(), push_doc)
      .def("push_sparse", &AnyCompleter::push_sparse, py::arg("indices"), py::arg("points"),
           py::kw_only(), py::arg("out") = py::none(), push_sparse_doc)
      .def("skip", &AnyCompleter::skip, py::kw_only(), py::arg("out") = py::none(), skip_doc)
      .def("reset", &AnyCompleter::reset, py::arg("frame"), reset_doc)
      .def("state", &AnyCompleter::state, state_doc)
      .def("restore", &AnyCompleter::restore, py::arg("state"), restore_doc)
      .def_property_readonly("generation", &AnyCompleter::generation,
                             "(k,) int32, of the last frame: 0 anchor, g satellite, -1 unseen.")
      .def_property_readonly("age", &AnyCompleter::age,
                             "(k,) int32: frames since the vertex was last observed.")
      .def_property_readonly("report", &AnyCompleter::report, "FrameReport of the last frame.")
      .def_property_readonly("topology", &AnyCompleter::topology, "TopologyReport of the mesh.")
      .def_property_readonly("n_vertices", &AnyCompleter::n_vertices, "k.")
      .def_property_readonly("dtype", &AnyCompleter::dtype,
                             "float32 or float64, as first_frame was.")
      .def("__repr__", [](const AnyCompleter& completer) {
        return py::str("<dynmesh.Completer of {} vertices, {}>")
            .format(completer.n_vertices(), completer.dtype());
      });
}

}  // namespace dynmesh
