#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <dynmesh/whole_frame.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "stream/arguments.hpp"
#include "support/workers.hpp"
#include "whole_frame/constants.hpp"
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
    check_position(name.c_str(), "vertex", v, row(Points<const Real>(points), v),
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
  const std::size_t n = counts.size();
  const auto rank = [&](std::size_t t) {
    return std::pair(counts[t], n - (std::max(2 * t + 1, n) - std::min(2 * t + 1, n)));
  };
  std::size_t best = 0;
  for (std::size_t t = 1; t < n; ++t) best = rank(t) > rank(best) ? t : best;
  return best;
}

/// The distances from the base, ascending, of the frames of one side, which has `length` frames.
std::vector<std::size_t> distances(std::size_t length, const WholeFrameConstants& constants) {
  std::vector<std::size_t> chosen;
  double step = 1;
  for (double at = 1; std::llround(at) <= static_cast<long long>(length); at += step) {
    chosen.push_back(static_cast<std::size_t>(std::llround(at)));
    if (chosen.size() >= constants.nearest_frames) step *= constants.step_growth;
  }
  return chosen;
}

/// The numbers of the frames that are used to make frame `base` whole, ascending: all of them, or
/// those around it, fewer with their distance.
std::vector<std::size_t> frames_around(std::size_t base, std::size_t n_frames,
                                       const WholeFrameConstants& constants) {
  std::vector<std::size_t> frames;
  if (n_frames <= constants.all_frames) {
    for (std::size_t t = 0; t < n_frames; ++t) frames.push_back(t);
    return frames;
  }
  for (const std::size_t distance : distances(base, constants)) frames.push_back(base - distance);
  std::ranges::reverse(frames);
  frames.push_back(base);
  for (const std::size_t distance : distances(n_frames - 1 - base, constants)) {
    frames.push_back(base + distance);
  }
  return frames;
}

template <class Real>
Window<Real> window_around(const FrameSource<Real>& source, std::size_t base, std::size_t n_frames,
                           std::size_t n_vertices, const WholeFrameConstants& constants) {
  Window<Real> window;
  window.n_vertices = n_vertices;
  window.numbers = frames_around(base, n_frames, constants);
  window.base =
      static_cast<std::size_t>(std::ranges::find(window.numbers, base) - window.numbers.begin());
  for (const std::size_t t : window.numbers) {
    window.positions.emplace_back(3 * n_vertices);
    window.known.emplace_back(n_vertices);
    read_frame(source, t, window.positions.back(), window.known.back());
  }
  return window;
}

Settings settings_of_completer(const WholeFrameSettings& chosen, bool learn) {
  return {.noise = chosen.noise, .learn = learn, .uncertainty = true, .threads = chosen.threads};
}

template <class Real>
void check_arguments(std::size_t n_vertices, std::size_t n_frames, const FrameSource<Real>& source,
                     const WholeFrameSettings& settings) {
  check_settings(settings_of_completer(settings, true));
  if (n_vertices == 0) throw std::invalid_argument("frames: have no vertices");
  if (n_frames == 0) throw std::invalid_argument("frames: there are none");
  if (!source) throw std::invalid_argument("frames: the source is empty");
  if (settings.frame && *settings.frame >= n_frames) {
    throw std::invalid_argument("frame: must be less than the number of frames, which is " +
                                std::to_string(n_frames) + ", not " +
                                std::to_string(*settings.frame));
  }
}

