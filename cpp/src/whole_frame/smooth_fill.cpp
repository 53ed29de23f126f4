#include <algorithm>
#include <cstddef>

#include "factor/interpolation.hpp"
#include "support/rigid_motion.hpp"
#include "whole_frame/trips.hpp"

namespace dynmesh {
namespace {

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
  std::vector<Index> common;
  std::vector<Vector3<double>> there(window.n_vertices);
  std::vector<Vector3<double>> here(window.n_vertices);
  for (std::size_t i = 0; i < window.n_vertices; ++i) {
    const auto v = static_cast<Index>(i);
    if (!window.is_known(frame, v) || !window.is_known(window.base, v)) continue;
    common.push_back(v);
    there[i] = window.position(frame, v);
    here[i] = window.position(window.base, v);
  }
  if (common.empty()) return {};
  return fit_rigid_motion<double>(common, there, here);
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
  for (std::size_t v = 0; v < k; ++v) {
    if (frame.fixed[v] != 0) {
      frame.positions[v] = window.position(window.base, static_cast<Index>(v));
    }
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
    for (std::size_t i = 0; i < k; ++i) {
      const auto v = static_cast<Index>(i);
      if (static_cast<std::size_t>(topology.component[i]) != c || frame.fixed[i] != 0) continue;
      if (!window.is_known(best, v)) continue;
      frame.positions[i] = motion.apply(window.position(best, v));
      frame.fixed[i] = 1;
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
    SparseMatrix energy;
    energy = l * l;
    MaskedFactor factor(energy, workers);
    interpolate(energy, factor, is_free, from_mean);
  }
  for (std::size_t v = 0; v < k; ++v) {
    if (frame.fixed[v] == 0) frame.positions[v] = mean + from_mean[v];
  }
  return std::move(frame.positions);
}

template PartialFrame known_parts(const Topology&, const Window<float>&,
                                  const WholeFrameConstants&);
template PartialFrame known_parts(const Topology&, const Window<double>&,
                                  const WholeFrameConstants&);

}  // namespace dynmesh
