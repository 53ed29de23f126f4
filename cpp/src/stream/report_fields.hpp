/// The fields of every report, once: for Python, and for the C interface where it has them.
#pragma once

#include <dynmesh/dynmesh.h>

#include <array>
#include <cstddef>
#include <dynmesh/alignment.hpp>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/quality.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <type_traits>

namespace dynmesh {

/// The names of qualities and causes, in their order.
inline constexpr std::array quality_names = {"good", "doubtful", "ruined"};
inline constexpr std::array cause_names = {"unseen", "size", "part", "pose", "place"};

// Each calls `visit(name, value, member_in_c)` for each field, some without the last.

template <class Visit>
void for_each_field(const FrameReport& report, const Visit& visit) {
  using C = dynmesh_frame_report;
  visit("known", report.known, &C::known);
  visit("filled", report.filled, &C::filled);
  visit("disconnected", report.disconnected, &C::disconnected);
  visit("iterations", report.iterations, &C::iterations);
  visit("rejected", report.rejected, &C::rejected);
  visit("standard_error", report.standard_error, &C::standard_error);
  visit("seconds", report.seconds, &C::seconds);
  visit("blend", report.stages.blend, &C::blend);
  visit("prior_weight", report.stages.prior_weight, &C::prior_weight);
  visit("prior_share", report.stages.prior_share, &C::prior_share);
  visit("first_order_share", report.stages.first_order_share, &C::first_order_share);
  visit("factor_seconds", report.stages.factor_seconds);
  visit("rotation_seconds", report.stages.rotation_seconds);
  visit("solve_seconds", report.stages.solve_seconds);
  visit("quality", report.quality, &C::quality);
  visit("reason", report.reason, &C::reason);
}

template <class Visited, class Visit>
requires std::is_same_v<std::remove_const_t<Visited>, Agreement>
void for_each_field(Visited& agreement, const Visit& visit) {
  using C = dynmesh_agreement;
  visit("points", agreement.points, &C::points);
  visit("far", agreement.far_share, &C::far_share);
  visit("disagreeing", agreement.disagreeing, &C::disagreeing);
  visit("distance", agreement.distance, &C::distance);
}

/// The numbers of a measure beside those of its agreement.
template <class Visited, class Visit>
requires std::is_same_v<std::remove_const_t<Visited>, Measure>
void for_each_number(Visited& measure, const Visit& visit) {
  using C = dynmesh_measure;
  visit("unexplained", measure.unexplained, &C::unexplained);
  visit("hole", measure.hole, &C::hole);
  visit("overlap", measure.overlap, &C::overlap);
  visit("stretch", measure.stretch, &C::stretch);
  visit("growth", measure.growth, &C::growth);
  visit("seen", measure.seen, &C::seen);
}

template <class Visit>
void for_each_field(const Measure& measure, const Visit& visit) {
  for_each_number(measure, visit);
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

template <class Visit>
void for_each_field(const Alignment& found, const Visit& visit) {
  using C = dynmesh_alignment;
  visit("rotation", found.rotation, &C::rotation);
  visit("shift", found.shift, &C::shift);
  visit("mean_edge", found.mean_edge, &C::mean_edge);
  visit("before", found.before, &C::before);
  visit("after", found.after, &C::after);
  visit("ratio", found.ratio, &C::ratio);
  visit("lies_in_scan", found.lies_in_scan, &C::lies_in_scan);
  visit("matches", found.matches, &C::matches);
  visit("other_unit", found.other_unit, &C::other_unit);
}

template <class Real, class Visit>
void for_each_field(const Registration<Real>& found, const Visit& visit) {
  using C = dynmesh_registration_report;
  visit("transform", found.transform, &C::transform);
  visit("scale", found.scale, &C::scale);
  visit("rounds", found.rounds, &C::rounds);
  visit("converged", found.converged, &C::converged);
  for_each_field(found.agreement, visit);
  for_each_field(static_cast<const Measure&>(found), visit);
}

}  // namespace dynmesh
