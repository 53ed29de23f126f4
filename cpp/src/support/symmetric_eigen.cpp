#include "support/symmetric_eigen.hpp"

#include <Eigen/Eigenvalues>

namespace dynmesh {
namespace {

template <int options>
using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, options, largest_symmetric,
                            largest_symmetric>;

}  // namespace

void symmetric_eigen(std::span<double> matrix, std::span<double> values) {
  const auto n = static_cast<Eigen::Index>(values.size());
  Eigen::Map<Small<Eigen::RowMajor>> rows(matrix.data(), n, n);
  const Small<Eigen::ColMajor> symmetric = rows;
  const Eigen::SelfAdjointEigenSolver<Small<Eigen::ColMajor>> solver(symmetric);
  rows = solver.eigenvectors().transpose();
  Eigen::Map<Eigen::VectorXd>(values.data(), n) = solver.eigenvalues();
}

}  // namespace dynmesh
