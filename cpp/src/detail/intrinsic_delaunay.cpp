#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "detail/detail_operator.hpp"

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

/// A side of a triangle.
struct Side {
  Index triangle = -1;  // -1 if there is no such side
  std::size_t side = 0;
};

class Flipping {
 public:
  explicit Flipping(std::vector<IntrinsicTriangle> triangles)
      : triangles_(std::move(triangles)), across_(triangles_.size()) {
    glue();
  }

  std::vector<IntrinsicTriangle> run() {
    std::vector<Side> open;
    for (std::size_t t = triangles_.size(); t-- > 0;) {
      for (std::size_t s = 0; s < 3; ++s) open.push_back({static_cast<Index>(t), s});
    }
    std::size_t flips_left = flips_per_side * open.size();
    while (!open.empty() && flips_left > 0) {
      const Side side = open.back();
      open.pop_back();
      if (!flip_if_needed(side)) continue;
      --flips_left;
      // The side is now one of the new edge. The four edges around it may have to be flipped.
      for (const Side& half : {side, across(side)}) {
        open.push_back({half.triangle, following(half.side)});
        open.push_back({half.triangle, preceding(half.side)});
      }
    }
    return std::move(triangles_);
  }

 private:
  IntrinsicTriangle& triangle(const Side& side) { return triangles_[side.triangle]; }
  Side& across(const Side& side) { return across_[side.triangle][side.side]; }

  /// Connects the two sides of every edge that has exactly two, one in each direction.
  void glue() {
    struct Directed {
      std::pair<Index, Index> edge;
      bool is_ascending;
      Side side;
    };
    std::vector<Directed> all;
    all.reserve(3 * triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      for (std::size_t s = 0; s < 3; ++s) {
        const Index a = triangles_[t].vertices[s];
        const Index b = triangles_[t].vertices[following(s)];
        all.push_back({{std::min(a, b), std::max(a, b)}, a < b, {static_cast<Index>(t), s}});
      }
    }
    std::ranges::stable_sort(all, {}, &Directed::edge);
    for (auto first = all.begin(); first != all.end();) {
      const auto is_other = [&](const Directed& one) { return one.edge != first->edge; };
      const auto last = std::find_if(first, all.end(), is_other);
      if (last - first == 2 && first[0].is_ascending != first[1].is_ascending) {
        join(first[0].side, first[1].side);
      }
      first = last;
    }
  }

  bool flip_if_needed(const Side& side) {
    const Side other = across(side);
    if (other.triangle < 0 || other.triangle == side.triangle) return false;
    const IntrinsicTriangle near = triangle(side);
    const IntrinsicTriangle far = triangle(other);
    if (near.cotangent(side.side) + far.cotangent(other.side) >= -tolerance) return false;

    // Lay out both triangles in the plane: the edge runs from u at 0 along x to v, with w on its
    // left and z on its right.
    const double edge = near.lengths[side.side];
    const double vw = near.lengths[following(side.side)];
    const double wu = near.lengths[preceding(side.side)];
    const double uz = far.lengths[following(other.side)];
    const double zv = far.lengths[preceding(other.side)];
    const double along = (wu * wu - vw * vw - uz * uz + zv * zv) / (2 * edge);
    const double apart = 2 * (near.area() + far.area()) / edge;
    const double diagonal = std::hypot(along, apart);
    const auto u = near.vertices[side.side];
    const auto v = near.vertices[following(side.side)];
    const auto w = near.vertices[preceding(side.side)];
    const auto z = far.vertices[preceding(other.side)];
    const IntrinsicTriangle at_u = {{z, w, u}, {diagonal, wu, uz}};
    const IntrinsicTriangle at_v = {{w, z, v}, {diagonal, zv, vw}};
    if (!(at_u.area() > 0) || !(at_v.area() > 0)) return false;

    const Side beyond_vw = across({side.triangle, following(side.side)});
    const Side beyond_wu = across({side.triangle, preceding(side.side)});
    const Side beyond_uz = across({other.triangle, following(other.side)});
    const Side beyond_zv = across({other.triangle, preceding(other.side)});
    put(side, at_u);
    put(other, at_v);
    // If a side was glued to one of the two triangles themselves, it has moved with it.
    const auto moved = [&](const Side& old) {
      if (old.triangle == side.triangle) {
        return old.side == following(side.side) ? Side{other.triangle, preceding(other.side)}
                                                : Side{side.triangle, following(side.side)};
      }
      if (old.triangle == other.triangle) {
        return old.side == following(other.side) ? Side{side.triangle, preceding(side.side)}
                                                 : Side{other.triangle, following(other.side)};
      }
      return old;
    };
    join({side.triangle, following(side.side)}, moved(beyond_wu));
    join({side.triangle, preceding(side.side)}, moved(beyond_uz));
    join({other.triangle, following(other.side)}, moved(beyond_zv));
    join({other.triangle, preceding(other.side)}, moved(beyond_vw));
    return true;
  }

  /// Replaces the triangle of `side`, so that side 0 of `placed` becomes `side`.
  void put(const Side& side, const IntrinsicTriangle& placed) {
    IntrinsicTriangle& target = triangle(side);
    for (std::size_t s = 0; s < 3; ++s) {
      target.vertices[(side.side + s) % 3] = placed.vertices[s];
      target.lengths[(side.side + s) % 3] = placed.lengths[s];
    }
  }

  void join(const Side& a, const Side& b) {
    across(a) = b;
    if (b.triangle >= 0) across(b) = a;
  }

  std::vector<IntrinsicTriangle> triangles_;
  std::vector<std::array<Side, 3>> across_;
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

std::vector<IntrinsicTriangle> intrinsic_delaunay(std::span<const Triangle> faces,
                                                  std::span<const Vector3<double>> frame,
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
