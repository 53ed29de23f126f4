#include "quality/measure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "quality/limits.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {
namespace {

constexpr double told_share = 0.005;  // less is not worth a word

/// Whether the median edge became so many times as long or as short.
bool is_beyond(double growth, double times) { return !(growth > 1 / times && growth < times); }

}  // namespace

Change change_of(const Cells& cells, Field before, Field after) {
  constexpr std::size_t enough = 4096;
  // One more than a multiple of six, the usual number of neighbours, so that all directions count.
  const std::size_t every = 1 + 6 * (cells.neighbours.size() / (6 * enough));
  std::vector<double> ratios;
  std::size_t v = 0;
  for (std::size_t i = 0; i < cells.neighbours.size(); i += every) {
    while (at(cells.offsets[v + 1]) <= i) ++v;
    const auto n = at(cells.neighbours[i]);
    const double was = squared_norm(before[n] - before[v]);
    if (was > 0) ratios.push_back(std::sqrt(squared_norm(after[n] - after[v]) / was));
  }
  Change found;
  if (ratios.empty()) return found;
  found.growth = quantile(ratios, 0.5);
  double sum = 0;
  for (const double ratio : ratios) {
    sum += 1 - std::min(ratio, found.growth) / std::max({ratio, found.growth, 1e-300});
  }
  found.stretch = sum / static_cast<double>(ratios.size());
  return found;
}

namespace {

/// (k,) by which share the edges around each vertex changed beside their median change. What is
/// measured of single edges is mostly noise.
std::vector<double> changes_around(const Cells& cells, Field before, Field after) {
  constexpr int rounds = 4;
  std::vector<double> ratios;
  for (std::size_t v = 0; v < before.size(); ++v) {
    for (const Index n : cells[v]) {
      const double was = squared_norm(before[at(n)] - before[v]);
      const double is = squared_norm(after[at(n)] - after[v]);
      ratios.push_back(was > 0 && is > 0 ? std::log(is / was) / 2 : 0);
    }
  }
  const double common = ratios.empty() ? 0 : quantile(ratios, 0.5);
  std::vector<double> changes(before.size());
  for (std::size_t v = 0, i = 0; v < before.size(); ++v) {
    const auto n = static_cast<double>(cells[v].size());
    for (std::size_t c = 0; c < cells[v].size(); ++c) {
      changes[v] += std::abs(ratios[i++] - common) / n;
    }
  }
  for (int round = 1; round < rounds; ++round) {
    const std::vector<double> last = changes;
    for (std::size_t v = 0; v < before.size(); ++v) {
      for (const Index n : cells[v]) changes[v] += last[at(n)];
      changes[v] /= static_cast<double>(1 + cells[v].size());
    }
  }
  return changes;
}

}  // namespace

double bent_elsewhere(const Cells& cells, Field first, Field before, Field after) {
  constexpr double times = 3;
  const auto usual = changes_around(cells, first, before);
  const auto changes = changes_around(cells, first, after);
  std::vector<double> ratios;
  for (std::size_t v = 0; v < usual.size(); ++v) {
    if (usual[v] > 0) ratios.push_back(changes[v] / usual[v]);
  }
  const double ratio = ratios.empty() ? 0 : quantile(std::move(ratios), 0.5);
  double all = 0;
  double elsewhere = 0;
  for (std::size_t v = 0; v < usual.size(); ++v) {
    all += changes[v];
    elsewhere += std::max(0.0, changes[v] - times * ratio * usual[v]);
  }
  return all > 0 ? elsewhere / all : 0;
}

double parted_share(std::span<const Tie> ties, Field before, Field after, double mean_edge) {
  double parted = 0;
  double all = 0;
  for (const Tie& tie : ties) {
    const auto length = [&](Field x) { return std::sqrt(squared_norm(x[tie.i] - x[tie.j])); };
    const double change = std::abs(length(after) - length(before));
    if (change > quality_limits.parted_edges * mean_edge) parted += tie.weight;
    all += tie.weight;
  }
  return all > 0 ? parted / all : 0;
}

