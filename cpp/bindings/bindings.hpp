#pragma once

#include <pybind11/pybind11.h>

namespace dynmesh {

void bind_baselines(pybind11::module_& module);
void bind_topology(pybind11::module_& module);
void bind_completer(pybind11::module_& module);
void bind_files(pybind11::module_& module);
void bind_metrics(pybind11::module_& module);
void bind_sharing(pybind11::module_& module);

/// To be called last: from then on a call that does not fit the signature of a function, method or
/// constructor is refused in one line, in Python's words. pybind11's own message would print every
/// argument, arrays among them.
void refuse_other_calls(const pybind11::module_& module);

}  // namespace dynmesh
