#include "whole_frame/trips.hpp"

#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <map>
#include <utility>

#include "factor/interpolation.hpp"
#include "mesh/generations.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"

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

/// (components,) how many vertices of each component are marked.
std::vector<std::size_t> count_in_components(const Topology& topology,
                                             std::span<const std::uint8_t> marked) {
  std::vector<std::size_t> counts(topology.report.components);
  for (std::size_t v = 0; v < marked.size(); ++v) {
    if (marked[v] != 0) ++counts[topology.component[v]];
  }
  return counts;
}

/// The motion from one frame of the window to its base, by the vertices that both know.
template <class Real>
RigidMotion motion_to_base(const Window<Real>& window, std::size_t frame) {
  std::vector<Vector3<double>> there, here;
  for (Index v = 0; v < static_cast<Index>(window.n_vertices); ++v) {
    if (!window.is_known(frame, v) || !window.is_known(window.base, v)) continue;
    there.push_back(window.position(frame, v));
    here.push_back(window.position(window.base, v));
  }
  return there.empty() ? RigidMotion{} : fit_rigid_motion<double>(there, here);
}

Vector3<double> mean_of_fixed(const PartialFrame& frame) {
  Vector3<double> sum;
  double n = 0;
  for (std::size_t v = 0; v < frame.fixed.size(); ++v) {
    if (frame.fixed[v] == 0) continue;
    sum = sum + frame.positions[v];
    ++n;
  }
  return n > 0 ? (1 / n) * sum : sum;
}

}  // namespace

template <class Real>
PartialFrame known_parts(const Topology& topology, const Window<Real>& window,
                         const WholeFrameConstants& constants) {
  const std::size_t k = window.n_vertices;
  PartialFrame frame{std::vector<Vector3<double>>(k), window.known[window.base]};
  for (Index v = 0; v < static_cast<Index>(k); ++v) {
    if (frame.fixed[at(v)] != 0) frame.positions[at(v)] = window.position(window.base, v);
  }
  std::vector<std::vector<std::size_t>> counts;  // of known vertices, by frames and components
  for (const auto& known : window.known) counts.push_back(count_in_components(topology, known));
  for (std::size_t c = 0; c < topology.report.components; ++c) {
    if (counts[window.base][c] >= constants.fewest_known) continue;
    std::size_t best = window.base;
    for (std::size_t t = 0; t < window.size(); ++t) {
      if (counts[t][c] > counts[best][c]) best = t;
    }
    if (best == window.base) continue;
    const RigidMotion motion = motion_to_base(window, best);
    for (Index v = 0; v < static_cast<Index>(k); ++v) {
      if (at(topology.component[at(v)]) != c || frame.fixed[at(v)] != 0) continue;
      if (!window.is_known(best, v)) continue;
      frame.positions[at(v)] = motion.apply(window.position(best, v));
      frame.fixed[at(v)] = 1;
    }
  }
  return frame;
}

std::vector<Vector3<double>> smooth_fill(const Topology& topology, PartialFrame frame,
                                         Workers& workers) {
  const std::size_t k = frame.positions.size();
  const auto counts = count_in_components(topology, frame.fixed);
  const Vector3<double> mean = mean_of_fixed(frame);
  std::vector<std::uint8_t> is_free(k);
  std::vector<Vector3<double>> from_mean(k);  // which those that are not known begin at
  for (std::size_t v = 0; v < k; ++v) {
    is_free[v] = frame.fixed[v] == 0 && counts[topology.component[v]] > 0 ? 1 : 0;
    if (frame.fixed[v] != 0) from_mean[v] = frame.positions[v] - mean;
  }
  if (std::ranges::count(is_free, 1) > 0) {
    const SparseMatrix l = laplacian(topology.cells);
    const SparseMatrix energy(l * l);
    MaskedFactor factor(energy, workers);
    interpolate(energy, factor, is_free, from_mean);
  }
  for (std::size_t v = 0; v < k; ++v) {
    if (frame.fixed[v] == 0) frame.positions[v] = mean + from_mean[v];
  }
  return std::move(frame.positions);
}

std::vector<Side> sides_of(std::size_t n_before, std::size_t n_after,
                           const WholeFrameConstants& constants) {
  std::vector<Side> sides;
  if (n_before + n_after == 0) return sides;
  const std::size_t per_trip = (n_before + n_after) * (n_before > 0 && n_after > 0 ? 1 : 2);
  const std::size_t wanted = (constants.frames_of_trips + per_trip - 1) / per_trip;
  const std::size_t n = std::clamp(wanted, constants.trips, constants.most_trips) | 1U;
  for (std::size_t trip = 0; trip < n; ++trip) {
    const bool is_before = n_before > 0 && (trip % 2 == 0 || n_after == 0);
    sides.push_back(is_before ? Side::before : Side::after);
  }
  return sides;
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

  std::map<Side, SideResult> last;
  for (const Side side : sides) {
    const auto frames = frames_of(window, side);
    completer.reset(points);
    for (const std::size_t t : frames) push(t);
    completer.reset(points);
    for (std::size_t i = frames.size() - 1; i > 0; --i) push(frames[i - 1]);
    push(window.base);

    SideResult& result = last[side] = {};
    for (std::size_t v = 0; v < k; ++v) {
      result.positions.push_back(in_double(row(Points<const Real>(points), v)));
    }
    const auto errors = completer.standard_error();
    result.standard_error.assign(errors.begin(), errors.end());
    result.seen = seen_in<Real>(window, frames);
  }
  std::vector<SideResult> results;
  for (auto& [side, result] : last) results.push_back(std::move(result));
  return results;
}

