#include "quality/measure.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "quality/limits.hpp"
#include "support/checks.hpp"
#include "support/geometry.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {
namespace {

/// The share of the points that are farther from the surface than their noise.
double unexplained_share(const Matches& matches, double mean_edge, double far_share) {
  std::vector<double> distances;
  matches.for_each_near(
      [&](const Place& place) { distances.push_back(std::sqrt(place.squared) / mean_edge); });
  if (distances.empty()) return 1;
  const double limit = std::max(quality_limits.unexplained_edges,
                                quality_limits.unexplained_medians * quantile(distances, 0.5));
  const auto n = std::ranges::count_if(distances, [&](double d) { return d > limit; });
  const double share = static_cast<double>(n) / static_cast<double>(distances.size());
  return far_share + (1 - far_share) * share;
}

/// How many times as long the edges have become, by their median.
double growth_of(const Cells& cells, std::span<const Vector3<double>> before,
                 std::span<const Vector3<double>> after) {
  std::vector<double> ratios;
  for (std::size_t v = 0; v < before.size(); ++v) {
    for (const Index n : cells[v]) {
      const double was = squared_norm(before[n] - before[v]);
      if (was > 0) ratios.push_back(squared_norm(after[n] - after[v]) / was);
    }
  }
  return ratios.empty() ? 1 : std::sqrt(quantile(std::move(ratios), 0.5));
}

}  // namespace

Measure measured(const Matches& matches, const Agreement& agreement, double mean_edge,
                 const Cells& cells, std::span<const Vector3<double>> first_frame,
                 std::span<const Vector3<double>> x) {
  Measure found;
  found.agreement = agreement;
  found.unexplained = unexplained_share(matches, mean_edge, agreement.far_share);
  found.stretch = mean_stretch(cells, first_frame, x);
  found.growth = growth_of(cells, first_frame, x);
  return found;
}

Quality judged(const Measure& measure) {
  constexpr const QualityLimits& limits = quality_limits;
  if (measure.agreement.far_share > limits.ruined_far || measure.stretch > limits.ruined_stretch) {
    return Quality::ruined;
  }
  const double doubt = measure.unexplained / limits.unexplained + measure.stretch / limits.stretch +
                       measure.hole / limits.hole + measure.overlap / limits.overlap;
  return doubt > 1 ? Quality::doubtful : Quality::good;
}

Cause Measure::cause() const {
  constexpr const QualityLimits& limits = quality_limits;
  if (!(growth > 1 / limits.other_size && growth < limits.other_size)) return Cause::size;
  if (std::max(hole, overlap) > limits.partial && agreement.far_share < limits.ruined_far) {
    return Cause::part;
  }
  const bool is_other = quality == Quality::ruined || stretch > limits.other_subject;
  return is_other ? Cause::pose : Cause::place;
}

std::string Measure::reason() const {
  if (quality == Quality::good) return {};
  const auto percent = [](double share) { return to_text(100 * share, 3) + " %"; };
  std::string told;
  switch (cause()) {
    case Cause::size:
      told = joined("the template must be ", to_text(growth, 2),
                    " times as large to fit, as if it were in another unit or of a subject of ",
                    "another size");
      break;
    case Cause::part:
      told = "the scan shows a part of the template only, and the place of the rest is a guess";
      break;
    case Cause::pose:
      told = "the scan shows another mesh, or a pose that was not found";
      break;
    case Cause::place:
      told = "a part of the template is probably wrong or was not measured";
      break;
  }
  return joined(told, ": ", percent(unexplained),
                " of the points are farther from the mesh than their noise explains, ",
                percent(hole), " of the template is one piece without a point, and edges have ",
                "changed by ", percent(stretch));
}

}  // namespace dynmesh
