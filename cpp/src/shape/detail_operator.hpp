/// The operator that extracts the detail of a frame, K = M^-1/2 C (docs/method.md, 7), which is
/// built once from frame 0, and the fields to which it is applied.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "kernels/kernels.hpp"
#include "linear/masked_factor.hpp"

namespace dynmesh {

/// At one vertex, the terms of the shape m + b (m_first - m) + c u, or what belongs to each of
/// them: the term in the axes of the current frame, the step towards it, or K times that step.
struct ShapeTerms {
  Vector3 last;     ///< m, the shape of the last frame
  Vector3 to_rest;  ///< m_first - m, of which b is added
  Vector3 change;   ///< u, the recent change of m per frame, of which c is added
};
static_assert(sizeof(ShapeTerms) == 3 * sizeof(Vector3));

/// The memory of three terms as fields that are stored side by side: (3 k,).
inline Field side_by_side(std::span<const ShapeTerms> terms) {
  return {reinterpret_cast<const Vector3*>(terms.data()), 3 * terms.size()};
}
inline std::span<Vector3> side_by_side(std::span<ShapeTerms> terms) {
  return {reinterpret_cast<Vector3*>(terms.data()), 3 * terms.size()};
}

/// C is symmetric, so K^T r = C (M^-1/2 r): one matrix serves both products.
struct DetailOperator {
  using Rows = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;

  std::shared_ptr<const Rows> c;  ///< C; a pointer, since Eigen would copy what is moved
  std::vector<double> scale;      ///< (k,) M^-1/2

  [[nodiscard]] std::size_t size() const { return scale.size(); }
};

/// As the inner loops take it.
inline OperatorData data_of(const DetailOperator& k) {
  return {k.c->outerIndexPtr(), k.c->innerIndexPtr(), k.c->valuePtr(), k.scale.data()};
}

/// C is the cotangent Laplacian of the intrinsic Delaunay triangulation of `frame`. M contains the
/// vertex areas, a third of the area of the adjacent triangles, with a lower bound. Lengths are in
/// mean edge lengths of `frame`, so the result does not depend on the scale of the mesh. An edge of
/// a face with a repeated vertex, which has no area, gets a constant weight for each such face. All
/// values are finite for any mesh.
DetailOperator build_detail_operator(std::span<const Triangle> faces, const Cells& cells,
                                     Field frame);

/// products = K x, for one or three fields of Vector3 per vertex, side by side.
void apply_operator(const DetailOperator& k, Field x, int fields, std::span<Vector3> products,
                    Workers& workers);

/// products = C x, of which K^T is made.
void multiply_by_c(const DetailOperator& k, Field x, std::span<Vector3> products, Workers& workers);

/// Averages over one-rings: half the value of a vertex plus half the mean of its cell.
DetailOperator smoother_of(const Cells& cells);
/// Averages fields that many times, as `apply_operator` takes them. `scratch` has the same size.
void smooth(const DetailOperator& smoother, int fields, int times, std::vector<Vector3>& values,
            std::vector<Vector3>& scratch, Workers& workers);

/// N = K^T K + mu C = C (M^-1 C + mu). `membrane` is mu at each vertex (k,), the same in all of a
/// component, or empty.
SparseMatrix normal_matrix(const DetailOperator& k, std::span<const double> membrane = {});

/// How much of a detail vector can consist of rounding errors.
///
/// Two shapes that differ by less are the same one. Whatever is divided by their difference, or
/// learned from it, would be a result of rounding, and another one wherever else the subject
/// stands.
class Rounding {
 public:
  /// `epsilon` is that of the type in which positions are given.
  Rounding(const DetailOperator& k, double mean_edge, double epsilon)
      : solution_(1e-9 * mean_edge), epsilon_(epsilon) {
    for (Index i = 0; i < k.c->rows(); ++i) {
      const double scale = k.scale[i];
      mean_squared_row_ +=
          scale * scale * k.c->row(i).squaredNorm() / static_cast<double>(k.size());
    }
  }

  /// The mean square of the rounding errors of the positions of a frame. They are rounded, the more
  /// the farther they are from the origin, and solutions are accurate to a billionth of a mean edge
  /// length.
  [[nodiscard]] double mean_square_of_positions(Field frame) const {
    double square = 0;
    for (const auto& x : frame) square += squared_norm(x);
    square /= static_cast<double>(frame.size());
    return solution_ * solution_ + epsilon_ * epsilon_ * square;
  }
  /// The mean square of the rounding errors of the detail vectors of a frame.
  [[nodiscard]] double mean_square(Field frame) const {
    return mean_squared_row_ * mean_square_of_positions(frame);
  }

 private:
  double mean_squared_row_ = 0;
  double solution_;
  double epsilon_;
};

}  // namespace dynmesh
