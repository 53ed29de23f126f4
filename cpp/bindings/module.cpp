/// The extension module dynmesh._core.
#include <dynmesh/version.hpp>

#include "bindings.hpp"

namespace py = pybind11;

PYBIND11_MODULE(_core, module) {
  py::options options;
  // Each docstring begins with a signature, followed by the line "--", which Python returns from
  // inspect.signature.
  options.disable_function_signatures();
  module.attr("__version__") = DYNMESH_VERSION;
  dynmesh::bind_topology(module);
  dynmesh::bind_completer(module);
  dynmesh::bind_training(module);
  dynmesh::bind_tracker(module);
  dynmesh::bind_alignment(module);
  dynmesh::bind_registration(module);
  dynmesh::bind_whole_frame(module);
  dynmesh::bind_metrics(module);
  dynmesh::bind_baselines(module);
  dynmesh::bind_task_sharing(module);
  dynmesh::bind_files(module);
  // Users know these classes as dynmesh.Completer and so on.
  for (const char* name : {"Agreement", "Alignment", "Completer", "FrameReport", "RefusedFace",
                           "TopologyReport", "Tracker", "TrackingReport"}) {
    module.attr(name).attr("__module__") = "dynmesh";
  }
  dynmesh::refuse_other_calls(module);
}
