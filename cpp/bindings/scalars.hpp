/// Converts Python numbers and strings. Errors name the argument; the message of pybind11 would
/// list the types of all arguments without saying which is wrong and why.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <dynmesh/types.hpp>
#include <string>
#include <utility>

namespace dynmesh {

namespace py = pybind11;

/// A ValueError that knows which argument it is about.
class ValueRefused : public py::value_error {
 public:
  ValueRefused(std::string argument, std::string reason)
      : py::value_error(argument + ": " + reason),
        argument_(std::move(argument)),
        reason_(std::move(reason)) {}

  [[nodiscard]] const std::string& argument() const { return argument_; }
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  std::string argument_;
  std::string reason_;
};

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
