#include <algorithm>
#include <cstddef>

#include "factor/elimination.hpp"
#include "factor/masked_factor.hpp"
#include "support/rigid_motion.hpp"
#include "whole_frame/trips.hpp"

namespace dynmesh {
namespace {

/// (components,) how many vertices of each component are marked.
std::vector<std::size_t> count_in_components(const Topology& topology,
                                             std::span<const std::uint8_t> marked) {
  std::vector<std::size_t> counts(topology.report.components);
  for (std::size_t v = 0; v < marked.size(); ++v) {
    if (marked[v] != 0) ++counts[static_cast<std::size_t>(topology.component[v])];
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

/// L^2, where L is the uniform Laplacian: the degrees on the diagonal, -1 for each edge.
SymmetricMatrix squared_laplacian(const Cells& cells) {
  SymmetricMatrix matrix;
  matrix.offsets.push_back(0);
  std::vector<double> column(cells.size());
  std::vector<Index> entries;
  const auto degree = [&](Index v) { return static_cast<double>(cells[v].size()); };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto v = static_cast<Index>(i);
    entries.clear();
    const auto add = [&](Index row, double value) {
      double& entry = column[static_cast<std::size_t>(row)];
      if (entry == 0) entries.push_back(row);
      entry += value;
    };
    // Column v of L L: the sum over the rows n of column v of L. Sums that are 0 on the way may
    // list a row twice.
    add(v, degree(v) * degree(v));
    for (const Index n : cells[v]) {
      add(n, -degree(v) - degree(n));
      for (const Index far : cells[n]) add(far, 1);
    }
    std::ranges::sort(entries);
    // Not by ranges, which Clang 14 refuses here.
    entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
    for (const Index row : entries) {
      double& entry = column[static_cast<std::size_t>(row)];
      matrix.rows.push_back(row);
      matrix.values.push_back(entry);
      entry = 0;
    }
    matrix.offsets.push_back(static_cast<Index>(matrix.rows.size()));
  }
  return matrix;
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
  std::vector<std::uint8_t> free(k);
  bool is_whole = true;
  for (std::size_t v = 0; v < k; ++v) {
    if (frame.fixed[v] != 0) continue;
    frame.positions[v] = mean;
    if (counts[static_cast<std::size_t>(topology.component[v])] == 0) continue;
    free[v] = 1;
    is_whole = false;
  }
  if (is_whole) return std::move(frame.positions);

  // With x = mean + y, the fixed y are known and those that are free begin at 0.
  const SymmetricMatrix matrix = squared_laplacian(topology.cells);
  MaskedFactor factor(matrix, workers);
  factor.factorize(free);
  std::vector<Vector3<double>> values;
  for (const Index column : factor.order()) {
    Vector3<double> sum;
    const auto c = static_cast<std::size_t>(column);
    for (Index e = matrix.offsets[c]; e < matrix.offsets[c + 1]; ++e) {
      const auto row = static_cast<std::size_t>(matrix.rows[static_cast<std::size_t>(e)]);
      if (frame.fixed[row] == 0) continue;
      const double weight = matrix.values[static_cast<std::size_t>(e)];
      sum = sum + weight * (mean - frame.positions[row]);
    }
    values.push_back(sum);
  }
  factor.solve(values, 1);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto v = static_cast<std::size_t>(factor.order()[i]);
    frame.positions[v] = mean + values[i];
  }
  return std::move(frame.positions);
}

template PartialFrame known_parts(const Topology&, const Window<float>&,
                                  const WholeFrameConstants&);
template PartialFrame known_parts(const Topology&, const Window<double>&,
                                  const WholeFrameConstants&);

}  // namespace dynmesh
