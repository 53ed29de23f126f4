/// The constants were chosen by trials on recorded and simulated sequences; docs/method.md
/// describes them.
#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <dynmesh/whole_frame.hpp>
#include <numeric>
#include <string>
#include <utility>

#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"
#include "base/workers.hpp"
#include "mesh/faces.hpp"
#include "whole_frame/edge_lengths.hpp"
#include "whole_frame/trips.hpp"
#include "whole_frame/window.hpp"

namespace dynmesh {
namespace {

/// What a first look at all frames finds.
struct Survey {
  std::vector<std::uint8_t> seen;   // (k,) whether any frame knows the vertex
  std::vector<std::size_t> counts;  // (frames,) the number of known vertices
};

/// Refuses known positions that are out of range.
template <class Real>
void read_frame(const FrameSource<Real>& source, std::size_t frame, std::vector<Real>& positions,
                std::vector<std::uint8_t>& known) {
  const Points<Real> points(positions.data(), known.size());
  std::ranges::fill(known, std::uint8_t{0});
  source(frame, points, known);
  const std::string name = "frame " + std::to_string(frame);
  for (std::size_t v = 0; v < known.size(); ++v) {
    if (known[v] == 0) continue;
    known[v] = 1;
    (void)checked_row(name.c_str(), "vertex", Points<const Real>(points), v,
                      "known positions must be finite");
  }
}

template <class Real>
Survey survey_of(const FrameSource<Real>& source, std::size_t n_frames, std::size_t n_vertices) {
  Survey survey{std::vector<std::uint8_t>(n_vertices), {}};
  std::vector<Real> positions(3 * n_vertices);
  std::vector<std::uint8_t> known(n_vertices);
  for (std::size_t t = 0; t < n_frames; ++t) {
    read_frame(source, t, positions, known);
    std::size_t count = 0;
    for (std::size_t v = 0; v < n_vertices; ++v) {
      count += known[v];
      survey.seen[v] |= known[v];
    }
    survey.counts.push_back(count);
  }
  return survey;
}

/// The frame that knows most vertices; of several, the one that is nearest to the middle.
std::size_t best_frame(const std::vector<std::size_t>& counts) {
  const auto rank = [&](std::size_t t) {
    const auto off = 2 * static_cast<std::ptrdiff_t>(t) + 1 - std::ssize(counts);
    return std::pair(counts[t], -std::abs(off));
  };
  std::size_t best = 0;
  for (std::size_t t = 1; t < counts.size(); ++t) {
    if (rank(t) > rank(best)) best = t;
  }
  return best;
}

/// The numbers of the frames that are used to make frame `base` whole, ascending: up to 250, all of
/// them, and of more the nearest 30 on each side, and then with steps that grow.
std::vector<std::size_t> frames_around(std::size_t base, std::size_t n_frames) {
  const double growth = n_frames <= 250 ? 1 : 1.05;
  const auto distances = [&](std::size_t farthest) {
    std::vector<std::size_t> chosen;
    double step = 1;
    for (double at = 1; std::llround(at) <= static_cast<long long>(farthest); at += step) {
      chosen.push_back(static_cast<std::size_t>(std::llround(at)));
      if (chosen.size() >= 30) step *= growth;
    }
    return chosen;
  };
  std::vector<std::size_t> frames = {base};
  for (const std::size_t distance : distances(base)) frames.push_back(base - distance);
  for (const std::size_t distance : distances(n_frames - 1 - base)) {
    frames.push_back(base + distance);
  }
  std::ranges::sort(frames);
  return frames;
}

template <class Real>
Window<Real> window_around(const FrameSource<Real>& source, std::size_t base, std::size_t n_frames,
                           std::size_t n_vertices) {
  Window<Real> window;
  window.n_vertices = n_vertices;
  window.numbers = frames_around(base, n_frames);
  for (const std::size_t t : window.numbers) {
    if (t < base) ++window.base;
    window.positions.emplace_back(3 * n_vertices);
    window.known.emplace_back(n_vertices);
    read_frame(source, t, window.positions.back(), window.known.back());
  }
  return window;
}

Settings settings_of_completer(const WholeFrameSettings& chosen, bool learn) {
  return {.noise = chosen.noise, .learn = learn, .uncertainty = true, .threads = chosen.threads};
}

/// A whole frame, and whether its edges are far from their usual lengths.
struct Attempt {
  Combination combination;
  Deviation deviation;
  bool is_doubtful = false;
  bool is_smooth_fill = false;
};

/// Completes the base by trips from a smooth fill, first with what they learn from the frames, and
/// if the result is doubtful without. If that is hardly better than the smooth fill, returns it.
template <class Real>
Attempt completed_base(Faces faces, const WholeFrameSettings& settings,
                       std::span<const VertexPair> edges, std::span<const PairLength> lengths,
                       const Window<Real>& window, Field start, const Progress& progress) {
  const auto& known = window.known[window.base];
  // Doubtful are edges whose logarithms deviate three times as much as those of the frames, and by
  // more than rounding and smoothing can explain; and frames whose own edges vary by so much that
  // they are of no surface.
  const auto attempt = [&](std::span<const SideResult> results) {
    Attempt made{combine(results), {}};
    made.deviation = deviation_of(edges, lengths, made.combination.positions, known);
    const auto [of_frame, usual] = made.deviation;
    made.is_doubtful = of_frame > std::max(0.05, 3 * usual) || usual > 0.5;
    return made;
  };
  const auto is_better = [&](const Attempt& one, const Attempt& other) {
    return one.deviation.of_frame < 0.8 * other.deviation.of_frame;
  };
  const std::size_t k = window.n_vertices;
  Attempt fill = attempt(std::vector{SideResult{
      {start.begin(), start.end()}, std::vector<double>(k), std::vector<std::uint8_t>(k, 1)}});
  fill.is_smooth_fill = true;
  const auto ways = ways_from_base(window);
  const bool is_whole = std::ranges::find(known, 0) == known.end();
  if (ways.empty() || (is_whole && !settings.noise)) return fill;  // there is nothing to improve

  std::size_t done = 0;
  std::size_t n_steps = 0;
  for (std::size_t trip = 0; trip < n_trips_on(ways); ++trip) {
    n_steps += n_steps_on(ways[trip % ways.size()]);
  }
  const auto step = [&] {
    if (progress) progress(done, n_steps);
    ++done;
  };
  const auto after_trips = [&](bool learn) {
    return attempt(
        make_trips<Real>(faces, settings_of_completer(settings, learn), window, start, ways, step));
  };
  Attempt best = after_trips(true);
  if (!best.is_doubtful) return best;
  n_steps *= 2;
  Attempt other = after_trips(false);
  if (is_better(other, best)) best = std::move(other);
  if (!best.is_doubtful || is_better(best, fill)) return best;
  fill.is_doubtful = true;
  return fill;
}

}  // namespace

template <class Real>
WholeFrame<Real> whole_frame(Faces faces, std::size_t n_vertices, std::size_t n_frames,
                             const FrameSource<Real>& source, const WholeFrameSettings& settings,
                             const Progress& progress) {
  const DefaultArithmetic arithmetic;
  check_settings(settings_of_completer(settings, true));
  if (n_vertices == 0) refuse("frames", "have no vertices");
  if (n_frames == 0) refuse("frames", "there are none");
  if (!source) refuse("frames", "the source is empty");
  if (settings.frame && *settings.frame >= n_frames) {
    refuse("frame", "must be less than the number of frames, which is ", n_frames, ", not ",
           *settings.frame);
  }
  const Topology topology = checked_topology(faces, n_vertices);
  const Cells& cells = topology.cells;
  Workers workers(settings.threads);

  Survey survey = survey_of(source, n_frames, n_vertices);
  const std::size_t base = settings.frame.value_or(best_frame(survey.counts));
  Window<Real> window = window_around(source, base, n_frames, n_vertices);
  std::vector<std::size_t> all_frames(window.size());
  std::iota(all_frames.begin(), all_frames.end(), std::size_t{0});
  const auto before = window.seen_in(all_frames);
  if (settings.outliers) drop_outliers(cells, window);
  const auto seen = window.seen_in(all_frames);
  // Vertices of which only outliers were known in these frames do not count as seen.
  for (std::size_t v = 0; v < n_vertices; ++v) {
    if (before[v] != seen[v]) survey.seen[v] = 0;
  }
  if (std::ranges::find(seen, 1) == seen.end())
    refuse("frames", "no vertex is known in any of them");

  const auto start = smooth_fill(topology, known_parts(topology, window), workers);
  const auto edges = edges_of(cells);
  const auto lengths = pair_lengths<Real>(edges, window);
  const Attempt made =
      completed_base<Real>(faces, settings, edges, lengths, window, start, progress);
  const PairLength typical = typical_length(lengths);
  const double length = typical.frames > 0 ? std::exp(typical.median) : 1;
  WholeFrame<Real> whole;
  for (const auto& position : made.combination.positions) {
    for (const double coordinate : {position.x, position.y, position.z}) {
      whole.positions.push_back(saturated<Real>(coordinate));
    }
  }
  whole.known = window.known[window.base];
  // A smooth fill is made of the known vertices alone.
  for (const double error : standard_errors(made.combination, cells, whole.known,
                                            made.is_smooth_fill ? whole.known : seen, length,
                                            settings.noise.has_value())) {
    whole.standard_error.push_back(saturated_or_infinite<Real>(error));
  }
  whole.seen = std::move(survey.seen);
  whole.frame = base;
  whole.doubtful = made.is_doubtful;
  return whole;
}

template WholeFrame<float> whole_frame(Faces, std::size_t, std::size_t, const FrameSource<float>&,
                                       const WholeFrameSettings&, const Progress&);
template WholeFrame<double> whole_frame(Faces, std::size_t, std::size_t, const FrameSource<double>&,
                                        const WholeFrameSettings&, const Progress&);

}  // namespace dynmesh
