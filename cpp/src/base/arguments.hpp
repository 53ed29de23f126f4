/// Checks of positions and of the arrays that hold them, before anything changes.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "base/geometry.hpp"
#include "base/overlap.hpp"

namespace dynmesh {

/// Returns a row, which must be in range. `kind` says whether it is a row or a vertex.
template <class Real>
Vector3 checked_row(const char* argument, const char* kind, const Points<const Real>& points,
                    std::size_t i, const char* rule) {
  const Vector3 v = row(points, i);
  if (is_in_range(v, largest_coordinate<Real>)) return v;
  const auto limit = sizeof(Real) == 4 ? " and below 1e18" : " and below 1e200";
  refuse(argument, kind, " ", i, " is at ", to_text(v), ", but ", rule, is_finite(v) ? limit : "");
}

template <class Real>
Vector3 known_row(const Points<const Real>& points, std::size_t i) {
  return checked_row("points", "row", points, i, "known positions must be finite");
}

/// The positions of a frame that must be complete, with a row for each vertex.
template <class Real>
std::vector<Vector3> complete_frame(const char* argument, Points<const Real> points,
                                    std::size_t n_vertices) {
  check_rows(argument, points, n_vertices);
  std::vector<Vector3> frame(n_vertices);
  for (std::size_t v = 0; v < n_vertices; ++v) {
    frame[v] = checked_row(argument, "vertex", points, v, "this frame must be complete and finite");
  }
  return frame;
}

/// Checks that the completed frame does not overlap any of `inputs`, unless it is the same array.
template <class Real>
void check_output(const Points<Real>& completed, std::size_t n_vertices,
                  std::initializer_list<std::pair<const char*, Extent>> inputs) {
  check_rows("out", completed, n_vertices);
  const Extent output = Extent::of(completed);
  if (overlaps_itself(output)) {
    refuse("out", "the rows of the completed frame overlap each other");
  }
  for (const auto& [name, input] : inputs) {
    if (input != output && overlap(input, output)) {
      refuse("out", "the completed frame overlaps ", name,
             "; it must be the same array as points or a separate one");
    }
  }
}

template <class Real>
std::vector<Vector3> first_frame_of(Points<const Real> points,
                                    const char* argument = "first_frame") {
  if (points.count == 0) refuse(argument, "has no vertices");
  if (points.count > at(std::numeric_limits<Index>::max())) {
    refuse(argument, "has ", points.count, " rows, more than 32-bit indices can count");
  }
  return complete_frame(argument, points, points.count);
}

}  // namespace dynmesh
