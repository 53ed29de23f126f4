/// The factorisation of detail's system beside those of other libraries, on the same systems in one
/// thread, each with a new mask: CHOLMOD, if it was found when this was compiled, PARDISO of the
/// MKL, likewise, and Eigen. Prints a table of milliseconds, the shortest of several runs, in which
/// all take turns. `dynmesh-factor-baselines [LARGEST]`: the number of vertices on a side.
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>
#ifdef DYNMESH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif
#ifdef DYNMESH_MKL
#include <Eigen/PardisoSupport>
#endif

#include "base/workers.hpp"
#include "detail_system.hpp"
#include "linear/masked_factor.hpp"
#include "meshes.hpp"

namespace dynmesh {
namespace {

using Sparse = SparseMatrix;
using Positions = Eigen::Matrix<double, Eigen::Dynamic, 3>;
using Mask = std::vector<std::uint8_t>;

/// Milliseconds of the parts of solving a system: what depends on its structure alone, the numbers
/// of the factor, and three right-hand sides.
using Times = std::array<double, 3>;

struct Method {
  std::string name;
  std::function<Times(const Sparse&, const Mask&)> run;
  Times least = {};
};

/// Runs the three parts, each of which is a function, and times them.
template <class... Part>
Times timed(const Part&... parts) {
  Times times{};
  std::size_t i = 0;
  const auto run = [&](const auto& part) {
    const auto start = std::chrono::steady_clock::now();
    part();
    const auto end = std::chrono::steady_clock::now();
    times.at(i++) = std::chrono::duration<double, std::milli>(end - start).count();
  };
  (run(parts), ...);
  return times;
}

/// The rows and columns that the mask contains.
Sparse part_of(const Sparse& whole, const Mask& mask) {
  std::vector<Index> row_of(mask.size(), -1);
  Index n = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] != 0) row_of[i] = n++;
  }
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (Index j = 0; j < whole.cols(); ++j) {
    for (Sparse::InnerIterator e(whole, j); e; ++e) {
      const Index row = row_of[e.row()];
      if (row >= 0 && row_of[j] >= 0) entries.emplace_back(row, row_of[j], e.value());
    }
  }
  Sparse part(n, n);
  part.setFromTriplets(entries.begin(), entries.end());
  return part;
}

template <class Solver>
Times run(const Sparse& matrix, const Mask& /*mask*/) {
  Solver solver;
  const Positions right = Positions::Ones(matrix.rows(), 3);
  Positions solution;
  return timed([&] { solver.analyzePattern(matrix); }, [&] { solver.factorize(matrix); },
               [&] { solution = solver.solve(right); });
}

std::vector<Method> methods_for(const Sparse& whole, Workers& workers) {
  const auto factor = std::make_shared<MaskedFactor>(whole, workers);
  std::vector<Method> methods;
  // The structure is found together with the numbers.
  methods.push_back(
      {"dynmesh", [factor](const Sparse& matrix, const Mask& mask) {
         std::vector<Vector3> values(static_cast<std::size_t>(matrix.rows()), {1, 1, 1});
         return timed([] {}, [&] { factor->factorize(mask); }, [&] { factor->solve(values, 1); });
       }});
#ifdef DYNMESH_CHOLMOD
  methods.push_back({"CHOLMOD, supernodal", run<Eigen::CholmodSupernodalLLT<Sparse>>});
  methods.push_back({"CHOLMOD, simplicial", run<Eigen::CholmodSimplicialLLT<Sparse>>});
#endif
#ifdef DYNMESH_MKL
  methods.push_back({"PARDISO", run<Eigen::PardisoLLT<Sparse>>});
#endif
  methods.push_back({"Eigen", run<Eigen::SimplicialLLT<Sparse>>});
  return methods;
}

void measure(const char* name, const testing::Mesh<double>& mesh) {
  const Sparse whole = testing::system_of(mesh);
  Workers workers(1);
  auto methods = methods_for(whole, workers);
  for (const double known : {0.1, 0.5}) {
    for (Method& method : methods) method.least.fill(std::numeric_limits<double>::infinity());
    for (unsigned seed = 0; seed < 5; ++seed) {
      const Mask unknown = testing::random_mask(mesh.size(), 1 - known, seed);
      const Sparse matrix = part_of(whole, unknown);
      for (Method& method : methods) {
        const Times times = method.run(matrix, unknown);
        for (std::size_t i = 0; i < times.size(); ++i) {
          method.least.at(i) = std::min(method.least.at(i), times.at(i));
        }
      }
    }
    for (const Method& method : methods) {
      const auto& [structure, numbers, solution] = method.least;
      std::printf("%s,%zu,%.0f,\"%s\",%.2f,%.2f,%.2f,%.2f\n", name, mesh.size(), 100 * known,
                  method.name.c_str(), structure, numbers, solution,
                  (structure + numbers + solution) /
                      (methods[0].least[0] + methods[0].least[1] + methods[0].least[2]));
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace dynmesh

int main(int argc, char** argv) {
  const int largest = argc > 1 ? std::atoi(argv[1]) : 200;
  std::puts("mesh,vertices,known (%),method,structure,numbers,solution,\"sum, relative\"");
  for (int n = 100; n <= largest; n *= 2) {
    dynmesh::measure("sheet", dynmesh::testing::sheet<double>(n));
    dynmesh::measure("torus", dynmesh::testing::torus(n));
  }
}
