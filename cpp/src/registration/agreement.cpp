#include "registration/agreement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "support/geometry.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {
namespace {

using Field = std::span<const Vector3<double>>;

/// The point of a segment that is nearest to p.
Vector3<double> nearest_on(const Vector3<double>& a, const Vector3<double>& b,
                           const Vector3<double>& p) {
  const auto edge = b - a;
  const double square = squared_norm(edge);
  const double share = square > 0 ? std::clamp(dot(p - a, edge) / square, 0.0, 1.0) : 0;
  return a + share * edge;
}

/// The point of a triangle that is nearest to p: its foot, if that is inside, or else on a side.
Vector3<double> nearest_on(const std::array<Vector3<double>, 3>& corners,
                           const Vector3<double>& p) {
  const auto normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double square = squared_norm(normal);
  bool is_inside = square > 0;
  for (std::size_t side = 0; is_inside && side < 3; ++side) {
    const auto& a = corners[side];
    const auto& b = corners[(side + 1) % 3];
    is_inside = dot(cross(b - a, p - a), normal) >= 0;
  }
  if (is_inside) return p - (dot(p - corners[0], normal) / square) * normal;
  Vector3<double> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t side = 0; side < 3; ++side) {
    const auto on_side = nearest_on(corners[side], corners[(side + 1) % 3], p);
    const double distance = squared_norm(on_side - p);
    if (!(distance < least)) continue;
    least = distance;
    best = on_side;
  }
  return best;
}

/// The faces around each vertex.
struct Fans {
  std::vector<std::size_t> ends;
  std::vector<std::size_t> faces;

  Fans(std::span<const Triangle> triangles, std::size_t n_vertices) : ends(n_vertices + 1) {
    for (const Triangle& t : triangles) {
      for (const Index v : t) ++ends[static_cast<std::size_t>(v) + 1];
    }
    for (std::size_t v = 0; v < n_vertices; ++v) ends[v + 1] += ends[v];
    faces.resize(ends.back());
    auto next = ends;
    for (std::size_t f = 0; f < triangles.size(); ++f) {
      for (const Index v : triangles[f]) faces[next[static_cast<std::size_t>(v)]++] = f;
    }
  }
};

}  // namespace

/// The nearest place is sought in the faces around the corners of the face whose centre is nearest.
Agreement agreement_of(std::span<const Triangle> faces, Field x, const Measurement& scan,
                       double far, const RegistrationConstants& constants, Workers& workers) {
  constexpr double everywhere = std::numeric_limits<double>::infinity();
  constexpr double any_normal = -2;
  const Fans fans(faces, x.size());
  const auto corners_of = [&](std::size_t f) {
    const auto corner = [&](std::size_t c) { return x[static_cast<std::size_t>(faces[f][c])]; };
    return std::array{corner(0), corner(1), corner(2)};
  };
  PointScan centres;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto corners = corners_of(f);
    centres.points.push_back((1.0 / 3) * (corners[0] + corners[1] + corners[2]));
  }
  centres.normals.resize(faces.size());
  centres.index();

  const std::size_t stride = 1 + scan.size() / constants.examined_points;
  const std::size_t n = (scan.size() + stride - 1) / stride;
  enum class Kind : std::uint8_t { away, opposed, explained };
  std::vector<Kind> kinds(n);
  std::vector<double> squares(n);
  workers.for_each_short_chunk(static_cast<Index>(n), [&](Index first, Index last) {
    for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(last); ++i) {
      const auto p = scan.point(i * stride);
      const auto start = centres.find(p, {}, everywhere, any_normal).index;
      double least = everywhere;
      std::size_t nearest = start;
      for (const Index v : faces[start]) {
        const auto at = static_cast<std::size_t>(v);
        for (std::size_t e = fans.ends[at]; e < fans.ends[at + 1]; ++e) {
          const std::size_t f = fans.faces[e];
          const double square = squared_norm(nearest_on(corners_of(f), p) - p);
          if (!(square < least)) continue;
          least = square;
          nearest = f;
        }
      }
      squares[i] = least;
      const auto corners = corners_of(nearest);
      const auto normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
      const double cosine = dot(normal, scan.normal(i * stride)) / std::sqrt(squared_norm(normal));
      const bool agrees = scan.is_undecided(i * stride)
                              ? std::abs(cosine) >= constants.undecided_cosine
                              : !(cosine < constants.least_cosine);
      kinds[i] = !(least <= far * far) ? Kind::away : agrees ? Kind::explained : Kind::opposed;
    }
  });
  Agreement result;
  double n_near = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (kinds[i] == Kind::away) {
      result.far_share += 1 / static_cast<double>(n);
      continue;
    }
    if (kinds[i] == Kind::opposed) result.disagreeing += 1 / static_cast<double>(n);
    n_near += 1;
    result.distance += squares[i];
  }
  result.distance = n_near > 0 ? std::sqrt(result.distance / n_near) : 0;
  return result;
}

}  // namespace dynmesh
