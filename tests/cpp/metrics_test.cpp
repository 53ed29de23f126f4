#include <doctest/doctest.h>

#include <cmath>
#include <dynmesh/metrics.hpp>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("NMSVE of a triangle with one moved vertex, computed by hand") {
  const std::vector<Index> faces = {0, 1, 2};
  const Topology topology = build_topology(faces_of(faces), 3);
  const std::vector<double> truth = {0, 0, 0, 3, 0, 0, 0, 4, 0};
  std::vector<double> moved = truth;
  moved[2] = 12;  // vertex 0 at (0, 0, 12)
  const Points<const double> v(truth.data(), 3);
  const Points<const double> w(moved.data(), 3);
  CHECK(nmsve(topology.cells, v, v) == 0);

  // Edge lengths of the reference: 3, 4, 5; of the completion: sqrt(9 + 144), sqrt(16 + 144), 5.
  const double d1 = std::sqrt(153.0);
  const double d2 = std::sqrt(160.0);
  struct P {
    double x, y, z;
  };
  const auto mean = [](P a, double da, P b, double db) {
    const double sum = 1 / da + 1 / db;
    return P{(a.x / da + b.x / db) / sum, (a.y / da + b.y / db) / sum, (a.z / da + b.z / db) / sum};
  };
  const auto distance = [](P a, P b) { return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z); };
  const auto minus = [](P a, P b) { return P{a.x - b.x, a.y - b.y, a.z - b.z}; };
  const P a{0, 0, 0};
  const P b{3, 0, 0};
  const P c{0, 4, 0};
  const P m{0, 0, 12};
  double sum = 12;
  sum += distance(minus(a, mean(b, 3, c, 4)), minus(m, mean(b, d1, c, d2)));
  sum += distance(minus(b, mean(a, 3, c, 5)), minus(b, mean(m, d1, c, 5)));
  sum += distance(minus(c, mean(a, 4, b, 5)), minus(c, mean(m, d2, b, 5)));
  CHECK(nmsve(topology.cells, v, w) == doctest::Approx(sum / 6).epsilon(1e-14));
}

TEST_CASE("an isolated vertex contributes only its distance") {
  const std::vector<Index> faces = {0, 1, 2};
  const Topology topology = build_topology(faces_of(faces), 4);
  const std::vector<float> truth = {0, 0, 0, 3, 0, 0, 0, 4, 0, 9, 9, 9};
  std::vector<float> moved = truth;
  moved[10] = 5;
  CHECK(nmsve<float>(topology.cells, {truth.data(), 4}, {moved.data(), 4}) == doctest::Approx(0.5));
}

TEST_CASE("a summary has the mean, root mean square, 99th percentile and maximum") {
  std::vector<double> errors(201);
  for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = static_cast<double>(200 - i);
  const ErrorSummary s = summary(errors);
  CHECK(s.mean == doctest::Approx(100));
  CHECK(s.rms == doctest::Approx(std::sqrt(200.0 * 401 / 6)));
  CHECK(s.p99 == doctest::Approx(198));
  CHECK(s.maximum == 200);
  CHECK(summary(std::vector<double>{7}).p99 == 7);
}

}  // namespace
}  // namespace dynmesh::testing
