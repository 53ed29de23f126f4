#include "whole_frame/trips.hpp"

#include <algorithm>
#include <dynmesh/completer.hpp>
#include <optional>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// (k,) 1 for the vertices that the base or one of these frames knows.
template <class Real>
std::vector<std::uint8_t> seen_in(const Window<Real>& window, std::span<const std::size_t> frames) {
  std::vector<std::uint8_t> seen = window.known[window.base];
  for (const std::size_t frame : frames) {
    for (std::size_t v = 0; v < seen.size(); ++v) seen[v] |= window.known[frame][v];
  }
  return seen;
}

}  // namespace

template <class Real>
std::vector<Side> sides_of(const Window<Real>& window, const WholeFrameConstants& constants) {
  std::vector<Side> sides;
  if (window.size() < 2) return sides;
  const bool has_before = window.base > 0;
  const bool has_after = window.base + 1 < window.size();
  const std::size_t per_trip = (window.size() - 1) * (has_before && has_after ? 1 : 2);
  const std::size_t wanted = (constants.frames_of_trips + per_trip - 1) / per_trip;
  const std::size_t n = std::clamp(wanted, constants.trips, constants.most_trips) | 1U;
  for (std::size_t trip = 0; trip < n; ++trip) {
    const bool is_before = has_before && (trip % 2 == 0 || !has_after);
    sides.push_back(is_before ? Side::before : Side::after);
  }
  return sides;
}

template <class Real>
std::size_t steps_of(const Window<Real>& window, std::span<const Side> sides) {
  std::size_t steps = 0;
  for (const Side side : sides) steps += 2 * frames_of(window, side).size();
  return steps;
}

template <class Real>
std::vector<SideResult> make_trips(Faces faces, const Settings& settings,
                                   const Window<Real>& window,
                                   std::span<const Vector3<double>> start,
                                   std::span<const Side> sides, const std::function<void()>& step) {
  const std::size_t k = window.n_vertices;
  std::vector<Real> frame(3 * k);  // the one that was completed last
  const Points<Real> points(frame.data(), k);
  for (std::size_t v = 0; v < k; ++v) put_row(points, v, saturated<Real>(start[v]));
  Completer<Real> completer(faces, points, settings);
  const auto push = [&](std::size_t t) {
    step();
    completer.push(window.points(t), KnownMask(window.known[t].data(), k), points);
  };

  std::optional<SideResult> before;
  std::optional<SideResult> after;
  for (const Side side : sides) {
    const auto frames = frames_of(window, side);
    completer.reset(points);
    for (const std::size_t t : frames) push(t);
    completer.reset(points);
    for (std::size_t i = frames.size() - 1; i > 0; --i) push(frames[i - 1]);
    push(window.base);

    SideResult& result = (side == Side::before ? before : after).emplace();
    for (std::size_t v = 0; v < k; ++v) {
      result.positions.push_back(in_double(row(Points<const Real>(points), v)));
    }
    const auto errors = completer.standard_error();
    result.standard_error.assign(errors.begin(), errors.end());
    result.seen = seen_in<Real>(window, frames);
  }
  std::vector<SideResult> results;
  if (before) results.push_back(*std::move(before));
  if (after) results.push_back(*std::move(after));
  return results;
}

template std::vector<Side> sides_of(const Window<float>&, const WholeFrameConstants&);
template std::vector<Side> sides_of(const Window<double>&, const WholeFrameConstants&);
template std::size_t steps_of(const Window<float>&, std::span<const Side>);
template std::size_t steps_of(const Window<double>&, std::span<const Side>);
template std::vector<SideResult> make_trips(Faces, const Settings&, const Window<float>&,
                                            std::span<const Vector3<double>>, std::span<const Side>,
                                            const std::function<void()>&);
template std::vector<SideResult> make_trips(Faces, const Settings&, const Window<double>&,
                                            std::span<const Vector3<double>>, std::span<const Side>,
                                            const std::function<void()>&);

}  // namespace dynmesh
