/// Converts the frames of a rehearsal.
#pragma once

#include <cstddef>
#include <dynmesh/rehearsal.hpp>

#include "arrays.hpp"
#include "scalars.hpp"

namespace dynmesh {

/// Reads the frames of an array or of any other iterable.
template <class Real>
Rehearsal<Real> rehearsal_of(const py::object& frames, std::size_t n_vertices) {
  if (!py::isinstance<py::iterable>(frames)) {
    throw py::type_error("rehearsal: must be frames, an array (n, k, 3) or an iterable, not " +
                         type_name(frames));
  }
  Rehearsal<Real> rehearsal(n_vertices);
  for (const py::handle frame : frames) {
    const auto given = py::reinterpret_borrow<py::object>(frame);
    rehearsal.add(PointsArgument<Real>("rehearsal", given, "(k, 3)").view());
  }
  return rehearsal;
}

}  // namespace dynmesh
