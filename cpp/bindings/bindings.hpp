#pragma once

#include <pybind11/pybind11.h>

namespace dynmesh {

void bind_files(pybind11::module_& module);
void bind_functions(pybind11::module_& module);
void bind_streams(pybind11::module_& module);

}  // namespace dynmesh
