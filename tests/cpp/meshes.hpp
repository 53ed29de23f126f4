/// Small meshes and masks for the tests.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <random>
#include <string>
#include <vector>

namespace dynmesh::testing {

template <class Real>
struct Mesh {
  std::vector<Real> vertices;
  std::vector<Index> indices;

  [[nodiscard]] std::size_t size() const { return vertices.size() / 3; }
  [[nodiscard]] Faces faces() const { return {indices.data(), indices.size() / 3}; }
  [[nodiscard]] Points<const Real> points() const { return {vertices.data(), size()}; }
};

/// x y z of each vertex, as the library has them.
template <class Real>
std::vector<Vector3> rows_of(const std::vector<Real>& vertices) {
  std::vector<Vector3> rows;
  for (std::size_t i = 0; i < vertices.size(); i += 3) {
    rows.push_back({vertices[i], vertices[i + 1], vertices[i + 2]});
  }
  return rows;
}

template <class Real>
std::vector<std::array<Index, 3>> triangles_of(const Mesh<Real>& mesh) {
  std::vector<std::array<Index, 3>> faces;
  for (std::size_t f = 0; f < mesh.faces().count; ++f) faces.push_back(mesh.faces()[f]);
  return faces;
}

inline Faces faces_of(const std::vector<Index>& indices) {
  return {indices.data(), indices.size() / 3};
}

/// A bumpy sheet of n by n vertices, with two triangles per square, shifted along x by `offset`.
template <class Real>
Mesh<Real> sheet(int n, double offset = 0) {
  Mesh<Real> mesh;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      mesh.vertices.push_back(static_cast<Real>(j + offset));
      mesh.vertices.push_back(static_cast<Real>(i));
      mesh.vertices.push_back(static_cast<Real>(0.3 * std::sin(1.3 * i + 0.7 * j)));
    }
  }
  for (Index i = 0; i + 1 < n; ++i) {
    for (Index j = 0; j + 1 < n; ++j) {
      const Index v = i * n + j;
      for (const Index corner : {v, v + 1, v + n, v + 1, v + n + 1, v + n}) {
        mesh.indices.push_back(corner);
      }
    }
  }
  return mesh;
}

/// A torus of n by n vertices, which is a closed surface.
inline Mesh<double> torus(int n) {
  Mesh<double> mesh;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double u = 2 * 3.14159265358979 * i / n;
      const double v = 2 * 3.14159265358979 * j / n;
      const double r = 3 + std::cos(v);
      mesh.vertices.insert(mesh.vertices.end(), {r * std::cos(u), r * std::sin(u), std::sin(v)});
      const Index a = i * n + j;
      const Index b = i * n + (j + 1) % n;
      const Index c = (i + 1) % n * n + j;
      const Index d = (i + 1) % n * n + (j + 1) % n;
      mesh.indices.insert(mesh.indices.end(), {a, c, b, b, c, d});
    }
  }
  return mesh;
}

/// Joins two meshes without connecting them.
template <class Real>
Mesh<Real> join(const Mesh<Real>& a, const Mesh<Real>& b) {
  Mesh<Real> both = a;
  both.vertices.insert(both.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Index v : b.indices) both.indices.push_back(v + static_cast<Index>(a.size()));
  return both;
}

inline std::vector<Vector3> random_field(std::size_t rows, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Vector3> field(rows);
  for (auto& x : field) x = {normal(random), normal(random), normal(random)};
  return field;
}

inline std::vector<std::uint8_t> random_mask(std::size_t k, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution known(share);
  std::vector<std::uint8_t> mask(k);
  for (auto& m : mask) m = known(random) ? 1 : 0;
  return mask;
}

template <class Real>
std::vector<Real> translated(const std::vector<Real>& vertices, Real x, Real y, Real z) {
  std::vector<Real> moved = vertices;
  for (std::size_t i = 0; i < moved.size(); i += 3) {
    moved[i] += x;
    moved[i + 1] += y;
    moved[i + 2] += z;
  }
  return moved;
}

/// Rotates about the z axis.
template <class Real>
std::vector<Real> turned(const std::vector<Real>& vertices, double angle) {
  std::vector<Real> moved = vertices;
  for (std::size_t i = 0; i < moved.size(); i += 3) {
    const double x = vertices[i];
    const double y = vertices[i + 1];
    moved[i] = static_cast<Real>(std::cos(angle) * x - std::sin(angle) * y);
    moved[i + 1] = static_cast<Real>(std::sin(angle) * x + std::cos(angle) * y);
  }
  return moved;
}

/// Returns the message of the exception that `call` throws, or "" if it throws no std::exception.
template <class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace dynmesh::testing
