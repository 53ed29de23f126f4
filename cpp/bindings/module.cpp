/// The extension module dynmesh._core.
#include <dynmesh/version.hpp>

#include "bindings.hpp"

namespace py = pybind11;

PYBIND11_MODULE(_core, module) {
  py::options options;
  options.disable_function_signatures();  // the docstrings begin with better ones
  module.attr("__version__") = DYNMESH_VERSION;
  dynmesh::bind_topology(module);
  dynmesh::bind_completer(module);
  dynmesh::bind_metrics(module);
  dynmesh::bind_baselines(module);
  dynmesh::bind_files(module);
  // Users meet these as dynmesh.Completer and so on.
  for (const char* name : {"Completer", "FrameReport", "TopologyReport"}) {
    module.attr(name).attr("__module__") = "dynmesh";
  }
}
