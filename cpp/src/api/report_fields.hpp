/// The fields of every report, once: for Python, and for the C interface where it has them.
#pragma once

#include <array>
#include <cstddef>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/quality.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <type_traits>

namespace dynmesh {

/// The names of qualities and causes, in their order.
inline constexpr std::array quality_names = {"good", "doubtful", "ruined"};
inline constexpr std::array cause_names = {"unseen", "size", "part", "pose", "place"};

// Each calls `visit(name, value, member)` for each field, some without the last: a pointer to the
// member of the same name of `Twin`, a flat structure such as that of the C interface.

template <class Twin = FrameReport, class Visit>
void for_each_field(const FrameReport& report, const Visit& visit) {
  using Stages = std::conditional_t<std::is_same_v<Twin, FrameReport>, StageReport, Twin>;
  visit("known", report.known, &Twin::known);
  visit("filled", report.filled, &Twin::filled);
  visit("disconnected", report.disconnected, &Twin::disconnected);
  visit("iterations", report.iterations, &Twin::iterations);
  visit("rejected", report.rejected, &Twin::rejected);
  visit("standard_error", report.standard_error, &Twin::standard_error);
  visit("seconds", report.seconds, &Twin::seconds);
  visit("blend", report.stages.blend, &Stages::blend);
  visit("prior_weight", report.stages.prior_weight, &Stages::prior_weight);
  visit("prior_share", report.stages.prior_share, &Stages::prior_share);
  visit("first_order_share", report.stages.first_order_share, &Stages::first_order_share);
  visit("factor_seconds", report.stages.factor_seconds);
  visit("rotation_seconds", report.stages.rotation_seconds);
  visit("solve_seconds", report.stages.solve_seconds);
  visit("quality", report.quality, &Twin::quality);
  visit("reason", report.reason, &Twin::reason);
}

template <class Twin = Agreement, class Visited, class Visit>
requires std::is_same_v<std::remove_const_t<Visited>, Agreement>
void for_each_field(Visited& agreement, const Visit& visit) {
  visit("points", agreement.points, &Twin::points);
  visit("far", agreement.far_share, &Twin::far_share);
  visit("disagreeing", agreement.disagreeing, &Twin::disagreeing);
  visit("distance", agreement.distance, &Twin::distance);
}

/// The numbers of a measure beside those of its agreement.
template <class Twin = Measure, class Visited, class Visit>
requires std::is_same_v<std::remove_const_t<Visited>, Measure>
void for_each_number(Visited& measure, const Visit& visit) {
  visit("unexplained", measure.unexplained, &Twin::unexplained);
  visit("hole", measure.hole, &Twin::hole);
  visit("overlap", measure.overlap, &Twin::overlap);
  visit("stretch", measure.stretch, &Twin::stretch);
  visit("growth", measure.growth, &Twin::growth);
  visit("explained", measure.explained, &Twin::explained);
  visit("contradicted", measure.contradicted, &Twin::contradicted);
  visit("change", measure.change, &Twin::change);
  visit("parted", measure.parted, &Twin::parted);
  visit("others", measure.others, &Twin::others);
  visit("others_distance", measure.others_distance, &Twin::others_distance);
  visit("noise", measure.noise, &Twin::noise);
  visit("doubt", measure.doubt, &Twin::doubt);
  visit("leap", measure.leap, &Twin::leap);
  visit("lost", measure.lost, &Twin::lost);
  visit("seen", measure.seen, &Twin::seen);
}

template <class Twin = Measure, class Visit>
void for_each_field(const Measure& measure, const Visit& visit) {
  for_each_number<Twin>(measure, visit);
  visit("misfit", measure.misfit());
  visit("quality", quality_names[static_cast<std::size_t>(measure.quality)]);
  visit("cause", cause_names[static_cast<std::size_t>(measure.cause())]);
  visit("reason", measure.reason());
}

template <class Visit>
void for_each_field(const TrackingReport& report, const Visit& visit) {
  for_each_field(static_cast<const FrameReport&>(report), visit);
  for_each_field(report.measure.agreement, visit);
  for_each_field(report.measure, visit);
  visit("recovered", report.recovered);
}

template <class Twin = Registration<double>, class Real, class Visit>
void for_each_field(const Registration<Real>& found, const Visit& visit) {
  visit("transform", found.transform, &Twin::transform);
  visit("scale", found.scale, &Twin::scale);
  visit("rounds", found.rounds, &Twin::rounds);
  visit("converged", found.converged, &Twin::converged);
  for_each_field(found.agreement, visit);
  for_each_field(static_cast<const Measure&>(found), visit);
}

}  // namespace dynmesh
