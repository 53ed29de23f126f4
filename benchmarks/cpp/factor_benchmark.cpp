/// What the factorisation of detail's system costs on meshes of several sizes, in both orders, and
/// with one and two threads. Prints a table; times are the shortest of several runs, in which all
/// take turns. `dynmesh-factor-benchmark [LARGEST]`: the number of vertices on a side.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "detail_system.hpp"
#include "factor/masked_factor.hpp"
#include "meshes.hpp"
#include "support/workers.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

struct Subject {
  std::unique_ptr<Workers> workers;
  std::unique_ptr<MaskedFactor> factor;
  double prepare = 0;
  double factorize = 1e300;
  double solve = 1e300;
};

void measure(const char* name, const testing::Mesh<double>& mesh) {
  const SymmetricMatrix matrix = testing::system_of(mesh);
  std::vector<Subject> subjects;
  for (const Ordering ordering : {Ordering::minimum_degree, Ordering::nested_dissection}) {
    for (const Index threads : {1, 2}) {
      Subject& subject = subjects.emplace_back();
      subject.workers = std::make_unique<Workers>(threads);
      const auto start = Clock::now();
      subject.factor = std::make_unique<MaskedFactor>(matrix, *subject.workers, ordering);
      subject.prepare = milliseconds_since(start);
    }
  }
  for (const double known : {0.1, 0.3, 0.5}) {
    for (Subject& subject : subjects) subject.factorize = subject.solve = 1e300;
    for (unsigned seed = 0; seed < 5; ++seed) {
      const auto unknown = testing::random_mask(mesh.size(), 1 - known, seed);
      for (Subject& subject : subjects) {
        auto start = Clock::now();
        subject.factor->factorize(unknown);
        subject.factorize = std::min(subject.factorize, milliseconds_since(start));
        std::vector<Vector3<double>> values(3 * subject.factor->order().size(), {1, 2, 3});
        start = Clock::now();
        subject.factor->solve(values, 3);
        subject.solve = std::min(subject.solve, milliseconds_since(start));
      }
    }
    for (std::size_t i = 0; i < subjects.size(); i += 2) {
      const Subject& one = subjects[i];
      const Subject& two = subjects[i + 1];
      std::printf("%-6s %7zu  %2.0f %%  %-10s %8.0f %10.3g %9.3g %9.1f %9.1f %9.1f %9.1f\n", name,
                  mesh.size(), 100 * known, i == 0 ? "degree" : "dissection", one.prepare,
                  one.factor->cost().multiplications, one.factor->cost().entries, one.factorize,
                  two.factorize, one.solve, two.solve);
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace dynmesh

int main(int argc, char** argv) {
  const int largest = argc > 1 ? std::atoi(argv[1]) : 400;
  if (!dynmesh::has_nested_dissection()) std::puts("Without METIS, both orders are the same.");
  std::puts(
      "mesh   vertices known order     prepare,ms multiplied   entries factor,ms 2 threads "
      "solve3,ms 2 threads");
  for (int n = 100; n <= largest; n *= 2) {
    dynmesh::measure("sheet", dynmesh::testing::sheet<double>(n));
    dynmesh::measure("torus", dynmesh::testing::torus(n));
  }
}
