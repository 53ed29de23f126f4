#include "surface_fit/surface_colours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/geometry.hpp"
#include "base/statistics.hpp"

namespace dynmesh {
namespace {

/// Of the sum of the shares of its points, so much tells the colour of a vertex.
constexpr double least_share = 0.25;

const Vector3& colour_of(const MatchedPoints& points, std::size_t i) {
  return points.scan->colours[points.numbers[i]];
}

bool is_known(const SurfaceColours& colours, const Place& place) {
  return std::ranges::all_of(place.corners, [&](auto v) { return colours.is_known[v] != 0; });
}

/// Two orthogonal directions along a triangle, in the first of which colours vary most; the squared
/// change of colours over a unit of length in each, and how far the surface has to move there to
/// lose a difference of colours.
struct ColourStep {
  std::array<Vector3, 2> along;
  std::array<double, 2> square{}, length{};
};

ColourStep colour_step(const Place& place, Field x, Field colours, const Vector3& difference) {
  const auto& [i, j, k] = place.corners;
  const auto side = x[j] - x[i];
  const auto other = x[k] - x[i];
  const double length = std::sqrt(squared_norm(side));
  const double area = std::sqrt(squared_norm(cross(side, other)));
  ColourStep step;
  if (!(area > 0)) return step;
  // The first side and what is across it, and how colours change there.
  const auto u = (1 / length) * side;
  const auto v = (length / area) * (other - dot(other, u) * u);
  const auto along_u = (1 / length) * (colours[j] - colours[i]);
  const auto along_v = (length / area) * (colours[k] - colours[i] - dot(other, u) * along_u);
  const double uu = squared_norm(along_u);
  const double vv = squared_norm(along_v);
  const double angle = std::atan2(2 * dot(along_u, along_v), uu - vv) / 2;
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  step.along = {cosine * u + sine * v, cosine * v - sine * u};
  const std::array changes = {cosine * along_u + sine * along_v, cosine * along_v - sine * along_u};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    step.square[axis] = squared_norm(changes[axis]);
    if (!(step.square[axis] > 0)) continue;
    step.length[axis] = dot(changes[axis], difference) / step.square[axis];
  }
  return step;
}

}  // namespace

void add_colour_rows(Field x, const SurfaceColours& colours, const MatchedPoints& points,
                     const TrackingConstants& constants, Workers& workers,
                     std::vector<SurfaceRow>& rows) {
  std::vector<std::size_t> compared;  // rows
  std::vector<Vector3> differences;   // by which the surface has other colours
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const SurfaceRow& row = rows[r];
    if (row.number == no_point || !is_known(colours, row)) continue;
    compared.push_back(r);
    differences.push_back(row.on(colours.of_vertices) - colour_of(points, row.number));
  }
  if (compared.size() < constants.fewest) return;
  const Vector3 common = median_of(differences);
  std::vector<double> lengths;
  for (Vector3& difference : differences) {
    difference = difference - common;
    lengths.push_back(std::sqrt(squared_norm(difference)));
  }
  const double usual = median(lengths);
  if (!(usual > 0)) return;
  const double per_square = std::pow(constants.colour_noise * points.mean_edge / usual, 2);
  std::vector<std::array<SurfaceRow, 2>> added(compared.size());
  workers.for_each_in_chunks(compared.size(), [&](std::size_t i) {
    const SurfaceRow& row = rows[compared[i]];
    const ColourStep step = colour_step(row, x, colours.of_vertices, differences[i]);
    const double off = lengths[i] / (constants.usual_colours * usual);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double weight = std::min(1.0, step.square[axis] * per_square);
      if (weight < constants.least_colour_weight) continue;
      const double far = step.length[axis] / (constants.farthest_colour * points.mean_edge);
      SurfaceRow& along = added[i][axis] = row;
      along.normal = step.along[axis];
      along.point = row.on(x) + step.length[axis] * along.normal;
      along.weight = row.weight * weight / std::pow((1 + off * off) * (1 + far * far), 2);
      along.is_along = true;
    }
  });
  for (const auto& of_point : added) {
    for (const SurfaceRow& row : of_point) {
      if (row.weight > 0) rows.push_back(row);
    }
  }
}

void learn_colours(const MatchedPoints& points, const TrackingConstants& constants,
                   SurfaceColours& colours) {
  if (points.scan == nullptr || points.scan->colours.empty()) return;
  std::vector<std::size_t> fresh;    // points beside vertices without a colour
  std::vector<Vector3> differences;  // of others
  std::vector<double> shares(colours.is_known.size());
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const Place& place = points.places[i];
    if (points.is_far(place) || points.agrees[i] == 0) continue;
    if (is_known(colours, place)) {
      differences.push_back(place.on(colours.of_vertices) - colour_of(points, i));
      continue;
    }
    fresh.push_back(i);
    for (std::size_t s = 0; s < 3; ++s) shares[place.corners[s]] += place.shares[s];
  }
  if (fresh.empty()) return;
  const bool has_common = differences.size() >= constants.fewest;
  const Vector3 common = has_common ? median_of(differences) : Vector3{};
  std::vector<std::uint8_t> is_new(shares.size());
  for (std::size_t v = 0; v < shares.size(); ++v) {
    is_new[v] = colours.is_known[v] == 0 && shares[v] > least_share ? 1 : 0;
  }
  // The means of the points are those of places beside the vertices; what they leave of the colours
  // is distributed again.
  for (int fit = 0; fit < constants.colour_fits; ++fit) {
    std::vector<Vector3> sums(shares.size());
    for (const std::size_t i : fresh) {
      const Place& place = points.places[i];
      const bool is_fitted = fit > 0 && is_known(colours, place);
      const Vector3 expected = is_fitted ? place.on(colours.of_vertices) : Vector3{};
      if (fit > 0 && !is_fitted) continue;
      const auto left = colour_of(points, i) + common - expected;
      for (std::size_t s = 0; s < 3; ++s) {
        const auto v = place.corners[s];
        if (is_new[v] != 0) sums[v] = sums[v] + place.shares[s] * left;
      }
    }
    for (std::size_t v = 0; v < shares.size(); ++v) {
      if (is_new[v] == 0) continue;
      colours.of_vertices[v] = colours.of_vertices[v] + (1 / shares[v]) * sums[v];
      colours.is_known[v] = 1;
    }
  }
}

}  // namespace dynmesh
