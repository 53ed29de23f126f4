#include <pybind11/pybind11.h>

#include <string>

#include "bindings.hpp"

namespace dynmesh {
namespace {

namespace py = pybind11;

/// Raises the TypeError for a call that does not match the signature of `callee`.
[[noreturn]] void refuse(const py::handle& callee, const py::args& args,
                         const py::kwargs& keywords) {
  const auto signature = py::module_::import("inspect").attr("signature")(callee);
  std::string why = "an argument has the wrong type";
  try {
    signature.attr("bind")(*args, **keywords);
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError)) throw;
    why = py::str(error.value());
  }
  const std::string name = py::str(callee.attr("__name__"));
  throw py::type_error(name + "(): " + why + "; it takes " + std::string(py::str(signature)));
}

/// Adds an overload to the function of this name in a module or class. It is tried last and so
/// receives all calls that match no other overload.
void refuse_other_calls_of(const char* name, const py::handle& scope) {
  const py::handle function = py::object(scope.attr(name));  // the scope keeps it alive
  const py::sibling others(function);
  if (!py::isinstance<py::type>(scope)) {
    const auto refusal = [function](const py::args& args, const py::kwargs& keywords) {
      refuse(function, args, keywords);
    };
    py::cpp_function(refusal, py::name(name), py::scope(scope), others);
  } else if (std::string(name) == "__init__") {
    // This is how py::init defines a constructor from a factory.
    const auto refusal = [scope](py::detail::value_and_holder& /*self*/, const py::args& args,
                                 const py::kwargs& keywords) { refuse(scope, args, keywords); };
    py::cpp_function(refusal, py::name(name), py::is_method(scope), others,
                     py::detail::is_new_style_constructor());
  } else {
    const auto refusal = [function, scope](const py::args& args, const py::kwargs& keywords) {
      // A bound method has the signature that the user sees, without self.
      if (!args.empty() && py::isinstance(args[0], scope)) {
        refuse(args[0].attr(function.attr("__name__")), args[py::slice(1, {}, {})], keywords);
      }
      refuse(function, args, keywords);
    };
    py::cpp_function(refusal, py::name(name), py::is_method(scope), others);
  }
}

void refuse_other_calls_in(const py::handle& scope) {
  const py::dict members(py::module_::import("builtins").attr("vars")(scope));
  for (const auto& [name, member] : members) {
    if (py::isinstance<py::type>(member)) {
      refuse_other_calls_in(member);
    } else if (!py::getattr(member, "__text_signature__", py::none()).is_none()) {
      refuse_other_calls_of(std::string(py::str(name)).c_str(), scope);
    }
  }
}

}  // namespace

void refuse_other_calls(const py::module_& module) { refuse_other_calls_in(module); }

}  // namespace dynmesh
