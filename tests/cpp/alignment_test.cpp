/// The rigid motion that puts a template into a scan.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <dynmesh/alignment.hpp>
#include <vector>

#include "meshes.hpp"
#include "scans.hpp"

namespace dynmesh::testing {
namespace {

using Rows = std::vector<double>;

/// A rotation about z, one about x and another about z, and then a shift.
Rows placed(const Rows& rows, const std::array<double, 3>& angles,
            const std::array<double, 3>& shift) {
  // What `turned` does about z, with x as the axis.
  const auto cycled = [](Rows given) {
    for (auto i = given.begin(); i != given.end(); i += 3) std::rotate(i, i + 1, i + 3);
    return given;
  };
  const Rows tilted = cycled(cycled(turned(cycled(turned(rows, angles[0])), angles[1])));
  return translated(turned(tilted, angles[2]), shift[0], shift[1], shift[2]);
}

Rows moved_by(const Alignment& found, const Rows& rows) {
  Rows moved = rows;
  for (std::size_t i = 0; i < rows.size(); i += 3) {
    for (std::size_t c = 0; c < 3; ++c) {
      moved[i + c] = found.shift[c];
      for (std::size_t d = 0; d < 3; ++d) moved[i + c] += found.rotation[3 * c + d] * rows[i + d];
    }
  }
  return moved;
}

Alignment found_between(const Mesh<double>& mesh, const Rows& scan) {
  return find_alignment<double>(mesh.faces(), mesh.points(), {scan.data(), scan.size() / 3});
}

/// A smooth body with bumps and without symmetries. It is open at its two poles.
Mesh<double> bumpy_body(int n) {
  Mesh<double> mesh = sheet<double>(n);
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    const double polar =
        0.1 + 2.94 * static_cast<double>(v / static_cast<std::size_t>(n)) / (n - 1);
    const double around = 6.2832 * static_cast<double>(v % static_cast<std::size_t>(n)) / (n - 1);
    const double x = std::sin(polar) * std::cos(around);
    const double y = std::sin(polar) * std::sin(around);
    const double z = std::cos(polar);
    const double radius =
        1 + 0.25 * std::sin(3 * x + 1) * std::cos(2 * y) + 0.2 * std::sin(2.5 * z + x);
    mesh.vertices[3 * v] = 1.3 * radius * x;
    mesh.vertices[3 * v + 1] = radius * y;
    mesh.vertices[3 * v + 2] = 0.7 * radius * z;
  }
  return mesh;
}

const Mesh<double>& body() {
  static const Mesh<double> mesh = bumpy_body(24);
  return mesh;
}

Rows scan_of_body() { return scan_of(body(), body().vertices).points; }

constexpr std::array<std::array<double, 3>, 4> rotations = {
    {{0.4, 0.2, -0.3}, {1.9, 1.2, 0.6}, {-2.6, 2.9, 1.1}, {0, 3.1, 2.2}}};
constexpr std::array<double, 3> away = {30, -14, 52};

}  // namespace

TEST_CASE("a template that was moved rigidly is found again from any rotation") {
  for (const auto& angles : rotations) {
    const auto found = found_between(body(), placed(scan_of_body(), angles, away));
    CHECK(found.before > 5);
    CHECK(found.after < 0.3);
    CHECK_FALSE(found.lies_in_scan);
    CHECK(found.matches);
    CHECK(found.ratio == doctest::Approx(1).epsilon(0.1));
    CHECK(found.mean_edge == doctest::Approx(mean_edge(body())).epsilon(0.05));
    const Rows expected = placed(body().vertices, angles, away);
    CHECK(largest_difference(moved_by(found, body().vertices), expected) < 0.3 * found.mean_edge);
  }
}

TEST_CASE("a template that lies in the scan stays") {
  const auto found = found_between(body(), scan_of_body());
  CHECK(found.lies_in_scan);
  CHECK(found.matches);
  CHECK(found.before < 0.3);
  CHECK(found.after == found.before);
  CHECK(moved_by(found, body().vertices) == body().vertices);
}