/// (k,) 1 for the vertices that at least one frame of the window knows.
template <class Real>
std::vector<std::uint8_t> seen_in(const Window<Real>& window) {
  std::vector<std::uint8_t> seen(window.n_vertices);
  for (const auto& known : window.known) {
    for (std::size_t v = 0; v < seen.size(); ++v) seen[v] |= known[v];
  }
  return seen;
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
                       const Window<Real>& window, std::span<const Vector3<double>> start,
                       const Progress& progress, const WholeFrameConstants& constants) {
  const auto attempt = [&](std::span<const SideResult> results) {
    Attempt made{combine(results, constants), {}};
    made.deviation = deviation_of(edges, lengths, made.combination.positions,
                                  window.known[window.base], constants);
    const double limit =
        std::max(constants.least_deviation, constants.most_deviation * made.deviation.usual);
    made.is_doubtful =
        made.deviation.of_frame > limit || made.deviation.usual > constants.most_usual;
    return made;
  };
  const auto is_better = [&](const Attempt& one, const Attempt& other) {
    return one.deviation.of_frame < constants.better_deviation * other.deviation.of_frame;
  };
  const std::size_t k = window.n_vertices;
  Attempt fill = attempt(std::vector{SideResult{
      {start.begin(), start.end()}, std::vector<double>(k), std::vector<std::uint8_t>(k, 1)}});
  fill.is_smooth_fill = true;
  const auto sides = sides_of(window.base, window.size() - 1 - window.base, constants);
  const bool is_whole =
      std::ranges::find(window.known[window.base], 0) == window.known[window.base].end();
  if (sides.empty() || (is_whole && !settings.noise)) return fill;  // there is nothing to improve

  std::size_t done = 0;
  std::size_t n_steps = 0;
  for (const Side side : sides) n_steps += 2 * frames_of(window, side).size();
  const auto step = [&] {
    if (progress) progress(done, n_steps);
    ++done;
  };
  const auto after_trips = [&](bool learn) {
    return attempt(make_trips<Real>(faces, settings_of_completer(settings, learn), window, start,
                                    sides, step));
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

template <class Real>
WholeFrame<Real> in_arrays(const Attempt& made, std::span<const double> errors,
                           std::vector<std::uint8_t> seen, const Window<Real>& window) {
  WholeFrame<Real> whole;
  for (const auto& position : made.combination.positions) {
    for (const double coordinate : {position.x, position.y, position.z}) {
      whole.positions.push_back(saturated<Real>(coordinate));
    }
  }
  for (const double error : errors) whole.standard_error.push_back(static_cast<Real>(error));
  whole.seen = std::move(seen);
  whole.known = window.known[window.base];
  whole.frame = window.numbers[window.base];
  whole.doubtful = made.is_doubtful;
  return whole;
}

}  // namespace

template <class Real>
WholeFrame<Real> whole_frame(Faces faces, std::size_t n_vertices, std::size_t n_frames,
                             const FrameSource<Real>& source, const WholeFrameSettings& settings,
                             const Progress& progress) {
  const WholeFrameConstants constants;
  check_arguments(n_vertices, n_frames, source, settings);
  const Topology topology = topology_of(faces, n_vertices);
  const Cells& cells = topology.cells;
  Workers workers(settings.threads);

  Survey survey = survey_of(source, n_frames, n_vertices);
  const std::size_t base = settings.frame.value_or(best_frame(survey.counts));
  Window<Real> window = window_around(source, base, n_frames, n_vertices, constants);
  const auto before = seen_in(window);
  if (settings.outliers) drop_outliers(cells, window, constants);
  const auto seen = seen_in(window);
  // Vertices of which only outliers were known in these frames do not count as seen.
  for (std::size_t v = 0; v < n_vertices; ++v) {
    if (before[v] != seen[v]) survey.seen[v] = 0;
  }
  if (std::ranges::find(seen, 1) == seen.end()) {
    throw std::invalid_argument("frames: no vertex is known in any of them");
  }

  const auto start = smooth_fill(topology, known_parts(topology, window, constants), workers);
  const auto edges = edges_of(cells);
  const auto lengths = pair_lengths<Real>(edges, window, constants);
  const Attempt made =
      completed_base<Real>(faces, settings, edges, lengths, window, start, progress, constants);
  const auto& known = window.known[window.base];
  // A smooth fill is made of the known vertices alone.
  const auto errors =
      standard_errors(made.combination, cells, known, made.is_smooth_fill ? known : seen,
                      typical_length(lengths), settings.noise.has_value(), constants);
  return in_arrays<Real>(made, errors, std::move(survey.seen), window);
}

template WholeFrame<float> whole_frame(Faces, std::size_t, std::size_t, const FrameSource<float>&,
                                       const WholeFrameSettings&, const Progress&);
template WholeFrame<double> whole_frame(Faces, std::size_t, std::size_t, const FrameSource<double>&,
                                        const WholeFrameSettings&, const Progress&);

}  // namespace dynmesh
