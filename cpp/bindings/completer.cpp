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
#include "completer_docs.hpp"
#include "scalars.hpp"
#include "training.hpp"

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

constexpr const char* training_name = "training";  // the argument beside the settings

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
  std::size_t n_taken = given.contains(training_name) ? 1 : 0;
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

py::object training_in(const py::kwargs& given) {
  return given.contains(training_name) ? py::object(given[training_name]) : py::none();
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
                 const Settings& settings, const py::object& training) {
    const PointsArgument<Real> frame("first_frame", first_frame, "(k, 3)");
    if (training.is_none()) {
      const py::gil_scoped_release release;
      completer_ = std::make_unique<Completer<Real>>(faces.faces(), frame.view(), settings);
    } else {
      const auto trained = training_of<Real>(training, frame.view().count);
      const py::gil_scoped_release release;
      completer_ =
          std::make_unique<Completer<Real>>(faces.faces(), frame.view(), settings, trained);
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
               const py::object& training) {
    const IndicesArgument indices("faces", faces, 3, "(m, 3)");
    const py::array frame = to_array("first_frame", first_frame);
    check_floating("first_frame", frame);
    if (frame.itemsize() == sizeof(float)) {
      construct<float>(indices, frame, settings, training);
    } else {
      construct<double>(indices, frame, settings, training);
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
      completer.restore(BytesArgument("state", state).view());
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
  py::array standard_error() {
    return exclusively([]<class Real>(Completer<Real>& completer) -> py::array {
      const std::span<const Real> values = completer.standard_error();
      return py::array_t<Real>(static_cast<py::ssize_t>(values.size()), values.data());
    });
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

}  // namespace

void bind_completer(py::module_& module) {
  py::register_local_exception_translator(&translate_setting_error);
  py::class_<FrameReport>(module, "FrameReport", frame_report_doc)
      .def_readonly("known", &FrameReport::known)
      .def_readonly("filled", &FrameReport::filled)
      .def_readonly("disconnected", &FrameReport::disconnected)
      .def_readonly("iterations", &FrameReport::iterations)
      .def_readonly("rejected", &FrameReport::rejected)
      .def_readonly("standard_error", &FrameReport::standard_error)
      .def_readonly("seconds", &FrameReport::seconds)
      .def_property_readonly("blend", [](const FrameReport& r) { return r.stages.blend; })
      .def_property_readonly("prior_weight",
                             [](const FrameReport& r) { return r.stages.prior_weight; })
      .def_property_readonly("prior_share",
                             [](const FrameReport& r) { return r.stages.prior_share; })
      .def_property_readonly("factor_seconds",
                             [](const FrameReport& r) { return r.stages.factor_seconds; })
      .def_property_readonly("rotation_seconds",
                             [](const FrameReport& r) { return r.stages.rotation_seconds; })
      .def_property_readonly("solve_seconds",
                             [](const FrameReport& r) { return r.stages.solve_seconds; })
      .def("__repr__", [](const FrameReport& report) {
        return py::str(
                   "FrameReport(known={}, filled={}, disconnected={}, rejected={}, iterations={}, "
                   "seconds={:.6f})")
            .format(report.known, report.filled, report.disconnected, report.rejected,
                    report.iterations, report.seconds);
      });

  py::class_<AnyCompleter>(module, "Completer", completer_doc)
      .def(py::init([](const py::object& faces, const py::object& first_frame,
                       const py::kwargs& settings) {
             return std::make_unique<AnyCompleter>(faces, first_frame, settings_of(settings),
                                                   training_in(settings));
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
          "g, -1 for a disconnected vertex.")
      .def_property_readonly("age", &AnyCompleter::age,
                             "(k,) int32: the number of frames since the vertex was last observed.")
      .def_property_readonly("standard_error", &AnyCompleter::standard_error, standard_error_doc)
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