Measure measured(const FittedSurface& surface, const Evidence& evidence, const Cells& cells,
                 Field first_frame) {
  const Change change = change_of(cells, first_frame, surface.x);
  const auto n_observed = static_cast<double>(std::ranges::count(surface.observed, 1));
  Measure found;
  found.agreement = surface.agreements.all;
  found.hole = evidence.hole;
  found.stretch = change.stretch;
  found.growth = change.growth;
  found.explained = evidence.explained;
  found.contradicted = evidence.contradicted();
  found.others = evidence.others;
  found.others_distance = evidence.others_distance;
  found.noise = evidence.points.noise;
  found.seen = n_observed / static_cast<double>(surface.x.size());
  return found;
}

void add_frame(const Measure& measure, RecentFrames& recent) {
  constexpr double newest = 0.1;  // the share of a new frame, at least
  const double share = std::max(newest, 1 / (recent.count + 1));
  const auto add = [&](double value, Usual& usual) {
    const double deviation = std::abs(value - usual.mean);
    usual.mean += share * (value - usual.mean);
    if (recent.count > 0) usual.deviation += share * (deviation - usual.deviation);
  };
  const bool tells_all = measure.quality == Quality::good || recent.count == 0;
  // If doubtful frames told more, it would be usual that a wrong pose has no points.
  const auto told = [&](double value, double most, const Usual& usual) {
    return tells_all ? value : std::min(value, std::max(most, usual.mean));
  };
  add(told(1 - measure.explained, quality_limits.missing, recent.missing), recent.missing);
  add(told(measure.hole, quality_limits.start_hole, recent.hole), recent.hole);
  if (tells_all) {
    add(measure.stretch, recent.stretch);
    add(measure.change, recent.change);
    add(measure.parted, recent.parted);
  }
  recent.growth = measure.growth;
  recent.count = std::min(recent.count + 1, 1 / newest);
}

Quality judged(Measure& measure, const Before& before) {
  constexpr const QualityLimits& limits = quality_limits;
  const RecentFrames& recent = before.recent;
  const bool is_first = recent.count == 0;
  const double deviations = before.knows_sensors ? limits.missed_deviations : limits.deviations;
  const auto beyond = [&](const Usual& usual) {
    return is_first ? 0 : usual.mean + deviations * usual.deviation;
  };
  // What may be missing: at the start, or in a registration; later, what always is.
  double missing = measure.is_start ? limits.start_missing : limits.missing;
  double hole = measure.is_start ? limits.start_hole : limits.hole;
  if (before.knows_sensors) {
    missing = std::max(missing, std::min(limits.most_missing, beyond(recent.missing)));
    hole = std::max(hole, std::min(limits.most_missing, beyond(recent.hole)));
  } else {
    const double always = std::numeric_limits<double>::infinity();
    missing = is_first ? always : std::max(recent.missing.mean + missing, beyond(recent.missing));
    hole = is_first ? always : std::max(recent.hole.mean + hole, beyond(recent.hole));
  }
  measure.doubt = measure.contradicted / limits.contradicted + measure.stretch / limits.stretch +
                  measure.hole / hole;
  const auto doubt = [&](double value, double limit) {
    measure.doubt = std::max(measure.doubt, value / limit);
  };
  doubt(1 - measure.explained, missing);
  const double growth = std::abs(std::log(std::max(measure.growth, 1e-300)));
  if (measure.is_start) {
    doubt(measure.stretch, limits.start_stretch);
    doubt(growth, std::log(limits.start_size));
  }
  measure.leap = 0;
  if (is_first || before.was_registered) return quality_of(measure);
  const double departure = measure.stretch - recent.stretch.mean;
  const double unusual =
      std::max(limits.leap_stretch, limits.deviations * recent.stretch.deviation);
  // A pose that was lost settles: it is bent less from frame to frame, and stays another one.
  const double departures = departure / ((before.was_misplaced ? limits.still_lost : 1) * unusual);
  const double changes =
      measure.change / std::max(limits.leap, limits.leap_times * recent.change.mean);
  measure.leap = std::max(0.0, std::min(departures, changes));
  if (before.times_likely && measure.leap > limits.likely_leap &&
      measure.leap < limits.certain_leap) {
    measure.leap *= before.times_likely(measure.leap);
  }
  if (measure.doubt > limits.parted_doubt) {
    const double parted = std::max(limits.parted, limits.leap_times * recent.parted.mean);
    measure.leap = std::max(measure.leap, measure.parted / parted);
  }
  // Slow growth is that of the subject, sudden growth that of a unit.
  const double grown = std::abs(std::log(std::max(measure.growth, 1e-300) / recent.growth));
  measure.leap = std::max(measure.leap, grown / std::log(limits.start_size));
  return quality_of(measure);
}

