/// Factors of the systems of method detail.
#include <doctest/doctest.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cstdlib>
#include <random>
#include <vector>

#include "detail_system.hpp"
#include "linear/masked_factor.hpp"
#include "meshes.hpp"
#include "shared_work.hpp"

namespace dynmesh::testing {
namespace {

using Matrix = SparseMatrix;

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

/// The system of method detail, plus a small diagonal.
Matrix smooth_matrix(const Mesh<double>& mesh) {
  Matrix matrix = system_of(mesh);
  for (Index i = 0; i < matrix.cols(); ++i) matrix.coeffRef(i, i) += 0.1;
  return matrix;
}

bool are_same(const Vector3& a, const Vector3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// The solution computed by Eigen; entries outside the mask keep their `values`.
std::vector<Vector3> expected_solution(const Matrix& matrix, const std::vector<std::uint8_t>& mask,
                                       std::vector<Vector3> values) {
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
void solve(MaskedFactor& factor, std::vector<std::vector<Vector3>*> frames) {
  const auto order = factor.order();
  std::vector<Vector3> values;
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

/// The same for one frame, with the factor in single precision.
std::vector<Vector3> solved_in_single(MaskedFactor& factor, std::vector<Vector3> frame) {
  const auto order = factor.order();
  std::vector<float> values;
  for (const Index row : order) {
    const Vector3& v = frame[static_cast<std::size_t>(row)];
    for (const double number : {v.x, v.y, v.z, 0.0}) values.push_back(static_cast<float>(number));
  }
  factor.round();
  factor.solve_rounded(values);
  for (std::size_t r = 0; r < order.size(); ++r) {
    frame[static_cast<std::size_t>(order[r])] = {values[4 * r], values[4 * r + 1],
                                                 values[4 * r + 2]};
  }
  return frame;
}

double inner_product(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += a[i].x * b[i].x + a[i].y * b[i].y + a[i].z * b[i].z;
  return sum;
}

double largest_difference(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::sqrt(squared_norm(a[i] - b[i])));
  }
  return largest;
}

/// Blocks that are not coupled with each other.
Matrix in_blocks(const std::vector<Matrix>& blocks) {
  std::vector<Eigen::Triplet<double>> entries;
  int first = 0;
  for (const Matrix& block : blocks) {
    for (int j = 0; j < block.cols(); ++j) {
      for (Matrix::InnerIterator entry(block, j); entry; ++entry) {
        entries.emplace_back(first + static_cast<int>(entry.row()), first + j, entry.value());
      }
    }
    first += static_cast<int>(block.cols());
  }
  Matrix whole(first, first);
  whole.setFromTriplets(entries.begin(), entries.end());
  return whole;
}

void check_against_eigen(const Matrix& matrix, MaskedFactor& factor) {
  unsigned seed = 0;
  for (const double share : {0.0, 0.3, 0.9, 0.6, 1.0, 0.02}) {
    const auto mask = random_mask(static_cast<std::size_t>(matrix.cols()), share, ++seed);
    CAPTURE(share);
    factor.factorize(mask);
    std::vector<std::vector<Vector3>> given, expected;
    for (int n = 0; n < 3; ++n) {
      given.push_back(random_field(mask.size(), ++seed));
      expected.push_back(expected_solution(matrix, mask, given.back()));
    }
    const double size = std::sqrt(inner_product(expected[0], expected[0]));
    auto found = given;
    auto alone = given[0];
    solve(factor, {&alone});
    solve(factor, {&found[0], &found[1], &found[2]});
    CHECK(largest_difference(alone, expected[0]) < 1e-6);
    CHECK(largest_difference(solved_in_single(factor, given[0]), expected[0]) < 1e-4 * size);
    for (std::size_t n = 0; n < 3; ++n) CHECK(largest_difference(found[n], expected[n]) < 1e-6);
    const double product = inner_product(found[0], given[1]);
    CHECK(product == doctest::Approx(inner_product(given[0], found[1])).epsilon(1e-9 * size));
    CHECK(!factor.factorize(mask));
    auto again = given[0];
    solve(factor, {&again});
    CHECK(largest_difference(again, expected[0]) < 1e-6);
  }
}

TEST_CASE("a masked factor agrees with Eigen for every mask, kind of processor and threads") {
  Workers alone(1);
  Workers divided(1, in_small_pieces(1));
  Workers two(2, in_small_pieces(1));
  for (const Matrix& matrix :
       {random_matrix(1, 3), random_matrix(2, 3), random_matrix(5, 3), random_matrix(40, 3),
        random_matrix(400, 3), smooth_matrix(torus(24)),
        in_blocks({random_matrix(50, 1), smooth_matrix(torus(9)), random_matrix(1, 2),
                   random_matrix(20, 3), random_matrix(60, 4), random_matrix(2, 5)})}) {
    for (const Kernels& level : runnable_kernels()) {
      for (Workers* workers : {&alone, &divided, &two}) {
        CAPTURE(matrix.cols());
        CAPTURE(workers == &alone);
        MaskedFactor factor(matrix, *workers, level);
        check_against_eigen(matrix, factor);
      }
    }
  }
}

TEST_CASE("the solution is the same with any number of threads, to the last bit") {
  // Large enough that threads share the subtrees and the solves.
  const Matrix matrix = smooth_matrix(torus(40));
  std::vector<std::vector<Vector3>> expected;
  for (const Index threads : {1, 2, 3, -1}) {
    TaskSharing task_sharing = in_small_pieces();
    task_sharing.backwards = threads < 0;  // one thread that does everything in another order
    Workers workers(std::abs(threads), task_sharing);
    MaskedFactor factor(matrix, workers);
    std::size_t n = 0;
    for (const double share : {0.9, 0.5}) {
      const auto mask = random_mask(static_cast<std::size_t>(matrix.cols()), share, 1);
      const auto by_factor = shared_pieces([&] { factor.factorize(mask); });
      auto one = random_field(mask.size(), 2), two = random_field(mask.size(), 3);
      auto three = random_field(mask.size(), 4), alone = one, rounded = one;
      const auto by_solve = shared_pieces([&] {
        solve(factor, {&alone});
        rounded = solved_in_single(factor, rounded);
        solve(factor, {&one, &two, &three});
      });
      CHECK((by_factor > 0) == (threads > 1));
      CHECK((by_solve > 0) == (threads > 1));
      for (const auto& solution : {one, two, three, alone, rounded}) {
        if (threads == 1) {
          expected.push_back(solution);
        } else {
          CHECK(std::ranges::equal(solution, expected[n++], are_same));
        }
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
  Workers workers(1);
  MaskedFactor factor(matrix, workers);
  const std::vector<std::uint8_t> all(6, 1);
  factor.factorize(all);
  std::vector<Vector3> values(6);
  values[2] = {1, 0, 0};
  solve(factor, {&values});
  CHECK(values[2].x == doctest::Approx(3));
  for (std::size_t i = 3; i < 6; ++i) CHECK(values[i].x == 0);
}

}  // namespace
}  // namespace dynmesh::testing
