/// Method detail without training, and the parts of it.
#include "detail/detail.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/completer.hpp>
#include <limits>
#include <vector>

#include "detail/intrinsic_delaunay.hpp"
#include "detail/rotations.hpp"
#include "meshes.hpp"
#include "push.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

constexpr Settings detail = {.method = Method::detail};

/// A sheet stays where it is or moves as a whole for three frames, and then bends.
template <class Real>
void check_rest(const Settings& settings, double step, bool is_trained) {
  const Mesh<double> mesh = sheet<double>(10);
  const auto complete = [&](double x) {
    const auto as_real = [](const std::vector<double>& from) {
      return std::vector<Real>(from.begin(), from.end());
    };
    const Mesh<Real> first = {as_real(translated(mesh.vertices, x, -0.4 * x, 0.2 * x)),
                              mesh.indices};
    const auto shown = training_of(training_frames_of(as_real(mesh.vertices), 6));
    auto completer = is_trained ? Completer<Real>(first.faces(), first.points(), settings, shown)
                                : Completer<Real>(first.faces(), first.points(), settings);
    std::vector<std::vector<double>> results;
    for (unsigned n = 1; n <= 6; ++n) {
      auto frame = mesh.vertices;
      for (std::size_t i = 0; n > 3 && i < frame.size(); i += 3) {
        frame[i + 2] += 0.01 * (n - 3) * frame[i] * frame[i];
      }
      const double along = x + step * n;
      const auto points = as_real(translated(frame, along, -0.4 * x, 0.2 * x));
      const auto found = push(completer, points, random_mask(mesh.size(), 0.3, n));
      if (n <= (is_trained ? 3 : 4)) CHECK(completer.report().stages.blend == 0);
      if (n <= 3) CHECK(completer.report().stages.prior_share == 0);
      results.push_back(
          translated(std::vector<double>(found.begin(), found.end()), -along, 0.4 * x, -0.2 * x));
      if (n <= 3 || !settings.uncertainty) continue;
      const auto errors = completer.standard_error();
      results.emplace_back(errors.begin(), errors.end());
    }
    return results;
  };
  const auto here = complete(0);
  const auto there = complete(7.3);
  const double extent = 10 + 6 * step;
  const double rounding = 100 * extent * static_cast<double>(std::numeric_limits<Real>::epsilon());
  REQUIRE(here.size() == there.size());
  for (std::size_t i = 0; i < here.size(); ++i) {
    CHECK(largest_difference(here[i], there[i]) < rounding);
  }
}

TEST_CASE_TEMPLATE("nothing is made of the rounding errors of a subject at rest", Real, float,
                   double) {
  Settings settings = detail;
  bool is_trained = false;
  SUBCASE("exact") {}
  SUBCASE("noisy") { settings.noise = 0.01; }
  SUBCASE("learning") { settings.learn = true; }
  SUBCASE("with training") { is_trained = true; }
  SUBCASE("with error bars") { settings.uncertainty = true; }
  for (const double step : {0.0, 0.37, 30.0}) {
    CAPTURE(step);
    check_rest<Real>(settings, step, is_trained);
  }
}

TEST_CASE("noise that is too small to matter is small, however small") {
  const auto mesh = sheet<double>(8);
  const auto complete = [&](double noise) {
    Completer<double> completer(mesh.faces(), mesh.points(),
                                {.method = Method::detail, .noise = noise});
    std::vector<double> completed;
    for (unsigned n = 1; n < 8; ++n) {
      completed = push(completer, turned(mesh.vertices, 0.1 * n), random_mask(mesh.size(), 0.3, n));
    }
    return completed;
  };
  const auto expected = complete(1e-20);
  for (const double noise : {1e-155, 1e-160, 1e-170, std::numeric_limits<double>::denorm_min()}) {
    CAPTURE(noise);
    CHECK(complete(noise) == expected);
  }
  CHECK(largest_difference(complete(1), expected) > 1e-3);
}

TEST_CASE("a rotation is completed on every kind of mesh, more accurately than by motion") {
  auto mesh = sheet<double>(12);
  std::size_t first_disconnected = mesh.size();
  SUBCASE("open") {}
  SUBCASE("closed") {
    mesh = torus(12);
    first_disconnected = mesh.size();
  }
  SUBCASE("two coincident vertices") {
    std::copy_n(mesh.vertices.begin() + 120, 3, mesh.vertices.begin() + 123);
  }
  SUBCASE("needles") {
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) mesh.vertices[i + 1] *= 1e-9;
  }
  SUBCASE("a row of needles") {
    for (std::size_t v = 60; v < 72; ++v) mesh.vertices[3 * v + 1] = 4 + 1e-7;
  }
  SUBCASE("single triangles") {
    mesh = taken_apart(mesh);
    first_disconnected = mesh.size();
  }
  SUBCASE("one component disconnected") { mesh = join(mesh, sheet<double>(4, 14)); }
  const auto error = [&](Method method, double scale) {
    auto first = mesh.vertices;
    for (double& x : first) x *= scale;
    Completer<double> completer(mesh.faces(), {first.data(), mesh.size()}, {.method = method});
    double sum = 0;
    for (unsigned n = 1; n <= 8; ++n) {
      auto frame = translated<double>(turned(mesh.vertices, 0.1 * n), 0.3 * n, -0.2 * n, 0.1 * n);
      for (double& x : frame) x *= scale;
      auto known = random_mask(mesh.size(), 0.3, n);
      const auto disconnected = static_cast<std::ptrdiff_t>(first_disconnected);
      std::fill(known.begin() + disconnected, known.end(), std::uint8_t{0});
      const auto completed = push(completer, frame, known);
      for (std::size_t i = 0; i < frame.size(); ++i) sum += std::abs(completed[i] - frame[i]);
    }
    return sum / scale;
  };
  const double expected = error(Method::detail, 1);
  CHECK(expected < 0.75 * error(Method::motion, 1));
  for (const double scale : {1e-4, 1e6}) {
    CHECK(error(Method::detail, scale) == doctest::Approx(expected).epsilon(1e-3));
  }
}

