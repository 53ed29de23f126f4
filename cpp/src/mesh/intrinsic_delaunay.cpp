#include "mesh/intrinsic_delaunay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/geometry.hpp"

namespace dynmesh {
namespace {

/// The minimum by which two sides of a triangle are longer than the third.
constexpr double slack = 1e-4;

/// Prevents rounding errors from flipping an edge back and forth.
constexpr double tolerance = 1e-10;

/// The limit on the number of flips, far more than Delaunay flips take in practice. It prevents an
/// endless loop caused by rounding.
constexpr std::size_t flips_per_side = 50;

std::size_t following(std::size_t side) { return (side + 1) % 3; }
std::size_t preceding(std::size_t side) { return (side + 2) % 3; }

/// Flips edges. Half-edge 3 t + s is side s of triangle t.
class Flipping {
 public:
  explicit Flipping(std::vector<IntrinsicTriangle> triangles)
      : triangles_(std::move(triangles)), across_(3 * triangles_.size(), none) {
    // Connect the two half-edges of every edge that has exactly two, one in each direction.
    const auto edge_of = [&](Index half) { return std::minmax({begin(half), begin(next(half))}); };
    std::vector<Index> all(across_.size());
    std::iota(all.begin(), all.end(), Index{0});
    std::ranges::stable_sort(all, {}, edge_of);
    for (auto first = all.begin(); first != all.end();) {
      const auto is_other = [&](Index half) { return edge_of(half) != edge_of(*first); };
      const auto last = std::find_if(first, all.end(), is_other);
      if (last - first == 2 && begin(first[0]) != begin(first[1])) join(first[0], first[1]);
      first = last;
    }
  }

  std::vector<IntrinsicTriangle> run() {
    std::vector<Index> open;
    for (std::size_t t = triangles_.size(); t-- > 0;) {
      for (std::size_t s = 0; s < 3; ++s) open.push_back(static_cast<Index>(3 * t + s));
    }
    std::size_t flips_left = flips_per_side * open.size();
    while (!open.empty() && flips_left > 0) {
      const Index half = open.back();
      open.pop_back();
      if (!flip_if_needed(half)) continue;
      --flips_left;
      // It is now one of the new edge. The four edges around that may have to be flipped.
      for (const Index h : {half, across_[half]}) {
        open.push_back(next(h));
        open.push_back(previous(h));
      }
    }
    return std::move(triangles_);
  }

 private:
  static std::size_t side(Index half) { return at(half) % 3; }
  static Index next(Index half) { return half - half % 3 + (half + 1) % 3; }
  static Index previous(Index half) { return half - half % 3 + (half + 2) % 3; }

  IntrinsicTriangle& triangle(Index half) { return triangles_[half / 3]; }
  Index& begin(Index half) { return triangle(half).vertices[side(half)]; }
  double& length(Index half) { return triangle(half).lengths[side(half)]; }

  void join(Index a, Index b) {
    across_[a] = b;
    if (b != none) across_[b] = a;
  }

  bool flip_if_needed(Index half) {
    const Index other = across_[half];
    if (other == none || other / 3 == half / 3) return false;
    const IntrinsicTriangle& near = triangle(half);
    const IntrinsicTriangle& far = triangle(other);
    if (near.cotangent(side(half)) + far.cotangent(side(other)) >= -tolerance) return false;

    // Lay out both triangles in the plane: the edge runs from u at 0 along x to v, with w on its
    // left and z on its right.
    const double edge = length(half);
    const double vw = length(next(half));
    const double wu = length(previous(half));
    const double uz = length(next(other));
    const double zv = length(previous(other));
    const double along = (wu * wu - vw * vw - uz * uz + zv * zv) / (2 * edge);
    const double apart = 2 * (near.area() + far.area()) / edge;
    const double diagonal = std::hypot(along, apart);
    const Index u = begin(half), v = begin(next(half));
    const Index w = begin(previous(half)), z = begin(previous(other));
    const IntrinsicTriangle at_u = {{z, w, u}, {diagonal, wu, uz}};
    const IntrinsicTriangle at_v = {{w, z, v}, {diagonal, zv, vw}};
    if (!(at_u.area() > 0) || !(at_v.area() > 0)) return false;

    // The other sides wu, uz, zv and vw each take the place of the one before them. One that was
    // glued to another of them finds it there.
    const std::array from = {previous(half), next(other), previous(other), next(half)};
    const std::array to = {next(half), previous(half), next(other), previous(other)};
    std::array<Index, 4> beyond{};
    for (std::size_t i = 0; i < 4; ++i) {
      const Index old = across_[from[i]];
      const auto found = std::ranges::find(from, old);
      beyond[i] = found == from.end() ? old : to[found - from.begin()];
    }
    put(half, at_u);
    put(other, at_v);
    for (std::size_t i = 0; i < 4; ++i) join(to[i], beyond[i]);
    return true;
  }

  /// Replaces the triangle of `half`, which becomes side 0 of `placed`.
  void put(Index half, const IntrinsicTriangle& placed) {
    for (std::size_t s = 0; s < 3; ++s, half = next(half)) {
      begin(half) = placed.vertices[s];
      length(half) = placed.lengths[s];
    }
  }

  std::vector<IntrinsicTriangle> triangles_;
  std::vector<Index> across_;  // the other half-edge of an edge, or none
};

}  // namespace

/// Heron's formula in the form of Kahan, which is stable for needle-like triangles.
double IntrinsicTriangle::area() const {
  std::array<double, 3> sides = lengths;
  std::ranges::sort(sides, std::greater<>());
  const auto [a, b, c] = sides;
  const double product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
  return product > 0 ? std::sqrt(product) / 4 : 0;
}

double IntrinsicTriangle::cotangent(std::size_t side) const {
  const double a = lengths[side];
  const double b = lengths[following(side)];
  const double c = lengths[preceding(side)];
  return (b * b + c * c - a * a) / std::max(4 * area(), std::numeric_limits<double>::min());
}

std::vector<IntrinsicTriangle> intrinsic_delaunay(std::span<const Triangle> faces, Field frame,
                                                  double unit) {
  std::vector<IntrinsicTriangle> triangles;
  double missing = 0;
  for (const Triangle& face : faces) {
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    IntrinsicTriangle triangle = {face, {}};
    for (std::size_t s = 0; s < 3; ++s) {
      const auto& a = frame[face[s]];
      const auto& b = frame[face[following(s)]];
      triangle.lengths[s] =
          std::hypot(b.x / unit - a.x / unit, b.y / unit - a.y / unit, b.z / unit - a.z / unit);
    }
    for (std::size_t s = 0; s < 3; ++s) {
      const double excess =
          triangle.lengths[following(s)] + triangle.lengths[preceding(s)] - triangle.lengths[s];
      missing = std::max(missing, slack - excess);
    }
    triangles.push_back(triangle);
  }
  for (IntrinsicTriangle& triangle : triangles) {
    for (double& length : triangle.lengths) length += missing;
  }
  return Flipping(std::move(triangles)).run();
}

}  // namespace dynmesh
