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
constexpr double least_known = 0.25;

const Vector3& colour_of(const MatchedPoints& points, std::size_t i) {
  return points.scan->colours[points.numbers[i]];
}

bool are_known(const SurfaceColours& colours, const auto& corners) {
  return std::ranges::all_of(corners, [&](auto v) { return colours.is_known[v] != 0; });
}

/// The gradients of the three colours along a surface.
using Gradients = std::array<Vector3, 3>;

/// (k,) at the vertices: the means of those of the triangles around whose colours are known,
/// weighted by area, since small ones tell little. Colours vary linearly on each triangle.
std::vector<Gradients> gradients_of(std::span<const Triangle> faces, Field x,
                                    const SurfaceColours& colours) {
  std::vector<Gradients> sums(x.size());
  std::vector<double> areas(x.size());
  for (const Triangle& face : faces) {
    const auto normal = normal_of(face, x);
    const double area = std::sqrt(squared_norm(normal));
    if (!(area > 0) || !are_known(colours, face)) continue;
    Gradients of_face{};
    for (std::size_t s = 0; s < 3; ++s) {
      const auto side = x[at(face[(s + 2) % 3])] - x[at(face[(s + 1) % 3])];
      const auto across = (1 / area) * cross(normal, side);
      const Vector3& colour = colours.of_vertices[at(face[s])];
      of_face[0] = of_face[0] + colour.x * across;
      of_face[1] = of_face[1] + colour.y * across;
      of_face[2] = of_face[2] + colour.z * across;
    }
    for (const Index v : face) {
      areas[at(v)] += area;
      for (std::size_t c = 0; c < 3; ++c) sums[at(v)][c] = sums[at(v)][c] + of_face[c];
    }
  }
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (!(areas[v] > 0)) continue;
    for (Vector3& gradient : sums[v]) gradient = (1 / areas[v]) * gradient;
  }
  return sums;
}

/// Two orthogonal directions along a surface, in the first of which colours vary most; the squared
/// change of colours over a unit of length in each, and how far the surface has to move there to
/// lose a difference of colours.
struct ColourStep {
  std::array<Vector3, 2> along;
  std::array<double, 2> square{}, length{};
};

ColourStep colour_step(const Gradients& gradients, const Vector3& normal,
                       const Vector3& difference) {
  // The longest gradient in the plane, and what is across it.
  const auto in_plane = [&](const Vector3& g) { return g - dot(g, normal) * normal; };
  const Gradients flat = {in_plane(gradients[0]), in_plane(gradients[1]), in_plane(gradients[2])};
  const auto u = unit_of(
      *std::ranges::max_element(flat, {}, [](const Vector3& g) { return squared_norm(g); }));
  const auto v = cross(normal, u);
  const auto along = [&](const Vector3& axis) {
    return Vector3{dot(flat[0], axis), dot(flat[1], axis), dot(flat[2], axis)};
  };
  const auto along_u = along(u);
  const auto along_v = along(v);
  const double angle =
      std::atan2(2 * dot(along_u, along_v), squared_norm(along_u) - squared_norm(along_v)) / 2;
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  ColourStep step;
  const Vector3 first = cosine * u + sine * v;
  const Vector3 second = cosine * v - sine * u;
  step.along = {first, second};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto changes = along(step.along[axis]);
    step.square[axis] = squared_norm(changes);
    if (step.square[axis] > 0) step.length[axis] = dot(changes, difference) / step.square[axis];
  }
  return step;
}

struct Mean {
  Vector3 sum;
  double weight = 0;

  void add(double more, const Vector3& value) {
    sum = sum + more * value;
    weight += more;
  }
};

/// (clusters,) the means of each and its neighbours; 0 where there is nothing.
std::vector<Vector3> around(const Clusters& clusters, std::span<const Mean> means) {
  std::vector<Vector3> found(clusters.size());
  for (std::size_t c = 0; c < found.size(); ++c) {
    Mean mean = means[c];
    for (const Index other : clusters.neighbours[c]) {
      mean.sum = mean.sum + means[at(other)].sum;
      mean.weight += means[at(other)].weight;
    }
    if (mean.weight > 0) found[c] = (1 / mean.weight) * mean.sum;
  }
  return found;
}

}  // namespace

void add_colour_rows(std::span<const Triangle> faces, Field x, const SurfaceColours& colours,
                     const MatchedPoints& points, const TrackingConstants& constants,
                     const Clusters& clusters, Workers& workers, std::vector<SurfaceRow>& rows) {
  std::vector<std::size_t> compared;  // rows
  std::vector<Vector3> differences;   // by which the surface has other colours
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const SurfaceRow& row = rows[r];
    if (row.number == no_point || !are_known(colours, row.corners)) continue;
    compared.push_back(r);
    differences.push_back(row.on(colours.of_vertices) - colour_of(points, row.number));
  }
  if (compared.size() < constants.fewest) return;
  const auto cluster_of = [&](std::size_t i) {
    return at(clusters.of_vertex[rows[compared[i]].nearest_corner()]);
  };
  std::vector<Mean> means(clusters.size());
  for (std::size_t i = 0; i < compared.size(); ++i) {
    means[cluster_of(i)].add(rows[compared[i]].weight, differences[i]);
  }
  const auto common = around(clusters, means);
  std::vector<double> lengths;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    differences[i] = differences[i] - common[cluster_of(i)];
    lengths.push_back(std::sqrt(squared_norm(differences[i])));
  }
  const double usual = median(lengths);
  if (!(usual > 0)) return;
  const double per_square = std::pow(constants.colour_noise * points.mean_edge / usual, 2);
  const auto gradients = gradients_of(faces, x, colours);
  std::vector<std::array<SurfaceRow, 2>> added(compared.size());
  workers.for_each_in_chunks(compared.size(), [&](std::size_t i) {
    const SurfaceRow& row = rows[compared[i]];
    Gradients at_place{};
    for (std::size_t s = 0; s < 3; ++s) {
      for (std::size_t c = 0; c < 3; ++c) {
        at_place[c] = at_place[c] + row.shares[s] * gradients[row.corners[s]][c];
      }
    }
    const ColourStep step = colour_step(at_place, row.normal, differences[i]);
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
    if (are_known(colours, place.corners)) {
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
    is_new[v] = colours.is_known[v] == 0 && shares[v] > least_known ? 1 : 0;
  }
  // The means of the points are those of places beside the vertices; what they leave of the colours
  // is distributed again.
  for (int fit = 0; fit < constants.colour_fits; ++fit) {
    std::vector<Vector3> sums(shares.size());
    for (const std::size_t i : fresh) {
      const Place& place = points.places[i];
      const bool is_fitted = fit > 0 && are_known(colours, place.corners);
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