TEST_CASE("the blend does not depend on rounding errors if the anchors do not determine it") {
  const auto mesh = taken_apart(sheet<double>(12));
  const auto complete = [&](double scale) {
    auto vertices = mesh.vertices;
    for (double& x : vertices) x *= scale;
    Completer<double> completer(mesh.faces(), {vertices.data(), mesh.size()}, detail);
    std::vector<double> completed;
    for (unsigned n = 1; n <= 60; ++n) {
      auto frame = turned(mesh.vertices, 0.1 * n);
      for (double& x : frame) x *= scale;
      completed = push(completer, frame, random_mask(mesh.size(), n < 4 ? 0.5 : 0.02, n));
    }
    for (double& x : completed) x /= scale;
    return completed;
  };
  const auto expected = complete(1);
  CHECK(largest(expected) < 40);
  for (const double scale : {1e-4, 1e6}) {
    CHECK(largest_difference(complete(scale), expected) < 1e-6);
  }
}

TEST_CASE("a vertex with too many neighbours is refused by detail and accepted by motion") {
  constexpr Index rim = 9000;
  std::vector<double> vertices(3 * (rim + 1));
  std::vector<Index> faces;
  for (Index v = 1; v <= rim; ++v) {
    vertices[3 * static_cast<std::size_t>(v)] = std::cos(v * 6.28 / rim);
    vertices[3 * static_cast<std::size_t>(v) + 1] = std::sin(v * 6.28 / rim);
    if (v < rim) faces.insert(faces.end(), {0, v, v + 1});
  }
  const Points<const double> frame(vertices.data(), rim + 1);
  CHECK(message_of([&] { Completer<double>(faces_of(faces), frame, detail); }) ==
        "faces: vertex 0 has 9000 neighbours, too many for method detail");
  CHECK_NOTHROW(Completer<double>(faces_of(faces), frame, {.method = Method::motion}));
}

TEST_CASE("if a cell does not determine a rotation, it keeps the last one") {
  auto mesh = sheet<double>(3);
  mesh.vertices.insert(mesh.vertices.end(), {5, 5, 5});  // isolated
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  Workers workers(1);
  Rotations rotations(topology.cells, workers, rows_of(mesh.vertices), 1);
  rotations.fit(rows_of(turned(mesh.vertices, 0.5)));
  const std::vector<Quaternion> before(rotations.quaternions().begin(),
                                       rotations.quaternions().end());
  CHECK(before.back().w == 1);
  SUBCASE("all vertices coincide") {
    rotations.fit(std::vector<Vector3<double>>(mesh.size(), Vector3<double>{1, 2, 3}));
  }
  SUBCASE("out of range") {
    rotations.fit(std::vector<Vector3<double>>(mesh.size(), Vector3<double>{1e308, 0, 0}));
  }
  for (std::size_t v = 0; v < before.size(); ++v) {
    CHECK(rotations.quaternions()[v].w == doctest::Approx(before[v].w));
    CHECK(rotations.quaternions()[v].z == doctest::Approx(before[v].z));
  }
}

using Matrix3 = Eigen::Matrix3d;

/// The rotations that a kernel fits to these covariances.
std::vector<Quaternion> turn(const RotationKernels& kernels,
                             const std::vector<Matrix3>& covariances,
                             const std::vector<Quaternion>& last) {
  const auto n = static_cast<Index>(covariances.size());
  std::vector<Covariance> given(covariances.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    for (int row = 0; row < 3; ++row) {
      const auto& s = covariances[i];
      given[i].rows[row] = {s(row, 0), s(row, 1), s(row, 2)};
    }
  }
  std::vector<Quaternion> quaternions = last;
  kernels.turn(given.data(), quaternions.data(), 0, n);
  return quaternions;
}