Combination combine(std::span<const SideResult> results, const WholeFrameConstants& constants) {
  const std::size_t k = results.front().positions.size();
  Combination combination{std::vector<Vector3<double>>(k), std::vector<double>(k),
                          std::vector<double>(k)};
  std::vector<double> weights(results.size());
  for (std::size_t v = 0; v < k; ++v) {
    double sum = 0;
    for (std::size_t q = 0; q < results.size(); ++q) {
      // The exponent would be -2 if standard errors were exact. Infinity where they are 0.
      weights[q] = (results[q].seen[v] != 0 ? 1 : constants.never_seen) *
                   std::pow(results[q].standard_error[v], -1.5);
      sum += weights[q];
    }
    // Both sides know the vertex exactly, or neither knows anything of it.
    const bool are_equal = !(sum > 0) || std::isinf(sum);
    for (double& weight : weights) {
      weight = are_equal ? 1 / static_cast<double>(results.size()) : weight / sum;
    }
    for (std::size_t q = 0; q < results.size(); ++q) {
      combination.positions[v] = combination.positions[v] + weights[q] * results[q].positions[v];
    }
    for (std::size_t q = 0; q < results.size(); ++q) {
      if (weights[q] == 0) continue;  // of an infinite standard error
      const double error = results[q].standard_error[v];
      const auto difference = results[q].positions[v] - combination.positions[v];
      combination.disagreement[v] += weights[q] * squared_norm(difference) / 3;
      combination.error_of_sides[v] += weights[q] * error * error;
    }
  }
  return combination;
}

std::vector<double> standard_errors(const Combination& combination, const Cells& cells,
                                    std::span<const std::uint8_t> known,
                                    std::span<const std::uint8_t> seen, double typical_length,
                                    bool has_noise, const WholeFrameConstants& constants) {
  const std::size_t k = known.size();
  std::vector<std::uint8_t> unseen(k);
  std::ranges::transform(seen, unseen.begin(),
                         [](std::uint8_t s) { return static_cast<std::uint8_t>(s == 0); });
  const auto edges_to = [&](std::span<const std::uint8_t> nearest) {
    Generations generations(k);
    generations.classify(cells, nearest);
    const auto all = generations.of_vertices();
    return std::vector<Index>(all.begin(), all.end());
  };
  const auto to_known = edges_to(known);
  const auto to_seen = edges_to(seen);
  const auto to_unseen = edges_to(unseen);

  std::vector<double> errors(k);
  for (std::size_t v = 0; v < k; ++v) {
    const double of_sides = combination.error_of_sides[v];
    if (to_known[v] == Generations::anchor) {
      errors[v] = has_noise ? std::sqrt(of_sides) : 0;
      continue;
    }
    if (to_known[v] == Generations::disconnected) {
      errors[v] = std::numeric_limits<double>::infinity();
      continue;
    }
    const double error =
        constants.error_scale *
        std::sqrt(constants.error_of_sides * of_sides + combination.disagreement[v]) *
        std::sqrt(static_cast<double>(to_known[v]));
    if (seen[v] != 0) {
      const int far = constants.farthest_unseen;
      const int distance = to_unseen[v] == Generations::disconnected ? far : to_unseen[v];
      errors[v] = error * (1 + constants.error_near_unseen / std::min(distance, far));
    } else {
      const double distance = std::min(to_seen[v], constants.farthest_seen);
      errors[v] = std::max(
          constants.error_of_unseen * error,
          constants.shape_of_unseen * typical_length * std::pow(distance, constants.shape_growth));
    }
  }
  return errors;
}

template PartialFrame known_parts(const Topology&, const Window<float>&,
                                  const WholeFrameConstants&);
template PartialFrame known_parts(const Topology&, const Window<double>&,
                                  const WholeFrameConstants&);
template std::vector<SideResult> make_trips(Faces, const Settings&, const Window<float>&,
                                            std::span<const Vector3<double>>, std::span<const Side>,
                                            const std::function<void()>&);
template std::vector<SideResult> make_trips(Faces, const Settings&, const Window<double>&,
                                            std::span<const Vector3<double>>, std::span<const Side>,
                                            const std::function<void()>&);

}  // namespace dynmesh
