#include "arrays.hpp"
#include "mesh/mesh_files.hpp"

namespace dynmesh {
namespace {

py::array numbers_of(const PlyNumbers& numbers) {
  return std::visit([](const auto& values) -> py::array { return array_of(values); }, numbers);
}

/// Files do not state the encoding of names. In Latin-1, any bytes are valid.
py::str to_text(std::string_view bytes) {
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeLatin1(bytes.data(), static_cast<py::ssize_t>(bytes.size()), nullptr));
}

template <class Comments>
py::list to_list(const Comments& comments) {
  py::list texts;
  for (const auto& comment : comments) texts.append(to_text(comment));
  return texts;
}

py::tuple py_parse_obj(const py::bytes& data) {
  const std::string_view text = data;
  const ObjFile file = [&] {
    const py::gil_scoped_release release;
    return parse_obj(text);
  }();
  return py::make_tuple(array_of(file.mesh.positions).reshape({-1, 3}), array_of(file.mesh.sizes),
                        array_of(file.mesh.corners), to_list(file.comments));
}

py::tuple py_parse_ply(const py::bytes& data) {
  const std::string_view view = data;
  const PlyFile file = [&] {
    const py::gil_scoped_release release;
    return parse_ply(view);
  }();
  py::dict elements;
  for (const PlyElement& element : file.elements) {
    py::dict columns;
    for (const PlyProperty& property : element.properties) {
      py::object column = numbers_of(property.values);
      if (property.counts) {
        column = py::make_tuple(numbers_of(*property.counts).attr("astype")("int64"), column);
      }
      columns[to_text(property.name)] = column;
    }
    elements[to_text(element.name)] = columns;
  }
  return py::make_tuple(elements, to_list(file.comments));
}

}  // namespace

void bind_files(py::module_& module) {
  module.def("parse_obj", &py_parse_obj);
  module.def("parse_ply", &py_parse_ply);
}

}  // namespace dynmesh
