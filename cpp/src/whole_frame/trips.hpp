/// The trips of a completer to the ends of a window and back.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "linear/interpolation.hpp"
#include "whole_frame/window.hpp"

namespace dynmesh {

/// A frame, and which of its vertices were observed, in it or in another frame.
struct PartialFrame {
  std::vector<Vector3> positions;
  std::vector<std::uint8_t> fixed;
};

/// (components,) how many vertices of each component are marked.
inline std::vector<std::size_t> count_in_components(const Topology& topology,
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
  std::vector<Vector3> there, here;
  for (Index v = 0; v < static_cast<Index>(window.n_vertices); ++v) {
    if (!window.is_known(frame, v) || !window.is_known(window.base, v)) continue;
    there.push_back(window.position(frame, v));
    here.push_back(window.position(window.base, v));
  }
  return there.empty() ? RigidMotion{} : fit_rigid_motion(there, here);
}

/// The known vertices of the base. A component of which it knows fewer than four vertices comes
/// from the frame that knows most of them, moved rigidly to the vertices that both frames know.
template <class Real>
PartialFrame known_parts(const Topology& topology, const Window<Real>& window) {
  const std::size_t k = window.n_vertices;
  PartialFrame frame{std::vector<Vector3>(k), window.known[window.base]};
  for (Index v = 0; v < static_cast<Index>(k); ++v) {
    if (frame.fixed[at(v)] != 0) frame.positions[at(v)] = window.position(window.base, v);
  }
  std::vector<std::vector<std::size_t>> counts;  // of known vertices, by frames and components
  for (const auto& known : window.known) counts.push_back(count_in_components(topology, known));
  for (std::size_t c = 0; c < topology.report.components; ++c) {
    if (counts[window.base][c] >= 4) continue;
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

/// Solves L^2 x = 0 for the vertices that are not fixed, where L is the uniform Laplacian: the
/// smoothest surface through the others. Components without any fixed vertex shrink to the mean of
/// the fixed vertices, as nothing is known of them.
inline std::vector<Vector3> smooth_fill(const Topology& topology, PartialFrame frame,
                                        Workers& workers) {
  const std::size_t k = frame.positions.size();
  const auto counts = count_in_components(topology, frame.fixed);
  Vector3 mean;
  double n_fixed = 0;
  for (std::size_t v = 0; v < k; ++v) {
    if (frame.fixed[v] == 0) continue;
    mean = mean + frame.positions[v];
    ++n_fixed;
  }
  if (n_fixed > 0) mean = (1 / n_fixed) * mean;
  std::vector<std::uint8_t> is_free(k);
  std::vector<Vector3> from_mean(k);  // which those that are not known begin at
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

/// The frames of a window from its base to one end.
using Way = std::vector<std::size_t>;

/// The ways to the first and to the last frame, without one that has no frame beside the base.
template <class Real>
std::vector<Way> ways_from_base(const Window<Real>& window) {
  std::vector<Way> ways(2);
  for (std::size_t i = window.base + 1; i > 0; --i) ways[0].push_back(i - 1);
  for (std::size_t i = window.base; i < window.size(); ++i) ways[1].push_back(i);
  std::erase_if(ways, [](const Way& way) { return way.size() == 1; });
  return ways;
}

/// The frames that are completed on a way there and back.
inline std::size_t n_steps_on(const Way& way) { return 2 * (way.size() - 1); }

/// How many trips are made on these ways in turn, beginning and ending with the first: at least
/// five, and on short ways so many that they complete 300 frames, but no more than fifteen.
inline std::size_t n_trips_on(std::span<const Way> ways) {
  std::size_t per_trip = 0;  // on average
  for (const Way& way : ways) per_trip += n_steps_on(way) / ways.size();
  const std::size_t wanted = (300 + per_trip - 1) / per_trip;
  return std::clamp<std::size_t>(wanted, 5, 15) | 1U;
}

/// What the last trip to one side found of each vertex of the base.
struct SideResult {
  std::vector<Vector3> positions;
  std::vector<double> standard_error;  ///< infinity for disconnected vertices
  std::vector<std::uint8_t> seen;      ///< 1 if the base or a frame of this side knows it
};

/// Makes the trips, one after another, each from the frame with which the last one came back; the
/// first starts from `start`. A trip is two sequences of a completer: one from the base to the end
/// of the window, and another one from there to the base. Returns the results of the last trip on
/// each way. Calls `step` before each frame.
template <class Real, class Step>
std::vector<SideResult> make_trips(Faces faces, const Settings& settings,
                                   const Window<Real>& window, Field start,
                                   std::span<const Way> ways, const Step& step) {
  const std::size_t k = window.n_vertices;
  std::vector<Real> frame(3 * k);  // the one that was completed last
  const Points<Real> points(frame.data(), k);
  for (std::size_t v = 0; v < k; ++v) put_row(points, v, start[v]);
  Completer<Real> completer(faces, points, settings);
  const auto push = [&](std::size_t t) {
    step();
    completer.push(window.points(t), KnownMask(window.known[t].data(), k), points);
  };

  std::vector<SideResult> results(ways.size());
  for (std::size_t trip = 0; trip < n_trips_on(ways); ++trip) {
    const Way& way = ways[trip % ways.size()];
    completer.reset(points);
    for (std::size_t i = 1; i < way.size(); ++i) push(way[i]);
    completer.reset(points);
    for (std::size_t i = way.size() - 1; i > 0; --i) push(way[i - 1]);

    SideResult& result = results[trip % ways.size()] = {};
    for (std::size_t v = 0; v < k; ++v) {
      result.positions.push_back(row(Points<const Real>(points), v));
    }
    const auto errors = completer.standard_error();
    result.standard_error.assign(errors.begin(), errors.end());
    result.seen = window.seen_in(way);
  }
  return results;
}

/// The weighted mean of the sides, y = sum of w_q y_q.
struct Combination {
  std::vector<Vector3> positions;
  std::vector<double> disagreement;    ///< D: the mean of |y_q - y|^2 / 3
  std::vector<double> error_of_sides;  ///< S: the mean of s_q^2, infinity where all are
};

/// The weights w_q are proportional to s_q^(-3/2), where s_q is the standard error; a millionth of
/// that if the vertex was never seen on that side, and equal where no side is better. `results`
/// must not be empty.
inline Combination combine(std::span<const SideResult> results) {
  const std::size_t k = results.front().positions.size();
  Combination combination{std::vector<Vector3>(k), std::vector<double>(k), std::vector<double>(k)};
  std::vector<double> weights(results.size());
  for (std::size_t v = 0; v < k; ++v) {
    double sum = 0;
    for (std::size_t q = 0; q < results.size(); ++q) {
      // The exponent would be -2 if standard errors were exact. Infinity where they are 0.
      weights[q] =
          (results[q].seen[v] != 0 ? 1 : 1e-6) * std::pow(results[q].standard_error[v], -1.5);
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

/// (k,) the standard errors of a combination, of vertices that are neither known nor disconnected:
/// 0.92 sqrt(0.3 S + D) sqrt(r) (1 + 2 / min(u, 20)), where r is the number of edges to the nearest
/// vertex that the frame knows, and u that to the nearest one that no frame knows, 20 if there is
/// none. For such a vertex itself, it is at least 2.5 times that, and at least
/// 0.5 h min(r', 6)^0.85, where h is the typical length of an edge and r' the number of edges to
/// the nearest vertex that any frame knows. Infinity for disconnected vertices. Known vertices have
/// 0, or with noise the root of S.
inline std::vector<double> standard_errors(const Combination& combination, const Cells& cells,
                                           std::span<const std::uint8_t> known,
                                           std::span<const std::uint8_t> seen,
                                           double typical_length, bool has_noise) {
  const std::size_t k = known.size();
  std::vector<std::uint8_t> unseen(k);
  for (std::size_t v = 0; v < k; ++v) unseen[v] = seen[v] == 0 ? 1 : 0;
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
    const double error = 0.92 * std::sqrt(0.3 * of_sides + combination.disagreement[v]) *
                         std::sqrt(static_cast<double>(to_known[v]));
    if (seen[v] != 0) {
      const Index distance = to_unseen[v] == Generations::disconnected ? 20 : to_unseen[v];
      errors[v] = error * (1 + 2.0 / std::min(distance, 20));
    } else {
      const double distance = std::min(to_seen[v], 6);
      errors[v] = std::max(2.5 * error, 0.5 * typical_length * std::pow(distance, 0.85));
    }
  }
  return errors;
}

}  // namespace dynmesh
