/// Checks the arguments of a completer before anything changes.
#pragma once

#include <cmath>
#include <cstddef>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

#include "stream/overlap.hpp"
#include "support/checks.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// Refuses a position that is out of range. `kind` and `number` say which row or vertex it is.
template <class Real>
void check_position(const char* argument, const char* kind, std::size_t number,
                    const Vector3<Real>& v, const char* rule) {
  if (is_in_range(v)) return;
  const auto limit = sizeof(Real) == 4 ? " and below 1e18" : " and below 1e200";
  refuse(argument, kind, " ", number, " is at ", to_text(v), ", but ", rule,
         is_finite(v) ? limit : "");
}

template <class Real>
void check_known_position(std::size_t row, const Vector3<Real>& position) {
  check_position("points", "row", row, position, "known positions must be finite");
}

template <class Real>
std::vector<Vector3<Real>> complete_frame(const char* argument, Points<const Real> points) {
  std::vector<Vector3<Real>> frame(points.count);
  for (std::size_t v = 0; v < points.count; ++v) {
    frame[v] = row(points, v);
    check_position(argument, "vertex", v, frame[v], "this frame must be complete and finite");
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
std::vector<Vector3<Real>> first_frame_of(Points<const Real> points,
                                          const char* argument = "first_frame") {
  if (points.count == 0) refuse(argument, "has no vertices");
  if (points.count > at(std::numeric_limits<Index>::max())) {
    refuse(argument, "has ", points.count, " rows, more than 32-bit indices can count");
  }
  check_view(argument, points);
  return complete_frame(argument, points);
}

/// The root mean square distance of the vertices from their mean, which does not depend on their
/// order or on how they are turned.
template <class Real>
double size_of(const Points<const Real>& frame) {
  const double share = 1 / static_cast<double>(frame.count);
  Vector3<double> mean;
  for (std::size_t v = 0; v < frame.count; ++v) mean = mean + share * in_double(row(frame, v));
  double square = 0;
  for (std::size_t v = 0; v < frame.count; ++v) {
    square += share * squared_norm(in_double(row(frame, v)) - mean);
  }
  return std::sqrt(square);
}

/// Throws SettingError for a training sequence of another mesh, of too few frames, or in another
/// unit of length, such as millimetres for metres. One whose size differs less is useless at worst,
/// and then it is not used.
template <class Real>
void check_training(const Training<Real>& training, const Points<const Real>& first_frame) {
  if (training.n_vertices() != first_frame.count) {
    throw SettingError("training", joined("its frames have ", training.n_vertices(),
                                          " vertices, but first_frame has ", first_frame.count));
  }
  if (training.n_added() < Training<Real>::fewest_frames) {
    throw SettingError("training",
                       joined("has ", training.n_added(), " frames, but at least 3 are needed"));
  }
  constexpr double most = 50;
  double trained = 0;
  for (const auto& positions : training.frames()) {
    trained += size_of(Points<const Real>(positions.data(), first_frame.count)) /
               static_cast<double>(training.frames().size());
  }
  const double size = size_of(first_frame);
  if (trained <= most * size && size <= most * trained) return;
  throw SettingError("training",
                     joined("its size, the root mean square distance from the centre, is ",
                            to_text(trained, 4), ", but that of first_frame is ", to_text(size, 4),
                            "; both must be in the same unit of length"));
}

inline Topology topology_of(Faces faces, std::size_t n_vertices) {
  if (faces.count == 0) refuse("faces", "is empty; completion needs the connectivity of the mesh");
  return build_topology(faces, n_vertices);
}

}  // namespace dynmesh
