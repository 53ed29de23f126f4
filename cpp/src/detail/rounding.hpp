/// How much of a detail vector can consist of rounding errors.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>

#include "detail/detail_operator.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// Two shapes that differ by less are the same one. Whatever is divided by their difference, or
/// learned from it, would be a result of rounding, and another one wherever else the subject
/// stands.
class Rounding {
 public:
  Rounding() = default;
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
  [[nodiscard]] double mean_square_of_positions(std::span<const Vector3<double>> frame) const {
    double square = 0;
    for (const auto& x : frame) square += squared_norm(x);
    square /= static_cast<double>(frame.size());
    return solution_ * solution_ + epsilon_ * epsilon_ * square;
  }
  /// The same of its detail vectors.
  [[nodiscard]] double mean_square(std::span<const Vector3<double>> frame) const {
    return mean_squared_row_ * mean_square_of_positions(frame);
  }

 private:
  double mean_squared_row_ = 0;
  double solution_ = 0;
  double epsilon_ = 0;
};

}  // namespace dynmesh
