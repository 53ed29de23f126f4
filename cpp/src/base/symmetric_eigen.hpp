/// Eigenvalues and eigenvectors of symmetric matrices.
#pragma once

#include <cstddef>
#include <span>

namespace dynmesh {

/// The most rows for which the function below allocates no memory. More would need more of the
/// stack than the threads of some systems have.
inline constexpr std::size_t largest_without_memory = 32;

/// Replaces a symmetric matrix by its eigenvectors, as rows of unit length, and finds its
/// eigenvalues, which ascend. Compiles the solver of Eigen once for all.
///
/// `matrix` has n x n numbers for the n of `values`, of which the lower triangle is read.
void symmetric_eigen(std::span<double> matrix, std::span<double> values);

}  // namespace dynmesh
