/// The anchors of a frame of method detail: their observed positions and their weights.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/generations.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// The anchors of successive frames, in double precision. Allocates memory only in the constructor.
///
/// Exact anchors are fixed at `observed` and are not solved for. Noisy anchors are solved for like
/// satellites, with a weighted penalty on their distance from `observed`.
struct Anchors {
  std::vector<Vector3<double>>
      observed;  ///< (k,) the given position of an anchor, the last position of any other vertex
  std::vector<std::uint8_t> is_solved;  ///< (k,) 1 for satellites and noisy anchors, else 0
  std::vector<double>
      weights;  ///< (k,) lambda for noisy anchors, else 0; empty if anchors are exact
  std::vector<double> counts;  ///< (k,) 1 in components that contain an anchor, else 0
  std::size_t number = 0;      ///< the number of anchors
  std::size_t n_solved = 0;    ///< the number of vertices that are solved for
  /// (k,) unit normals of the planes that noisy anchors observe instead of positions: `observed` is
  /// a point of the plane. Empty if they observe positions.
  std::span<const Vector3<double>> normals;

  Anchors(std::size_t n_vertices, bool are_noisy)
      : observed(n_vertices),
        is_solved(n_vertices),
        weights(are_noisy ? n_vertices : 0),
        counts(n_vertices) {}

  [[nodiscard]] bool are_noisy() const { return !weights.empty(); }
  [[nodiscard]] bool are_planes() const { return !normals.empty(); }
  /// The part of a displacement of vertex v that a noisy anchor can tell.
  [[nodiscard]] Vector3<double> observable(std::size_t v, const Vector3<double>& x) const {
    return are_planes() ? dot(normals[v], x) * normals[v] : x;
  }
  [[nodiscard]] bool any_solved() const { return n_solved > 0; }

  /// Sets the anchors of a frame. `lambda` is the weight of noisy anchors.
  void set_frame(std::span<const Vector3<double>> previous, std::span<const Vector3<double>> points,
                 const Generations& generations, double lambda) {
    const auto generation = generations.of_vertices();
    number = generations.anchors();
    n_solved = generations.reached() + (are_noisy() ? number : 0);
    for (std::size_t v = 0; v < generation.size(); ++v) {
      const bool is_anchor = generation[v] == Generations::anchor;
      observed[v] = is_anchor ? in_double(points[v]) : previous[v];
      is_solved[v] = generation[v] > 0 || (is_anchor && are_noisy()) ? 1 : 0;
      counts[v] = generation[v] != Generations::disconnected ? 1 : 0;
      if (are_noisy()) weights[v] = is_anchor ? lambda : 0;
    }
  }
};

}  // namespace dynmesh
