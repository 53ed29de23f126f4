/// Smooth displacements of whole patches of a surface, in which its linear system is small.
#pragma once

#include <Eigen/Sparse>
#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <functional>
#include <span>
#include <vector>

#include "detail/rotations.hpp"
#include "tracking/surface_rows.hpp"

namespace dynmesh {

/// The second level of a preconditioner of A = (N + rows): A^-1 is approximated by
/// Psi (Psi^T A Psi)^-1 Psi^T, beside a sparse factor that treats the three coordinates alike
/// (smoothed aggregation, Vanek, Mandel and Brezina 1996; additive Schwarz). Points resist only
/// along their normals, so a limb slides along itself with hardly any resistance, and conjugate
/// gradients with that factor alone find such motions of large patches last.
///
/// Each patch is a cluster of clusters, of about 50 vertices, and its function is 1 in it, averaged
/// over one-rings until it is smooth; the functions add up to 1 at each vertex. Allocates memory in
/// the constructor, and in `factorize`.
class CoarseSpace {
 public:
  using Field = std::span<const Vector3<double>>;
  /// Sets `product` (k,) to N times a field (k,).
  using Multiply = std::function<void(Field field, std::span<Vector3<double>> product)>;

  /// `clusters` are those of frame 0. It costs a product with N for every three patches.
  CoarseSpace(const Cells& cells, Field first_frame, const Clusters& clusters,
              const Multiply& multiply);

  /// Factors the small system for rows whose weights are multiplied by `factor`. `held` (k,) are
  /// further weights, of the three coordinates alike.
  void factorize(const SurfaceRows& rows, double factor, std::span<const double> held);

  /// Adds the approximation of A^-1 times `residual` (k,) to `x` (k,).
  void add(Field residual, std::span<Vector3<double>> x);

 private:
  /// The value of the function of a patch at a vertex.
  struct Share {
    std::uint32_t patch = 0;
    double value = 0;
  };
  /// Two patches whose functions meet in N; the first has the larger number, or both are the same.
  struct Pair {
    std::array<std::uint32_t, 2> patches{};
    double n = 0;  ///< their entry of Psi^T N Psi
  };
  using Block = std::array<double, 6>;  // of a symmetric matrix: xx, xy, xz, yy, yz, zz
  using Matrix = Eigen::SparseMatrix<double>;

  void find_shares(const Cells& cells, std::span<const std::uint32_t> patch_of);
  void find_pairs(std::size_t n_patches, const Multiply& multiply);
  [[nodiscard]] std::span<const Share> shares_of(std::size_t vertex) const {
    return std::span(shares_).subspan(ends_[vertex], ends_[vertex + 1] - ends_[vertex]);
  }

  std::vector<std::uint32_t> ends_;  // vertex v has shares_[ends_[v]] to shares_[ends_[v + 1] - 1]
  std::vector<Share> shares_;        // of a vertex, by ascending patches
  std::vector<Pair> pairs_;
  std::vector<std::uint32_t>
      pair_of_;  // of each two shares of a vertex, in the order of a triangle
  std::vector<Block> at_vertices_, blocks_;  // of the rows, at vertices and for pairs
  Matrix matrix_;
  std::vector<std::array<double*, 9>>
      entries_;  // in the matrix, of each pair; null above diagonals
  Eigen::SimplicialLLT<Matrix> factor_;
  Eigen::VectorXd right_side_, solution_;
};

}  // namespace dynmesh
