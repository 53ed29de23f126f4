#include "quality/measure.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "quality/limits.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {
namespace {

/// Whether the median edge became so many times as long or as short.
bool is_beyond(double growth, double times) { return !(growth > 1 / times && growth < times); }

}  // namespace

double growth_of(const Cells& cells, Field before, Field after) {
  std::vector<double> ratios;
  for (std::size_t v = 0; v < before.size(); ++v) {
    for (const Index n : cells[v]) {
      const double was = squared_norm(before[n] - before[v]);
      if (was > 0) ratios.push_back(squared_norm(after[n] - after[v]) / was);
    }
  }
  return ratios.empty() ? 1 : std::sqrt(quantile(std::move(ratios), 0.5));
}

double unexplained_share(const MatchedPoints& points, double far_share) {
  std::vector<double> distances;
  points.for_each_near([&](const Place& place) {
    distances.push_back(std::sqrt(place.squared) / points.mean_edge);
  });
  if (distances.empty()) return 1;
  const double limit = std::max(quality_limits.unexplained_edges,
                                quality_limits.unexplained_medians * quantile(distances, 0.5));
  const auto n = std::ranges::count_if(distances, [&](double d) { return d > limit; });
  const double share = static_cast<double>(n) / static_cast<double>(distances.size());
  return far_share + (1 - far_share) * share;
}

Measure measured(const Agreement& agreement, std::span<const std::uint8_t> observed,
                 const Cells& cells, Field first_frame, Field x) {
  Measure found;
  found.agreement = agreement;
  found.unexplained = agreement.far_share;
  found.stretch = mean_stretch(cells, first_frame, x);
  found.growth = growth_of(cells, first_frame, x);
  found.seen =
      static_cast<double>(std::ranges::count(observed, 1)) / static_cast<double>(observed.size());
  return found;
}

Quality judged(const Measure& measure) {
  constexpr const QualityLimits& limits = quality_limits;
  const Agreement& points = measure.agreement;
  // Shares are NaN without points.
  const bool has_points = points.points > 0;
  if ((has_points && points.far_share > limits.ruined_far) ||
      (has_points && points.disagreeing > limits.ruined_disagreeing) ||
      measure.stretch > limits.ruined_stretch) {
    return Quality::ruined;
  }
  const double stretch = measure.is_start ? limits.start_stretch : limits.stretch;
  double doubt =
      measure.stretch / stretch + measure.hole / limits.hole + measure.overlap / limits.overlap;
  if (has_points) {
    doubt += measure.unexplained / limits.unexplained + points.disagreeing / limits.disagreeing;
  }
  const bool is_guess = measure.cause() == Cause::unseen;
  const bool is_other = measure.is_start && (measure.stretch > limits.start_stretch ||
                                             is_beyond(measure.growth, limits.start_size));
  const bool any_lost = measure.lost >= 0;
  return doubt > 1 || is_guess || is_other || any_lost ? Quality::doubtful : Quality::good;
}

Cause Measure::cause() const {
  constexpr const QualityLimits& limits = quality_limits;
  if (seen < limits.hardly_seen) return Cause::unseen;
  if (is_beyond(growth, limits.other_size)) return Cause::size;
  if (std::max(hole, overlap) > limits.partial && agreement.far_share < limits.ruined_far) {
    return Cause::part;
  }
  const bool is_ruined = quality == Quality::ruined;
  if (is_start && !is_ruined && is_beyond(growth, limits.start_size)) return Cause::size;
  const bool is_other =
      is_ruined || stretch > (is_start ? limits.start_stretch : limits.other_subject);
  return is_other ? Cause::pose : Cause::place;
}

std::string Measure::reason() const {
  if (quality == Quality::good) return {};
  const auto percent = [](double share) { return to_text(100 * share, 3) + " %"; };
  std::string text;
  switch (cause()) {
    case Cause::unseen:
      return joined("hardly anything was measured: ", percent(seen),
                    " of the vertices have a point");
    case Cause::size:
      text = joined("the template must be ", to_text(growth, 2),
                    " times as large to fit, as if it were in another unit or of a subject of ",
                    "another size");
      break;
    case Cause::part:
      text = "the scan shows a part of the template only, and the place of the rest is a guess";
      break;
    case Cause::pose:
      text = "the scan shows another mesh, or a pose that was not found";
      break;
    case Cause::place:
      text = "a part of the template is probably wrong or was not measured";
      break;
  }
  const auto add = [&](const char* before, double share, const char* after) {
    if (share > 0) text += joined(before, percent(share), after);
  };
  add(": ", std::max(unexplained, agreement.far_share),
      " of the points are farther from the mesh than their noise explains");
  add(", ", agreement.disagreeing, " face another way than the mesh there");
  add(", ", hole, " of the template is one piece without a point");
  if (lost >= 0) {
    text += joined(", the component of vertex ", to_text(lost, 15),
                   " is lost, since nothing was measured where it should be seen");
  }
  add(", ", overlap, " of it lies on another part");
  return joined(text, ", and edges have changed by ", percent(stretch));
}

}  // namespace dynmesh
