/// Python's numbers and strings as arguments, refused by name: pybind11's own message would list
/// every argument's type and say neither which is wrong nor why.
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

/// str. TypeError for anything else, ValueRefused for one that UTF-8 cannot hold.
std::string text_argument(const std::string& argument, py::handle given);

/// bool, Python's or numpy's. TypeError for anything else.
bool truth_argument(const std::string& argument, py::handle given);

/// A real number, but no bool. TypeError for anything else, ValueRefused for an integer that no
/// float64 can hold.
double number_argument(const std::string& argument, py::handle given);

/// An integer, but no bool, that `Index` can hold. TypeError for anything else, ValueRefused out
/// of range.
Index integer_argument(const std::string& argument, py::handle given);

/// As integer_argument, and not negative.
std::size_t count_argument(const std::string& argument, py::handle given);

}  // namespace dynmesh
