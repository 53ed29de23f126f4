#include "registration/candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/shortest_paths.hpp"
#include "base/statistics.hpp"
#include "registration/rigid_starts.hpp"

namespace dynmesh {
namespace {

/// Points of a surface that are farthest from each other along it: the tips of its limbs, which
/// tell large motions where the nearest points do not.
struct Tips {
  std::vector<std::size_t> numbers;  ///< of the points
  /// The distances of all points from each tip, in shares of the longest one; infinite where there
  /// is no way along the surface.
  std::vector<std::vector<double>> from;
};

/// The neighbours of each point, and how far they are.
using Graph = std::vector<std::vector<std::pair<std::size_t, double>>>;

std::vector<double> distances_from(const Graph& graph, std::size_t start) {
  return shortest_paths(graph.size(), start, [&](std::size_t point, const auto& visit) {
    for (const auto& [other, length] : graph[point]) visit(other, length);
  });
}

/// The distances from a point of the largest connected part.
std::vector<double> distances_in_largest_part(const Graph& graph) {
  std::vector<double> best;
  std::size_t most = 0;
  std::vector<std::uint8_t> is_seen(graph.size());
  for (std::size_t start = 0; start < graph.size(); ++start) {
    if (is_seen[start] != 0) continue;
    auto distances = distances_from(graph, start);
    std::size_t n = 0;
    for (std::size_t i = 0; i < graph.size(); ++i) {
      if (distances[i] == unreached) continue;
      is_seen[i] = 1;
      ++n;
    }
    if (n <= most) continue;
    most = n;
    best = std::move(distances);
  }
  return best;
}

/// Near points count as connected, unless their normals are opposed.
Graph graph_of(const PointScan& scan) {
  const std::size_t n = scan.size();
  const auto count = static_cast<std::size_t>(tip_constants.neighbours) + 1;
  std::vector<std::vector<std::uint32_t>> near(n);
  const auto distance = [&](std::size_t i, std::size_t j) {
    return std::sqrt(squared_norm(scan.points[i] - scan.points[j]));
  };
  std::vector<double> spacings;
  double mean = 0;
  for (std::size_t i = 0; i < n; ++i) {
    near[i] = scan.nearest_to(i, count);
    spacings.push_back(near[i].size() > 1 ? distance(i, near[i][1]) : 0);
    mean += spacings.back() / static_cast<double>(n);
  }
  // Parts of a surface that were measured sparsely are connected; a stray point is not, since its
  // neighbours are near each other.
  std::vector<double> usual;
  for (const auto& neighbours : near) {
    std::vector<double> around;
    for (const std::size_t j : neighbours) around.push_back(spacings[j]);
    usual.push_back(std::max(mean, quantile(std::move(around), 0.5)));
  }
  Graph graph(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (const std::size_t j : near[i]) {
      if (j == i || distance(i, j) > tip_constants.reach * std::min(usual[i], usual[j])) continue;
      const bool is_undecided = scan.is_undecided(i) || scan.is_undecided(j);
      const double cosine = dot(scan.normals[i], scan.normals[j]);
      if (!is_undecided && cosine < tip_constants.least_cosine) continue;
      graph[i].emplace_back(j, distance(i, j));
      graph[j].emplace_back(i, distance(i, j));
    }
  }
  return graph;
}

/// At most `n_tips`, farthest points first; fewer if the surface has no more. Only the largest
/// connected part is considered.
Tips tips_of(const Graph& graph, std::size_t n_tips) {
  Tips tips;
  if (graph.empty()) return tips;
  std::vector<double> nearest = distances_in_largest_part(graph);
  const auto reached = [](double distance) { return distance == unreached ? 0 : distance; };
  while (tips.numbers.size() < n_tips) {
    const auto farthest = std::ranges::max_element(nearest, {}, reached);
    if (!(reached(*farthest) > 0)) break;
    tips.numbers.push_back(static_cast<std::size_t>(farthest - nearest.begin()));
    const auto& last = tips.from.emplace_back(distances_from(graph, tips.numbers.back()));
    // The point from which the first one was sought does not count.
    if (tips.from.size() == 1) nearest = last;
    std::ranges::transform(nearest, last, nearest.begin(), std::ranges::min);
  }
  // Where points are more regular, ways along them are shorter.
  double longest = 0;
  for (const auto& from : tips.from)
    longest = std::max(longest, reached(std::ranges::max(from, {}, reached)));
  for (auto& from : tips.from) {
    for (double& distance : from) distance /= longest;
  }
  return tips;
}

/// In `likely_pairs`, a tip that has no other: that of a limb which touches another one.
constexpr std::size_t no_tip = static_cast<std::size_t>(-1);

/// Which tip of the second surface each tip of the first one may be, the most likely first: those
/// whose distances from each other are alike. At first those in which each has
/// another, and then those in which one has none.
std::vector<std::vector<std::size_t>> likely_pairs(const Tips& first, const Tips& second) {
  using Pairing = std::pair<double, std::vector<std::size_t>>;
  std::array<std::vector<Pairing>, 2> found;  // by the number of tips without another
  std::vector<std::size_t> chosen;
  const auto most = static_cast<std::size_t>(tip_constants.candidates);
  // Fills `chosen` to the end in every way, keeping the best ones.
  const std::function<void(double, std::size_t)> extend = [&](double cost, std::size_t n_without) {
    const std::size_t tip = chosen.size();
    if (tip == first.numbers.size()) {
      auto& list = found[n_without];
      const Pairing made = {cost, chosen};
      list.insert(std::ranges::upper_bound(list, made), made);
      if (list.size() > most) list.pop_back();
      return;
    }
    for (std::size_t other = 0; other < second.numbers.size(); ++other) {
      if (std::ranges::find(chosen, other) != chosen.end()) continue;
      double more = 0;
      for (std::size_t i = 0; i < tip; ++i) {
        if (chosen[i] == no_tip) continue;
        more += std::abs(first.from[tip][first.numbers[i]] -
                         second.from[other][second.numbers[chosen[i]]]);
      }
      chosen.push_back(other);
      extend(cost + more, n_without);
      chosen.pop_back();
    }
    if (n_without + 1 == found.size()) return;
    chosen.push_back(no_tip);
    extend(cost, n_without + 1);
    chosen.pop_back();
  };
  extend(0, 0);
  std::vector<std::vector<std::size_t>> pairs;
  for (auto& list : found) {
    for (auto& [cost, pairing] : list) pairs.push_back(std::move(pairing));
  }
  return pairs;
}

/// Where the distances from paired tips differ least from those of a point: a number of the second
/// surface, or its size if it has no such place.
std::size_t most_alike(std::size_t i, const Tips& first, const Tips& second,
                       std::span<const std::size_t> pairing, std::size_t step) {
  const std::size_t n = second.from[0].size();
  std::size_t best = n;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < n; j += step) {
    double sum = 0;
    for (std::size_t tip = 0; tip < pairing.size() && sum < least; ++tip) {
      if (pairing[tip] == no_tip) continue;
      const double difference = first.from[tip][i] - second.from[pairing[tip]][j];
      sum += difference * difference;
    }
    if (!(sum < least)) continue;  // it is infinite or none where there is no way along the surface
    least = sum;
    best = j;
  }
  return best;
}

}  // namespace