TEST_CASE("the scan of one side is enough") {
  const Rows whole = scan_of_body();
  Rows side;
  for (std::size_t i = 0; i < whole.size(); i += 3) {
    if (whole[i + 1] < 0) continue;
    side.insert(side.end(), whole.begin() + static_cast<std::ptrdiff_t>(i),
                whole.begin() + static_cast<std::ptrdiff_t>(i + 3));
  }
  for (const auto& angles : rotations) {
    const auto found = found_between(body(), placed(side, angles, away));
    CHECK(found.matches);
    const Rows expected = placed(body().vertices, angles, away);
    CHECK(largest_difference(moved_by(found, body().vertices), expected) < 0.5 * found.mean_edge);
  }
}

TEST_CASE("a scan that has more else than of the template, and some points far away") {
  Rows scan = scan_of_body();
  for (const double height : {3.0, 6.0}) {
    const Rows other = placed(scan_of_body(), {1, 2, 3}, {0, 0, height});
    scan.insert(scan.end(), other.begin(), other.end());
  }
  for (int i = 0; i < 20; ++i) scan.insert(scan.end(), {1e6, 1e7 * i, -1e6});
  const auto found = found_between(body(), scan);
  CHECK(found.lies_in_scan);
  CHECK_FALSE(found.other_unit);
}

TEST_CASE("a template lies in the scan of a part of it") {
  Rows scan = scan_of_body();
  scan.resize(scan.size() / 12 * 3);
  CHECK(found_between(body(), scan).lies_in_scan);
}

TEST_CASE("the unit of length does not matter") {
  Mesh<double> other = body();
  Rows scan = placed(scan_of_body(), rotations[0], away);
  const auto expected = found_between(other, scan);
  // The squares of the first two are out of range.
  for (const double unit : {std::ldexp(1, 650), std::ldexp(1, -900), 1e4}) {
    for (std::size_t i = 0; i < scan.size(); ++i) scan[i] *= unit;
    for (double& x : other.vertices) x *= unit;
    const auto found = found_between(other, scan);
    CHECK(found.before == doctest::Approx(expected.before).epsilon(1e-9));
    CHECK(found.after == doctest::Approx(expected.after).epsilon(1e-6));
    CHECK(found.mean_edge / unit == doctest::Approx(expected.mean_edge).epsilon(1e-9));
    for (std::size_t i = 0; i < 9; ++i) {
      CHECK(found.rotation[i] == doctest::Approx(expected.rotation[i]).epsilon(1e-6));
    }
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(found.shift[c] / unit == doctest::Approx(expected.shift[c]).epsilon(1e-6));
    }
    for (double& x : scan) x /= unit;
    for (double& x : other.vertices) x /= unit;
  }
}

TEST_CASE("another size, another unit, another shape") {
  Rows scan = scan_of_body();
  for (double& x : scan) x *= 2;
  const auto twice = found_between(body(), scan);
  CHECK(twice.ratio == doctest::Approx(2).epsilon(0.1));
  CHECK_FALSE(twice.other_unit);
  CHECK_FALSE(twice.lies_in_scan);

  for (double& x : scan) x *= 500;
  const auto thousandth = found_between(body(), scan);
  CHECK(thousandth.ratio == doctest::Approx(1000).epsilon(0.1));
  CHECK(thousandth.other_unit);
  CHECK_FALSE(thousandth.matches);
  CHECK(thousandth.after == thousandth.before);
  CHECK(moved_by(thousandth, body().vertices) == body().vertices);

  const Mesh<double> flat = sheet<double>(40);
  const auto other = found_between(body(), placed(flat.vertices, rotations[0], away));
  CHECK_FALSE(other.other_unit);
  CHECK_FALSE(other.matches);
}

TEST_CASE("one point, and a template without extent") {
  const Rows point = {1, 2, 3};
  CHECK_FALSE(found_between(body(), point).matches);
  const Mesh<double> dot = {{1, 2, 3, 1, 2, 3, 1, 2, 3}, {0, 1, 2}};
  const auto found = found_between(dot, scan_of_body());
  CHECK_FALSE(found.matches);
  CHECK(std::ranges::all_of(found.rotation, [](double x) { return std::isfinite(x); }));
}

}  // namespace dynmesh::testing
