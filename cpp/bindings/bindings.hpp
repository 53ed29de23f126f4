#pragma once

#include <pybind11/pybind11.h>

namespace dynmesh {

void bind_alignment(pybind11::module_& module);
void bind_baselines(pybind11::module_& module);
void bind_topology(pybind11::module_& module);
void bind_completer(pybind11::module_& module);
void bind_files(pybind11::module_& module);
void bind_metrics(pybind11::module_& module);
void bind_registration(pybind11::module_& module);
void bind_training(pybind11::module_& module);
void bind_task_sharing(pybind11::module_& module);
void bind_tracker(pybind11::module_& module);
void bind_whole_frame(pybind11::module_& module);

/// Makes calls that do not match the signature of a function, method or constructor raise the same
/// short TypeError as Python functions do. The message of pybind11 would print every argument,
/// including arrays. Must be called after everything else is bound.
void refuse_other_calls(const pybind11::module_& module);

}  // namespace dynmesh