Eigen::Quaterniond eigen(const Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

/// The largest tr(R^T S) over all rotations R.
double largest_trace(const Matrix3& s) {
  const Eigen::JacobiSVD<Matrix3> svd(s, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d values = svd.singularValues();
  const bool is_reflected = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0;
  return values[0] + values[1] + (is_reflected ? -values[2] : values[2]);
}

/// Covariances of all ranks, with and without reflections and equal singular values, in several
/// orientations.
std::vector<Matrix3> covariances_of_every_kind() {
  const Eigen::Vector3d skew = Eigen::Vector3d(1, 2, 3).normalized();
  const double pi = std::acos(-1.0);
  std::vector<Matrix3> turns = {Matrix3::Identity()};
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1), skew}) {
    for (const double angle : {0.3, 3.0, pi - 1e-9, pi}) {
      turns.push_back(Eigen::AngleAxisd(angle, axis).toRotationMatrix());
    }
  }
  // Exactly half a turn, which the rounded value of pi does not give.
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d signs(-1, -1, -1);
    signs[axis] = 1;
    turns.emplace_back(signs.asDiagonal());
  }
  std::vector<Matrix3> found;
  const auto add = [&](double a, double b, double c) {
    for (const Matrix3& turn : turns) {
      for (const Matrix3& other : turns) {
        found.push_back(turn * Eigen::Vector3d(a, b, c).asDiagonal() * other.transpose());
      }
    }
  };
  for (const double sign : {1.0, -1.0}) {
    add(3, 2, sign);
    add(3, 1, sign);
    add(1, 1, sign);
    add(3, 3, sign);
    add(3, 2, sign * 1e-9);
    add(3, sign * 1e-3, 1e-9);
    add(3, sign * 1e-9, 1e-9);
    add(sign * 3, 0, 0);
    add(sign * 3, 2, 0);
    add(2, sign * 2, 0);
  }
  add(0, 0, 0);
  return found;
}

TEST_CASE("the best rotation is found for every covariance and from every last rotation") {
  const auto covariances = covariances_of_every_kind();
  std::vector<double> best;
  for (const Matrix3& s : covariances) best.push_back(largest_trace(s));
  const std::vector<Eigen::Quaterniond> starts = {
      {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}, Eigen::Quaterniond(1, 2, 3, 4).normalized()};
  for (const Kernels& level : runnable_kernels()) {
    const RotationKernels& kernels = level.rotations;
    for (const double scale : {1.0, 1e-12, 1e12, 1e-200, 1e200}) {
      for (const Eigen::Quaterniond& start : starts) {
        std::vector<Matrix3> given;
        for (const Matrix3& s : covariances) given.emplace_back(scale * s);
        const std::vector<Quaternion> last(given.size(),
                                           {start.w(), start.x(), start.y(), start.z()});
        const auto found = turn(kernels, given, last);
        double worst = 0;
        for (std::size_t i = 0; i < given.size(); ++i) {
          const Eigen::Quaterniond q = eigen(found[i]);
          const double trace = (q.toRotationMatrix().transpose() * covariances[i]).trace();
          const double error = std::abs(q.norm() - 1) + std::abs(trace - best[i]);
          worst = std::max(worst, std::isfinite(error) ? error : 1e300);
        }
        CAPTURE(scale);
        CAPTURE(start.x());
        CHECK(worst < 1e-6);
      }
    }
  }
}

TEST_CASE("if several rotations are equally good, the one nearest to the last is chosen") {
  const auto last = Eigen::Quaterniond(1, 2, 3, 4).normalized();
  const Matrix3 turned = last.toRotationMatrix();
  const Eigen::Vector3d along(1, 2, 2);
  const Matrix3 nothing = Matrix3::Zero();
  const Matrix3 line = turned * along * along.transpose();
  const Matrix3 reflection = -turned;  // followed by any half turn it is equally good
  for (const Kernels& level : runnable_kernels()) {
    const RotationKernels& kernels = level.rotations;
    const Quaternion given{last.w(), last.x(), last.y(), last.z()};
    const auto found = turn(kernels, {nothing, line}, {given, given});
    for (const Quaternion& q : found) CHECK(eigen(q).angularDistance(last) < 2e-6);
    const auto reflected = turn(kernels, {reflection}, {given});
    const auto again = turn(kernels, {reflection}, reflected);
    CHECK(eigen(again[0]).angularDistance(eigen(reflected[0])) < 2e-6);
  }
}

TEST_CASE("degenerate triangles and non-manifold edges are handled") {
  const std::vector<Vector3<double>> frame = {{0, 0, 0}, {1, 0, 0},   {1, 0, 0},      {2, 0, 0},
                                              {0, 1, 0}, {0.5, 9, 0}, {0.5, -1e-9, 0}};
  const std::vector<Triangle> faces = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 0, 5}, {0, 1, 6},
                                       {3, 3, 4}, {0, 1, 4}, {1, 0, 4}, {4, 3, 5}, {5, 3, 4}};
  const auto triangles = intrinsic_delaunay(faces, frame, 1);
  CHECK(triangles.size() == 9);
  for (const auto& t : triangles) {
    CHECK(t.area() > 0);
    for (std::size_t s = 0; s < 3; ++s) CHECK(std::abs(t.cotangent(s)) < 1e6);
  }
}

}  // namespace
}  // namespace dynmesh::testing
