/// Converts Python numbers and strings. Errors name the argument; the message of pybind11 would
/// list the types of all arguments without saying which is wrong and why.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <dynmesh/types.hpp>
#include <string>

namespace dynmesh {

namespace py = pybind11;

std::string type_name(py::handle object);

/// Accepts str. Raises TypeError for other types, and ValueError for a string that cannot be
/// encoded in UTF-8.
std::string text_argument(const std::string& argument, py::handle given);

/// Accepts bool and numpy.bool. Raises TypeError for other types.
bool truth_argument(const std::string& argument, py::handle given);

/// Accepts real numbers except bool. Raises TypeError for other types.
double number_argument(const std::string& argument, py::handle given);

/// Accepts integers except bool. Raises TypeError for other types, and ValueError for integers out
/// of the range of `Index`.
Index integer_argument(const std::string& argument, py::handle given);

/// Like integer_argument, but raises ValueError for negative integers.
std::size_t count_argument(const std::string& argument, py::handle given);

}  // namespace dynmesh
