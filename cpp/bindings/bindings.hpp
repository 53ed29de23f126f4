#pragma once

#include <pybind11/pybind11.h>

namespace dynmesh {

void bind_baselines(pybind11::module_& module);
void bind_topology(pybind11::module_& module);
void bind_completer(pybind11::module_& module);
void bind_files(pybind11::module_& module);
void bind_metrics(pybind11::module_& module);

}  // namespace dynmesh
