#include "base/symmetric_eigen.hpp"

#include <Eigen/Eigenvalues>

namespace dynmesh {
namespace {

/// `most` rows at most, or any number in memory.
template <int most>
void find_eigen(std::span<double> matrix, std::span<double> values) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most, most>;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto n = static_cast<Eigen::Index>(values.size());
  Eigen::Map<Rows> rows(matrix.data(), n, n);
  const Matrix symmetric = rows;
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(symmetric);
  rows = solver.eigenvectors().transpose();
  Eigen::Map<Eigen::VectorXd>(values.data(), n) = solver.eigenvalues();
}

}  // namespace

void symmetric_eigen(std::span<double> matrix, std::span<double> values) {
  const auto find = values.size() <= largest_without_memory
                        ? find_eigen<static_cast<int>(largest_without_memory)>
                        : find_eigen<Eigen::Dynamic>;
  find(matrix, values);
}

}  // namespace dynmesh
