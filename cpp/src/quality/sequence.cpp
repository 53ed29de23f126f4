/// How good a sequence of frames is, by that of each frame.
#include <algorithm>
#include <dynmesh/quality.hpp>
#include <span>
#include <vector>

#include "base/default_arithmetic.hpp"
#include "quality/limits.hpp"

namespace dynmesh {

Quality quality_of_frames(std::span<const Quality> frames) {
  constexpr std::size_t run = quality_limits.run;
  if (frames.empty()) return Quality::good;
  if (frames.size() < run) return std::ranges::max(frames);
  Quality worst = Quality::good;
  for (std::size_t i = 0; i + run <= frames.size(); ++i) {
    worst = std::max(worst, std::ranges::min(frames.subspan(i, run)));
  }
  std::vector<Quality> sorted(frames.begin(), frames.end());
  std::ranges::sort(sorted);
  const std::size_t single = std::max<std::size_t>(1, frames.size() / quality_limits.single);
  return std::max(worst, sorted[frames.size() - 1 - single]);
}

bool is_hardly_known(std::size_t known, std::size_t n_vertices) {
  return static_cast<double>(known) < quality_limits.hardly_known * static_cast<double>(n_vertices);
}

std::size_t falling_sight(std::span<const double> seen) {
  const DefaultArithmetic arithmetic;
  constexpr std::size_t run = quality_limits.run;
  double best = 0;  // what all frames of an earlier run have
  for (std::size_t i = run; i + run <= seen.size(); ++i) {
    best = std::max(best, std::ranges::min(seen.subspan(i - run, run)));
    if (std::ranges::max(seen.subspan(i, run)) < quality_limits.falling_sight * best) return i;
  }
  return seen.size();
}

}  // namespace dynmesh