Quality quality_of(const Measure& measure) {
  constexpr const QualityLimits& limits = quality_limits;
  const bool is_guess = measure.seen < limits.hardly_seen;
  // A few points say nothing, but many that lie elsewhere do.
  const bool has_points = measure.agreement.points >= TrackingConstants{}.fewest;
  if (measure.leap > 1 || measure.stretch > limits.ruined_stretch ||
      measure.contradicted > limits.ruined_contradicted ||
      (has_points && measure.explained < limits.ruined_explained && measure.doubt > 1)) {
    return Quality::ruined;
  }
  const bool any_lost = measure.lost >= 0;
  return measure.doubt > 1 || is_guess || any_lost ? Quality::doubtful : Quality::good;
}

bool Measure::lies_elsewhere() const {
  return seen < quality_limits.hardly_seen && agreement.points >= TrackingConstants{}.fewest &&
         others > quality_limits.elsewhere;
}

Cause Measure::cause() const {
  constexpr const QualityLimits& limits = quality_limits;
  if (lies_elsewhere()) return Cause::pose;
  if (seen < limits.hardly_seen) return Cause::unseen;
  if (is_beyond(growth, limits.other_size)) return Cause::size;
  if (leap > 1) return Cause::pose;
  if (std::max(hole, overlap) > limits.partial && contradicted < limits.contradicted) {
    return Cause::part;
  }
  const bool is_ruined = quality == Quality::ruined;
  if (is_start && !is_ruined && is_beyond(growth, limits.start_size)) return Cause::size;
  const bool is_other = is_ruined || stretch > (is_start ? limits.start_stretch : limits.stretch);
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
      if (lies_elsewhere()) {
        return joined("the pose was lost, or the subject is gone: ", percent(others),
                      " of the points lie elsewhere");
      }
      if (leap > 1) {
        text = joined("the pose was lost: since the last frame that was not, edges changed by ",
                      percent(change));
        if (parted > told_share) {
          text += joined(" and parts came apart at ", percent(parted),
                         " of the places where they touch");
        }
        text += joined(", ", to_text(leap, 2), " times what is likely");
      } else {
        text = "the scan shows another mesh, or a pose that was not found";
      }
      break;
    case Cause::place:
      text = "a part of the template is probably wrong or was not measured";
      break;
  }
  const auto add = [&](const char* before, double share, const char* after) {
    if (share > told_share) text += joined(before, percent(share), after);
  };
  add(": ", 1 - explained, " of what sensors should see of it has no point");
  add(", ", contradicted, " of it is contradicted: seen through, or measured from the other side");
  add(", ", unexplained, " of the points are farther from it than their noise explains");
  add(", ", hole, " of it is one piece without a point");
  if (lost >= 0) {
    text += joined(", the component of vertex ", to_text(lost, 15),
                   " is lost, since nothing was measured where it should be seen");
  }
  add(", ", overlap, " of it lies on another part");
  const std::string grown = joined(" and are ", to_text(growth, 4), " times as long");
  const bool is_told = cause() == Cause::size;
  return joined(text, ", edges have changed by ", percent(stretch), is_told ? "" : grown);
}

}  // namespace dynmesh
