/// The state of a stream: its kind, what another stream must share to restore it, frame 0, the
/// report of the last frame, the memory, and a checksum. All numbers are little-endian
/// and packed.
#pragma once

#include <array>
#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <span>

#include "api/report_fields.hpp"
#include "base/stored_numbers.hpp"

namespace dynmesh {

struct Stream;

/// Begins a state: what it is of, and in the last character the version of its format.
using StateFormat = std::array<char, 8>;

/// What a state is of.
struct StateKind {
  StateFormat format;
  const char* name;       ///< in messages
  std::size_t real_size;  ///< of a coordinate, in bytes
};

/// Writes the beginning of a state: its kind, and what the stream that reads it must share.
/// `Settings` are those of a completer or a tracker.
template <class Settings>
void write_head(Writer& writer, const StateKind& kind, const Stream& stream,
                const Settings& settings);

/// Reads the beginning of a state. Refuses one of another kind, mesh or settings, and one that is
/// damaged or of another size.
template <class Settings>
Reader read_head(std::span<const std::byte> state, const StateKind& kind, const Stream& stream,
                 const Settings& settings);

/// What a state keeps of a report. Later numbers of vertices and the standard error follow from
/// what else it keeps.
template <class Report, class Visit>
void for_each_stored_field(Report& report, const Visit& visit) {
  visit(report.iterations);
  visit(report.rejected);
  visit(report.stages.blend);
  visit(report.stages.prior_weight);
  visit(report.stages.prior_share);
  visit(report.stages.first_order_share);
  if constexpr (std::is_same_v<std::remove_const_t<Report>, TrackingReport>) {
    // Without points, there are numbers that are NaN.
    const auto any = [&](auto, auto& number, auto) { visit(number, false); };
    for_each_field(report.measure.agreement, any);
    for_each_number(report.measure, any);
    visit(report.measure.is_start);
    visit(report.recovered);
  }
}

}  // namespace dynmesh
