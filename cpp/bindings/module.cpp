/// The extension module dynmesh._core: calls of the C++ interface with exact arrays. What users see
/// are the functions and classes of the Python package, which convert what they are given.
#include <dynmesh/settings.hpp>
#include <dynmesh/version.hpp>
#include <exception>
#include <tuple>
#include <utility>

#include "arrays.hpp"
#include "base/workers.hpp"

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

/// For tests of threads: how completers that are constructed later share their work. Returns the
/// previous values.
auto set_task_sharing(Index chunk, Index short_chunk, Index fewest_pieces, Index patience) {
  TaskSharing& now = default_task_sharing();
  const std::tuple before(now.chunk, now.short_chunk, now.fewest_pieces, now.patience);
  now = {chunk, short_chunk, fewest_pieces, patience};
  return before;
}

}  // namespace
}  // namespace dynmesh

PYBIND11_MODULE(_core, module) {
  using namespace dynmesh;
  module.attr("__version__") = DYNMESH_VERSION;
  py::register_local_exception_translator(&translate_setting_error);
  bind_streams(module);
  bind_functions(module);
  module.def("_set_task_sharing", &set_task_sharing, py::arg("chunk"), py::arg("short_chunk"),
             py::arg("fewest_pieces"), py::arg("patience"));
  module.def("_pieces_done_by_others", &pieces_done_by_others);
}
