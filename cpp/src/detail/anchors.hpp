/// What holds a frame of method detail: where its anchors were observed, and how firmly they hold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "generations/generations.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// The anchors of one frame after another, in double precision. Allocates in the constructor only.
///
/// Exact anchors are fixed: they stand at `observed` and are not solved for. Noisy anchors are
/// solved for like satellites, and drawn to `observed` by their weight.
struct Anchors {
  std::vector<Vector3<double>> observed;  ///< (k,) anchors as given, elsewhere the last frame
  std::vector<std::uint8_t> is_solved;    ///< (k,) 1 at satellites and noisy anchors, else 0
  std::vector<double> weights;            ///< (k,) lambda at noisy anchors, else 0; empty if exact
  std::vector<double> counts;             ///< (k,) 1 in components that hold an anchor, else 0
  std::size_t number = 0;                 ///< of anchors
  std::size_t n_solved = 0;               ///< how many vertices are solved for

  Anchors(std::size_t n_vertices, bool are_noisy)
      : observed(n_vertices),
        is_solved(n_vertices),
        weights(are_noisy ? n_vertices : 0),
        counts(n_vertices) {}

  [[nodiscard]] bool are_noisy() const { return !weights.empty(); }
  [[nodiscard]] bool any_solved() const { return n_solved > 0; }

  /// Takes those of a frame. `lambda`: the weight of noisy anchors.
  template <class Real>
  void set_frame(std::span<const Vector3<double>> previous, std::span<const Vector3<Real>> points,
                 const Generations& generations, double lambda) {
    const auto generation = generations.of_vertices();
    number = generations.anchors();
    n_solved = generations.reached() + (are_noisy() ? number : 0);
    for (std::size_t v = 0; v < generation.size(); ++v) {
      const bool is_anchor = generation[v] == Generations::anchor;
      observed[v] = is_anchor ? in_double(points[v]) : previous[v];
      is_solved[v] = generation[v] > 0 || (is_anchor && are_noisy()) ? 1 : 0;
      counts[v] = generation[v] != Generations::unseen ? 1 : 0;
      if (are_noisy()) weights[v] = is_anchor ? lambda : 0;
    }
  }
};

}  // namespace dynmesh
