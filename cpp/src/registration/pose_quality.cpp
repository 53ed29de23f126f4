#include "registration/pose_quality.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "quality/limits.hpp"
#include "registration/constants.hpp"

namespace dynmesh {
std::vector<std::uint8_t> find_border(std::span<const Triangle> faces, std::size_t k) {
  std::vector<std::pair<Index, Index>> edges;
  for (const Triangle& face : faces) {
    for (std::size_t s = 0; s < 3; ++s) {
      edges.push_back(std::minmax({face[s], face[(s + 1) % 3]}));
    }
  }
  std::ranges::sort(edges);
  std::vector<std::uint8_t> is_border(k);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const bool has_twin =
        (i > 0 && edges[i - 1] == edges[i]) || (i + 1 < edges.size() && edges[i + 1] == edges[i]);
    if (!has_twin) is_border[at(edges[i].first)] = is_border[at(edges[i].second)] = 1;
  }
  return is_border;
}

double unexplained_beside(const MatchedPoints& points, std::span<const std::uint8_t> is_border,
                          double noise) {
  const bool is_noisy = noise > quality_limits.unexplained_edges * points.mean_edge;
  const double beside = is_noisy ? 2 * points.mean_edge : points.mean_edge;
  std::vector<double> distances;
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const Place& place = points.places[i];
    bool is_within = points.agrees[i] != 0 && place.squared <= beside * beside;
    for (std::size_t s = 0; s < 3 && is_within;
         ++s) {  // what lies beyond is nearest to the outline
      is_within = place.shares[s] > 0 || is_border[place.corners[(s + 1) % 3]] == 0 ||
                  is_border[place.corners[(s + 2) % 3]] == 0;
    }
    if (is_within) distances.push_back(std::sqrt(place.squared) / points.mean_edge);
  }
  if (distances.empty()) return 1;
  const double limit = std::clamp(quality_limits.unexplained_medians * quantile(distances, 0.5),
                                  quality_limits.unexplained_edges, 1.0);
  const auto n = std::ranges::count_if(distances, [&](double d) { return d > limit; });
  return static_cast<double>(n) / static_cast<double>(distances.size());
}

Quality quality_of_pose(const Fit& fit, const Measure& measure) {
  constexpr const RegistrationConstants& limits = registration_constants;
  const double contradicted = fit.evidence.contradicted();
  if (fit.missing() > limits.ruined_missing || contradicted > limits.ruined_contradicted ||
      fit.stretch > quality_limits.ruined_stretch) {
    return Quality::ruined;
  }
  const double missing = 1 - fit.evidence.explained;
  const double doubt = missing + contradicted + measure.unexplained + fit.stretch;
  const bool is_good = doubt <= limits.doubt && missing <= limits.missing &&
                       measure.hole <= limits.hole && measure.overlap <= limits.overlap &&
                       measure.cause() != Cause::unseen;
  return is_good ? Quality::good : Quality::doubtful;
}

}  // namespace dynmesh
