#include "whole_frame/window.hpp"

#include <algorithm>
#include <cmath>

namespace dynmesh {
namespace {

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

}  // namespace

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

}  // namespace dynmesh
