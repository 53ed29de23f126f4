#include <pybind11/numpy.h>

#include "bindings.hpp"
#include "plain_obj.hpp"

namespace dynmesh {
namespace {

namespace py = pybind11;

py::object plain_obj(const py::bytes& text) {
  std::optional<PlainObj> mesh;
  {
    const std::string_view view = text;
    const py::gil_scoped_release release;
    mesh = read_plain_obj(view);
  }
  if (!mesh) return py::none();
  const auto to_numpy = []<class T>(const std::vector<T>& values) {
    return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  return py::make_tuple(to_numpy(mesh->positions).reshape({-1, 3}), to_numpy(mesh->sizes),
                        to_numpy(mesh->corners));
}

constexpr const char* plain_obj_doc = R"doc(plain_obj(text)
--

Read the text of an OBJ file that uses only the common syntax.

Args:
    text: The bytes of the whole file.

Returns:
    The positions (n, 3) float64, the number of corners of each face (m,) int64, and the vertex
    indices of all corners int64, counted from 0. None if a line is invalid or uses other syntax.)doc";

}  // namespace

void bind_files(py::module_& module) {
  module.def("plain_obj", &plain_obj, py::arg("text"), plain_obj_doc);
}

}  // namespace dynmesh
