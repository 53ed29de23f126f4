#include <dynmesh/completer.hpp>
#include <exception>
#include <string>
#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"
#include "completer_docs.hpp"
#include "stream.hpp"

namespace dynmesh {
namespace {

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

class AnyCompleter : public AnyStream<Completer, Settings> {
 public:
  static constexpr const char* name = "completer";  // in messages

  AnyCompleter(const py::object& faces, const py::object& first_frame, const py::kwargs& settings)
      : AnyStream(faces, first_frame, settings, name) {}

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
};

}  // namespace

void bind_completer(py::module_& module) {
  py::register_local_exception_translator(&translate_setting_error);
  py::class_<FrameReport>(module, "FrameReport", frame_report_doc)
      .def(report_pickle<FrameReport>())
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
      .def_property_readonly("first_order_share",
                             [](const FrameReport& r) { return r.stages.first_order_share; })
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

  module.def("setting_table", &setting_table<Settings>,
             "setting_table()\n--\n\nReturn all settings of a Completer.");
  const std::string doc = completer_doc + ("\n" + settings_doc<Settings>()) + training_doc;
  py::class_<AnyCompleter> completer(module, "Completer", doc.c_str());
  const std::string init_doc = init_doc_of<Settings>("Start at a complete frame.");
  bind_stream(completer,
              {init_doc.c_str(), skip_doc, reset_doc, state_doc, restore_doc,
               "(k,) int32, for the last frame: 0 for a known vertex, the number of edges to the "
               "nearest known vertex for an estimated one, -1 for a disconnected vertex.",
               standard_error_doc, "The FrameReport of the last frame.",
               "The number of frames completed since construction or `reset`; `restore` restores "
               "it."});
  completer
      .def("push", &AnyCompleter::push, py::arg("points"), py::arg("known") = py::none(),
           py::kw_only(), py::arg("out") = py::none(), push_doc)
      .def("push_sparse", &AnyCompleter::push_sparse, py::arg("indices"), py::arg("points"),
           py::kw_only(), py::arg("out") = py::none(), push_sparse_doc);
}

}  // namespace dynmesh
