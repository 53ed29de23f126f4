#include "factor/masked_factor.hpp"

#include <doctest/doctest.h>

#include <Eigen/SparseCholesky>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

/// L L^T of the graph of random faces, plus a small diagonal.
Matrix random_matrix(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> pick(0, n - 1);
  std::uniform_real_distribution<double> weight(0.1, 1);
  std::vector<Eigen::Triplet<double>> entries;
  for (int e = 0; e < 2 * n; ++e) {
    const int a = pick(random);
    const int b = e % 3 == 0 ? pick(random) : std::min(a + 1 + e % 2, n - 1);
    const double w = weight(random);
    entries.insert(entries.end(), {{a, a, w}, {b, b, w}, {a, b, -w}, {b, a, -w}});
  }
  for (int i = 0; i < n; ++i) entries.emplace_back(i, i, 0.01);
  Matrix laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  return laplacian * laplacian.transpose();
}

SymmetricMatrix converted(const Matrix& matrix) {
  SymmetricMatrix result;
  result.offsets.assign(matrix.outerIndexPtr(), matrix.outerIndexPtr() + matrix.cols() + 1);
  result.rows.assign(matrix.innerIndexPtr(), matrix.innerIndexPtr() + matrix.nonZeros());
  result.values.assign(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros());
  return result;
}

std::vector<Vector3<double>> random_vectors(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Vector3<double>> values(n);
  for (auto& v : values) v = {normal(random), normal(random), normal(random)};
  return values;
}

/// The solution computed by Eigen; entries outside the mask keep their `values`.
std::vector<Vector3<double>> expected_solution(const Matrix& matrix,
                                               const std::vector<std::uint8_t>& mask,
                                               std::vector<Vector3<double>> values) {
  std::vector<int> chosen;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] != 0) chosen.push_back(static_cast<int>(i));
  }
  const auto n = static_cast<Eigen::Index>(chosen.size());
  Matrix selection(matrix.rows(), n);
  for (Eigen::Index j = 0; j < n; ++j) {
    selection.insert(chosen[static_cast<std::size_t>(j)], j) = 1;
  }
  const Matrix block = selection.transpose() * matrix * selection;
  Eigen::MatrixXd right(n, 3);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto& v = values[static_cast<std::size_t>(chosen[static_cast<std::size_t>(j)])];
    right.row(j) << v.x, v.y, v.z;
  }
  const Eigen::SimplicialLLT<Matrix> cholesky(block);
  REQUIRE(cholesky.info() == Eigen::Success);
  const Eigen::MatrixXd solution = cholesky.solve(right);
  for (Eigen::Index j = 0; j < n; ++j) {
    values[static_cast<std::size_t>(chosen[static_cast<std::size_t>(j)])] = {
        solution(j, 0), solution(j, 1), solution(j, 2)};
  }
  return values;
}

/// Solves for 1 or 3 frames at once; entries outside the mask keep their values.
void solve(const MaskedFactor& factor, std::vector<std::vector<Vector3<double>>*> frames) {
  const auto order = factor.order();
  std::vector<Vector3<double>> values;
  for (const Index row : order) {
    for (const auto* frame : frames) values.push_back((*frame)[static_cast<std::size_t>(row)]);
  }
  if (values.empty()) return;
  factor.solve(values, static_cast<int>(frames.size()));
  std::size_t n = 0;
  for (const Index row : order) {
    for (auto* frame : frames) (*frame)[static_cast<std::size_t>(row)] = values[n++];
  }
}

double largest_difference(const std::vector<Vector3<double>>& a,
                          const std::vector<Vector3<double>>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::sqrt(squared_norm(a[i] - b[i])));
  }
  return largest;
}

TEST_CASE("a masked factor agrees with Eigen for every mask and kind of processor") {
  for (const int n : {1, 2, 5, 40, 400}) {
    const Matrix matrix = random_matrix(n, 3);
    for (const Kernels& level : runnable_kernels()) {
      const DenseKernels& kernels = level.dense;
      MaskedFactor factor(converted(matrix), kernels);
      unsigned seed = 0;
      for (const double share : {0.0, 0.3, 0.9, 0.6, 1.0, 0.02}) {
        const auto mask = random_mask(static_cast<std::size_t>(n), share, ++seed);
        factor.factorize(mask);
        auto one = random_vectors(mask.size(), ++seed);
        auto two = random_vectors(mask.size(), ++seed);
        const auto expected_one = expected_solution(matrix, mask, one);
        auto three = random_vectors(mask.size(), ++seed);
        const auto expected_two = expected_solution(matrix, mask, two);
        const auto expected_three = expected_solution(matrix, mask, three);
        auto alone = one;
        solve(factor, {&alone});
        solve(factor, {&one, &two, &three});
        CHECK(largest_difference(alone, expected_one) < 1e-6);
        CHECK(largest_difference(one, expected_one) < 1e-6);
        CHECK(largest_difference(two, expected_two) < 1e-6);
        CHECK(largest_difference(three, expected_three) < 1e-6);
        CHECK(!factor.factorize(mask));
        auto again = alone = random_vectors(mask.size(), ++seed);
        solve(factor, {&again});
        CHECK(largest_difference(again, expected_solution(matrix, mask, alone)) < 1e-6);
      }
    }
  }
}

TEST_CASE("singular directions have no part in the solution") {
  // Two chains, of which only the first is constrained.
  Matrix matrix(6, 6);
  for (const int i : {0, 1, 3, 4}) {
    matrix.coeffRef(i, i) += 1;
    matrix.coeffRef(i + 1, i + 1) += 1;
    matrix.coeffRef(i, i + 1) -= 1;
    matrix.coeffRef(i + 1, i) -= 1;
  }
  matrix.coeffRef(0, 0) += 1;
  matrix.makeCompressed();
  MaskedFactor factor(converted(matrix));
  const std::vector<std::uint8_t> all(6, 1);
  factor.factorize(all);
  std::vector<Vector3<double>> values(6);
  values[2] = {1, 0, 0};
  solve(factor, {&values});
  CHECK(values[2].x == doctest::Approx(3));
  for (std::size_t i = 3; i < 6; ++i) CHECK(values[i].x == 0);
}

}  // namespace
}  // namespace dynmesh::testing
