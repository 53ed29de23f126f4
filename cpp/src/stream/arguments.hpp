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
#include <span>
#include <utility>
#include <vector>

#include "mesh/estimator.hpp"
#include "stream/overlap.hpp"
#include "support/checks.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// Returns a row, which must be in range. `kind` says whether it is a row or a vertex.
template <class Real>
Vector3<double> checked_row(const char* argument, const char* kind,
                            const Points<const Real>& points, std::size_t i, const char* rule) {
  const Vector3<double> v = row(points, i);
  if (is_in_range(v, largest_coordinate<Real>)) return v;
  const auto limit = sizeof(Real) == 4 ? " and below 1e18" : " and below 1e200";
  refuse(argument, kind, " ", i, " is at ", to_text(v), ", but ", rule, is_finite(v) ? limit : "");
}

template <class Real>
Vector3<double> known_row(const Points<const Real>& points, std::size_t i) {
  return checked_row("points", "row", points, i, "known positions must be finite");
}

template <class Real>
std::vector<Vector3<double>> complete_frame(const char* argument, Points<const Real> points) {
  std::vector<Vector3<double>> frame(points.count);
  for (std::size_t v = 0; v < points.count; ++v) {
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
std::vector<Vector3<double>> first_frame_of(Points<const Real> points,
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
inline double spread_of(std::span<const Vector3<double>> frame) {
  const double share = 1 / static_cast<double>(frame.size());
  Vector3<double> mean;
  for (const auto& x : frame) mean = mean + share * x;
  double square = 0;
  for (const auto& x : frame) square += share * squared_norm(x - mean);
  return std::sqrt(square);
}

/// The frames of a training sequence for a mesh with this frame 0. Throws SettingError for one of
/// another mesh, of too few frames, or in another unit of length, such as millimetres for metres.
/// One whose size differs less is useless at worst, and then it is not used.
template <class Real>
TrainingFrames frames_of(const Training<Real>& training,
                         std::span<const Vector3<double>> first_frame) {
  if (training.n_vertices() != first_frame.size()) {
    throw SettingError("training", joined("its frames have ", training.n_vertices(),
                                          " vertices, but first_frame has ", first_frame.size()));
  }
  if (training.n_added() < Training<Real>::fewest_frames) {
    throw SettingError("training",
                       joined("has ", training.n_added(), " frames, but at least 3 are needed"));
  }
  constexpr double most = 50;
  TrainingFrames frames;
  double trained = 0;
  for (const auto& positions : training.frames()) {
    const Points<const Real> rows(positions.data(), first_frame.size());
    auto& frame = frames.emplace_back();
    for (std::size_t v = 0; v < rows.count; ++v) frame.push_back(row(rows, v));
    trained += spread_of(frame) / static_cast<double>(training.frames().size());
  }
  const double size = spread_of(first_frame);
  if (trained <= most * size && size <= most * trained) return frames;
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
