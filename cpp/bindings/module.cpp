/// The extension module dynmesh._core: calls of the C++ interface with exact arrays. What users see
/// are the functions and classes of the Python package, which convert what they are given.
#include <dynmesh/settings.hpp>
#include <dynmesh/version.hpp>
#include <exception>
#include <utility>

#include "arrays.hpp"

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

}  // namespace
}  // namespace dynmesh

PYBIND11_MODULE(_core, module) {
  using namespace dynmesh;
  module.attr("__version__") = DYNMESH_VERSION;
  py::register_local_exception_translator(&translate_setting_error);
  bind_streams(module);
  bind_functions(module);
}
