/// Converts the frames of a training sequence.
#pragma once

#include <algorithm>
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

/// (n, k, 3) the frames that are kept.
template <class Real>
py::array array_of(const Training<Real>& training) {
  const auto& frames = training.frames();
  py::array_t<Real> array({static_cast<py::ssize_t>(frames.size()),
                           static_cast<py::ssize_t>(training.n_vertices()), py::ssize_t{3}});
  Real* to = array.mutable_data();
  for (const auto& frame : frames) to = std::ranges::copy(frame, to).out;
  return array;
}

}  // namespace dynmesh
