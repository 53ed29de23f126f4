/// Converts the frames of a training sequence.
#pragma once

#include <cstddef>
#include <dynmesh/training.hpp>

#include "arrays.hpp"
#include "scalars.hpp"

namespace dynmesh {

/// Reads the frames of an array or of any other iterable.
template <class Real>
Training<Real> training_of(const py::object& frames, std::size_t n_vertices) {
  if (!py::isinstance<py::iterable>(frames)) {
    throw py::type_error("training: must be frames, an array (n, k, 3) or an iterable, not " +
                         type_name(frames));
  }
  Training<Real> training(n_vertices);
  for (const py::handle frame : frames) {
    const auto given = py::reinterpret_borrow<py::object>(frame);
    training.add(PointsArgument<Real>("training", given, "(k, 3)").view());
  }
  return training;
}

}  // namespace dynmesh