bool Targets::determine_a_rotation() const {
  constexpr double collinear = 1e-3;
  double longest = 0;
  double widest = 0;
  for (const auto& a : positions) {
    const auto arm = a - positions[0];
    longest = std::max(longest, squared_norm(arm));
    for (const auto& b : positions) {
      widest = std::max(widest, squared_norm(cross(arm, b - positions[0])));
    }
  }
  return widest > collinear * longest * longest;
}

Eigen::Isometry3d Targets::motion_from(Field frame) const {
  std::vector<Vector3> wanted(frame.begin(), frame.end());
  for (std::size_t i = 0; i < vertices.size(); ++i) wanted[at(vertices[i])] = positions[i];
  return to_eigen(fit_rigid_motion(vertices, frame, wanted));
}

std::vector<Candidate> candidates_by_tips(std::span<const Triangle> faces, Field frame,
                                          const PointScan& scan, const Targets& landmarks) {
  // About as many points of the scan as places of the template tell what is connected.
  const PointScan sample = sample_scan(scan, tip_constants.points);
  const SurfaceSample places = sample_surface(faces, frame, tip_constants.points);
  PointScan surface;
  surface.points = places.points;
  surface.normals = places.normals;
  const Tips ours = tips_of(graph_of(surface), tip_constants.of_template);
  const Tips theirs = tips_of(graph_of(sample), tip_constants.of_scan);
  std::vector<Candidate> found;
  if (theirs.numbers.empty()) return found;
  const std::size_t step = 1 + sample.size() / (10 * tip_constants.places);
  for (const auto& pairing : likely_pairs(ours, theirs)) {
    Targets rough;
    for (std::size_t i = 0; i < surface.size(); i += 1 + surface.size() / tip_constants.places) {
      const std::size_t other = most_alike(i, ours, theirs, pairing, step);
      if (other != sample.size()) rough.add(places.vertices[i], sample.points[other]);
    }
    if (!rough.determine_a_rotation()) continue;
    found.push_back({rough.motion_from(frame), landmarks, std::move(rough)});
  }
  return found;
}

}  // namespace dynmesh
