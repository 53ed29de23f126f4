/// The extension module dynmesh._core: calls of the C++ interface with exact arrays. What users see
/// are the functions and classes of the Python package, which convert what they are given.
#include <dynmesh/settings.hpp>
#include <dynmesh/version.hpp>
#include <exception>
#include <stdexcept>
#include <utility>

#include "arrays.hpp"

namespace dynmesh {
namespace {

/// Raises an error of dynmesh._errors, so that bad input differs from a fault of dynmesh.
template <class... Parts>
void raise_error(const char* name, Parts&&... parts) {
  const py::object kind = py::module_::import("dynmesh._errors").attr(name);
  const py::object raised = kind(std::forward<Parts>(parts)...);
  PyErr_SetObject(kind.ptr(), raised.ptr());
}

/// Raises what C++ refuses, and the name of a setting as an attribute.
void translate_refusal(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(std::move(thrown));
  } catch (const SettingError& error) {
    raise_error("SettingError", error.reason(), py::arg("argument") = error.setting());
  } catch (const std::invalid_argument& error) {
    raise_error("InputError", error.what());
  }
}

}  // namespace
}  // namespace dynmesh

PYBIND11_MODULE(_core, module) {
  using namespace dynmesh;
  module.attr("__version__") = DYNMESH_VERSION;
  py::register_local_exception_translator(&translate_refusal);
  bind_streams(module);
  bind_functions(module);
}
