/// The extension module dynmesh._core.
#include <dynmesh/version.hpp>

#include "bindings.hpp"

PYBIND11_MODULE(_core, module) {
  module.attr("__version__") = DYNMESH_VERSION;
  dynmesh::bind_topology(module);
  dynmesh::bind_completer(module);
  dynmesh::bind_metrics(module);
}
