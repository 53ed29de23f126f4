/// Eigenvalues and eigenvectors of small symmetric matrices.
#pragma once

#include <span>

namespace dynmesh {

/// The most rows that such a matrix may have.
inline constexpr int largest_symmetric = 76;

/// Replaces a symmetric matrix by its eigenvectors, as rows of unit length, and finds its
/// eigenvalues, which ascend. Allocates no memory, and compiles the solver of Eigen once for all.
///
/// `matrix` has n x n numbers for the n of `values`, of which the lower triangle is read.
void symmetric_eigen(std::span<double> matrix, std::span<double> values);

}  // namespace dynmesh
