/// The linear systems of method detail, which find the positions with a given detail K X, and the
/// anchors of a frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "base/lender.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "linear/masked_factor.hpp"
#include "shape/detail_operator.hpp"

namespace dynmesh {

/// The anchors of successive frames, in double precision. Allocates memory only in the constructor.
///
/// Exact anchors are fixed at `observed` and are not solved for. Noisy anchors are solved for like
/// satellites, with a weighted penalty on their distance from `observed`.
struct Anchors {
  std::vector<Vector3>
      observed;  ///< (k,) the given position of an anchor, the last position of any other vertex
  std::vector<std::uint8_t> is_solved;  ///< (k,) 1 for satellites and noisy anchors, else 0
  std::vector<double>
      weights;  ///< (k,) lambda for noisy anchors, else 0; empty if anchors are exact
  std::vector<double> counts;  ///< (k,) 1 in components that contain an anchor, else 0
  std::size_t number = 0;      ///< the number of anchors
  std::size_t n_solved = 0;    ///< the number of vertices that are solved for
  /// (k,) unit normals of the planes that noisy anchors observe instead of positions: `observed` is
  /// a point of the plane. Empty if they observe positions.
  Field normals;

  Anchors(std::size_t n_vertices, bool are_noisy)
      : observed(n_vertices),
        is_solved(n_vertices),
        weights(are_noisy ? n_vertices : 0),
        counts(n_vertices) {}

  [[nodiscard]] bool are_noisy() const { return !weights.empty(); }
  [[nodiscard]] bool are_planes() const { return !normals.empty(); }
  /// The part of a displacement of vertex v that a noisy anchor can tell.
  [[nodiscard]] Vector3 observable(std::size_t v, const Vector3& x) const {
    return are_planes() ? dot(normals[v], x) * normals[v] : x;
  }
  [[nodiscard]] bool any_solved() const { return n_solved > 0; }
  [[nodiscard]] bool is_anchor(std::size_t v) const {
    return are_noisy() ? weights[v] > 0 : counts[v] > 0 && is_solved[v] == 0;
  }

  /// Sets the anchors of a frame. `lambda` is the weight of noisy anchors.
  void set_frame(Field previous, Field points, const Generations& generations, double lambda) {
    const auto generation = generations.of_vertices();
    number = generations.anchors();
    n_solved = generations.reached() + (are_noisy() ? number : 0);
    for (std::size_t v = 0; v < generation.size(); ++v) {
      const bool is_anchor = generation[v] == Generations::anchor;
      observed[v] = is_anchor ? points[v] : previous[v];
      is_solved[v] = generation[v] > 0 || (is_anchor && are_noisy()) ? 1 : 0;
      counts[v] = generation[v] != Generations::disconnected ? 1 : 0;
      if (are_noisy()) weights[v] = is_anchor ? lambda : 0;
    }
  }
};

/// The factor of N = K^T K, plus the weights of noisy anchors, restricted to the vertices that are
/// solved for. It belongs to who made it.
struct ShapeFactor {
  /// `n` is of the plan of N, or of N with a membrane. Allocates memory if the factor is larger
  /// than all that `n` was before. `of` must outlive this object.
  ShapeFactor(const Anchors& of, Lent<MaskedFactor> memory) : anchors(of), n(std::move(memory)) {
    n.factorize(anchors.is_solved, anchors.weights);
  }

  /// The vertices that are solved for, in the order of elimination.
  [[nodiscard]] std::span<const Index> solved() const { return n.order(); }

  const Anchors& anchors;
  Lent<MaskedFactor> n;
};

/// The systems with K of frame 0. Fields have one or three Vector3 for each vertex, side by side.
/// Allocates memory only in the constructor and in `take_planes`.
class ShapeSystem {
 public:
  /// `k` and `workers` must outlive this object.
  ShapeSystem(const DetailOperator& k, Workers& workers);

  /// detail = K x.
  void apply(Field x, int fields, std::span<Vector3> detail) const;
  void apply(std::span<const ShapeTerms> x, std::span<ShapeTerms> detail) const {
    apply(side_by_side(x), 3, side_by_side(detail));
  }

  /// Finds the steps D that bring K (x + D) closest to K x + residual, for each of one or three
  /// fields: N D = K^T residual. `residual(v, field)` is the wanted value minus the current one. In
  /// the first field, noisy anchors also move from x towards their observed positions. Steps are 0
  /// for vertices that are not solved for.
  template <int fields, class Residual>
  void solve(const Residual& residual, Field x, ShapeFactor& factor, std::span<Vector3> steps) {
    const auto to_observed = [&](std::size_t v, std::size_t) {
      return factor.anchors.observed[v] - x[v];
    };
    solve<fields, 1>(residual, to_observed, factor, steps);
  }

  /// Finds steps as above with another pull: in the first `pulled` fields, the step of noisy
  /// anchors is drawn to `pull(v, field)`, which is not called if anchors are exact.
  template <int fields, int pulled, class Residual, class Pull>
  void solve(const Residual& residual, const Pull& pull, ShapeFactor& factor,
             std::span<Vector3> steps) {
    const Anchors& anchors = factor.anchors;
    workers_.for_each_in_chunks(operator_.size(), [&](std::size_t v) {
      for (std::size_t f = 0; f < fields; ++f) {
        scaled_residual_[fields * v + f] = operator_.scale[v] * residual(v, f);
      }
    });
    multiply_transposed(factor.solved(), fields);
    if (anchors.are_noisy()) {
      const auto rows = factor.solved();
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const std::size_t v = at(rows[r]);
        for (std::size_t f = 0; f < pulled; ++f) {
          Vector3& value = solution_[fields * r + f];
          value = value + anchors.weights[v] * anchors.observable(v, pull(v, f));
        }
      }
    }
    if (anchors.are_planes()) return descend_to_planes<fields>(factor, steps);
    factor.n.solve(solution_, fields);
    scatter(solution_, factor.solved(), fields, steps);
  }

  /// Finds the step that brings K (x + D) closest to the shape of the last frame, and those that a
  /// unit of each of the other two terms adds. `kx` is K x.
  void solve_terms(std::span<const ShapeTerms> wanted, Field x, Field kx, ShapeFactor& factor,
                   std::span<ShapeTerms> steps) {
    const auto residual = [&](std::size_t v, std::size_t term) {
      return term == 0 ? wanted[v].last - kx[v] : term == 1 ? wanted[v].to_rest : wanted[v].change;
    };
    solve<3>(residual, x, factor, side_by_side(steps));
  }

  /// Lets `solve` take anchors that are planes: it then takes this many steps of conjugate
  /// gradients.
  void take_planes(int steps);

 private:
  void multiply_transposed(std::span<const Index> rows, int fields);
  void scatter(Field rows, std::span<const Index> order, std::size_t width,
               std::span<Vector3> x) const;
  template <int fields>
  void descend_to_planes(ShapeFactor& factor, std::span<Vector3> steps);
  void multiply_with_planes(std::size_t width, const ShapeFactor& factor, std::span<Vector3> steps);

  const DetailOperator& operator_;  // K
  Workers& workers_;
  std::vector<Vector3> scaled_residual_;  // M^-1/2 times the vector that is multiplied by K^T
  std::vector<Vector3> solution_;         // in the order of elimination
  // For planes, in the order of elimination:
  int plane_steps_ = 0;
  std::vector<Vector3> residual_, direction_, found_;
};

}  // namespace dynmesh
