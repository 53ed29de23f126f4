#include "tracking/surface_places.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace dynmesh {
namespace {

Vector3<double> smallest(const Vector3<double>& a, const Vector3<double>& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}

Vector3<double> largest(const Vector3<double>& a, const Vector3<double>& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

/// The barycentric coordinates of the place of a triangle that is nearest to the origin (Ericson
/// 2005).
std::array<double, 3> nearest_shares(const Vector3<double>& a, const Vector3<double>& b,
                                     const Vector3<double>& c) {
  const auto ab = b - a;
  const auto ac = c - a;
  const double a1 = -dot(ab, a);
  const double a2 = -dot(ac, a);
  if (a1 <= 0 && a2 <= 0) return {1, 0, 0};
  const double b1 = -dot(ab, b);
  const double b2 = -dot(ac, b);
  if (b1 >= 0 && b2 <= b1) return {0, 1, 0};
  const double of_c = a1 * b2 - b1 * a2;
  if (of_c <= 0 && a1 >= 0 && b1 <= 0) {
    const double share = a1 / (a1 - b1);
    return {1 - share, share, 0};
  }
  const double c1 = -dot(ab, c);
  const double c2 = -dot(ac, c);
  if (c2 >= 0 && c1 <= c2) return {0, 0, 1};
  const double of_b = c1 * a2 - a1 * c2;
  if (of_b <= 0 && a2 >= 0 && c2 <= 0) {
    const double share = a2 / (a2 - c2);
    return {1 - share, 0, share};
  }
  const double of_a = b1 * c2 - c1 * b2;
  if (of_a <= 0 && b2 >= b1 && c1 >= c2) {
    const double share = (b2 - b1) / ((b2 - b1) + (c1 - c2));
    return {0, 1 - share, share};
  }
  const double sum = of_a + of_b + of_c;
  return {1 - of_b / sum - of_c / sum, of_b / sum, of_c / sum};
}

}  // namespace

void SurfacePlaces::divide(Field frame) {
  const auto n = static_cast<std::uint32_t>(faces_.size());
  std::vector<Vector3<double>> centres;
  for (const Triangle& face : faces_) {
    Vector3<double> sum;
    for (const Index v : face) sum = sum + frame[static_cast<std::size_t>(v)];
    centres.push_back(sum);
  }
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.assign(1, {{}, {}, 0, n});
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const auto [first, count] = std::pair(nodes_[i].first, nodes_[i].count);
    if (count <= leaf_size) continue;
    const auto begin = order_.begin() + first;
    auto least = centres[*begin];
    auto most = least;
    for (auto f = begin; f != begin + count; ++f) {
      least = smallest(least, centres[*f]);
      most = largest(most, centres[*f]);
    }
    const auto size = most - least;
    const auto axis = size.x >= size.y && size.x >= size.z ? &Vector3<double>::x
                      : size.y >= size.z                   ? &Vector3<double>::y
                                                           : &Vector3<double>::z;
    const std::uint32_t half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(centres[a].*axis, a) < std::pair(centres[b].*axis, b);
    });
    nodes_[i].first = static_cast<std::uint32_t>(nodes_.size());
    nodes_[i].count = 0;
    nodes_.push_back({{}, {}, first, half});
    nodes_.push_back({{}, {}, first + half, count - half});
  }
}

void SurfacePlaces::follow(Field x) {
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    if (node->count == 0) {
      const Node& left = nodes_[node->first];
      const Node& right = nodes_[node->first + 1];
      node->least = smallest(left.least, right.least);
      node->most = largest(left.most, right.most);
      continue;
    }
    node->least = node->most = x[static_cast<std::size_t>(faces_[order_[node->first]][0])];
    for (std::uint32_t i = node->first; i < node->first + node->count; ++i) {
      for (const Index v : faces_[order_[i]]) {
        node->least = smallest(node->least, x[static_cast<std::size_t>(v)]);
        node->most = largest(node->most, x[static_cast<std::size_t>(v)]);
      }
    }
  }
}

Place SurfacePlaces::place_on(Field x, std::uint32_t face, const Vector3<double>& point) const {
  Place place;
  place.face = face;
  std::array<Vector3<double>, 3> arms;
  for (std::size_t c = 0; c < 3; ++c) {
    place.corners[c] = static_cast<std::uint32_t>(faces_[face][c]);
    arms[c] = x[place.corners[c]] - point;
  }
  place.shares = nearest_shares(arms[0], arms[1], arms[2]);
  place.squared = squared_norm(place.shares[0] * arms[0] + place.shares[1] * arms[1] +
                               place.shares[2] * arms[2]);
  return place;
}

std::vector<Place> SurfacePlaces::nearest_to_all(Field x, const PointScan& scan,
                                                 Workers& workers) const {
  std::vector<Place> places(scan.size());
  workers.for_each_in_chunks(scan.size(), [&](std::size_t i) {
    places[i] = nearest(x, scan.point(i), {}, [](const Place&) { return true; });
  });
  return places;
}

}  // namespace dynmesh
