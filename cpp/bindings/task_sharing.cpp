/// Functions for tests of threads, with which they make threads share the work of small meshes and
/// verify it.
#include <tuple>

#include "bindings.hpp"
#include "support/workers.hpp"

namespace dynmesh {
namespace {

using Values = std::tuple<Index, Index, Index, Index>;

/// Sets the values for completers that are constructed later. Returns the previous values.
Values set_task_sharing(Index chunk, Index short_chunk, Index fewest_pieces, Index patience) {
  TaskSharing& task_sharing = default_task_sharing();
  const Values before = {task_sharing.chunk, task_sharing.short_chunk, task_sharing.fewest_pieces,
                         task_sharing.patience};
  task_sharing = {chunk, short_chunk, fewest_pieces, patience};
  return before;
}

constexpr const char* set_task_sharing_doc =
    R"doc(_set_task_sharing(chunk, short_chunk, fewest_pieces, patience)
--

Set how completers that are constructed later share their work. Returns the previous values.)doc";

constexpr const char* pieces_doc = R"doc(_pieces_done_by_others()
--

Return how many pieces of work threads other than the caller's have done in this process.)doc";

}  // namespace

void bind_task_sharing(pybind11::module_& module) {
  namespace py = pybind11;
  module.def("_set_task_sharing", &set_task_sharing, py::arg("chunk"), py::arg("short_chunk"),
             py::arg("fewest_pieces"), py::arg("patience"), set_task_sharing_doc);
  module.def("_pieces_done_by_others", &pieces_done_by_others, pieces_doc);
}

}  // namespace dynmesh
