#include "scalars.hpp"

namespace dynmesh {
namespace {

[[noreturn]] void refuse_kind(const std::string& argument, const char* kind, py::handle given) {
  throw py::type_error(argument + ": must be " + kind + ", not " + type_name(given));
}

bool is_numpy_bool(py::handle given) {
  const std::string name = given.ptr()->ob_type->tp_name;
  return name == "numpy.bool" || name == "numpy.bool_";
}

bool is_any_bool(py::handle given) {
  return py::isinstance<py::bool_>(given) || is_numpy_bool(given);
}

}  // namespace

std::string type_name(py::handle object) {
  return py::str(py::type::handle_of(object).attr("__name__"));
}

std::string text_argument(const std::string& argument, py::handle given) {
  if (!py::isinstance<py::str>(given)) refuse_kind(argument, "a string", given);
  Py_ssize_t size = 0;
  const char* text = PyUnicode_AsUTF8AndSize(given.ptr(), &size);
  if (text == nullptr) {
    PyErr_Clear();
    throw ValueRefused(argument, "is not valid text, " + std::string(py::repr(given)));
  }
  return {text, static_cast<std::size_t>(size)};
}

bool truth_argument(const std::string& argument, py::handle given) {
  if (!is_any_bool(given)) refuse_kind(argument, "True or False", given);
  return py::bool_(py::reinterpret_borrow<py::object>(given));
}

double number_argument(const std::string& argument, py::handle given) {
  // PyNumber_Float is not used, since it also accepts strings.
  const bool is_number = PyFloat_Check(given.ptr()) != 0 || PyIndex_Check(given.ptr()) != 0 ||
                         (given.ptr()->ob_type->tp_as_number != nullptr &&
                          given.ptr()->ob_type->tp_as_number->nb_float != nullptr);
  if (!is_number || is_any_bool(given)) refuse_kind(argument, "a number", given);
  const double number = PyFloat_AsDouble(given.ptr());
  if (number == -1 && PyErr_Occurred() != nullptr) {
    const bool is_large = PyErr_ExceptionMatches(PyExc_OverflowError) != 0;
    PyErr_Clear();
    if (!is_large) refuse_kind(argument, "a number", given);
    throw ValueRefused(argument, "is an integer out of the range of float64");
  }
  return number;
}

Index integer_argument(const std::string& argument, py::handle given) {
  if (PyIndex_Check(given.ptr()) == 0 || is_any_bool(given)) {
    refuse_kind(argument, "an integer", given);
  }
  int overflow = 0;
  const auto number = py::reinterpret_steal<py::object>(PyNumber_Index(given.ptr()));
  if (!number) throw py::error_already_set();
  const long long wide = PyLong_AsLongLongAndOverflow(number.ptr(), &overflow);
  if (overflow != 0 || wide != static_cast<Index>(wide)) {
    throw ValueRefused(argument, "is out of range, " + std::string(py::str(number)));
  }
  return static_cast<Index>(wide);
}

std::size_t count_argument(const std::string& argument, py::handle given) {
  const Index count = integer_argument(argument, given);
  if (count < 0) {
    throw ValueRefused(argument, "must not be negative, but is " + std::to_string(count));
  }
  return static_cast<std::size_t>(count);
}

}  // namespace dynmesh
