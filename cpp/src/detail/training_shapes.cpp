#include "detail/training_shapes.hpp"

#include <algorithm>
#include <cmath>

#include "detail/rotations.hpp"
#include "kernels/best_rotation.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

constexpr int most_fits = 100;
constexpr double settled = 1e-9;  // of the components of a quaternion

Vector3<double> mean_of(std::span<const Vector3<double>> frame) {
  Vector3<double> mean{};
  for (const auto& x : frame) mean = mean + (1 / static_cast<double>(frame.size())) * x;
  return mean;
}

/// The rotation that best maps one frame to another as a whole.
Quaternion whole_rotation(std::span<const Vector3<double>> from,
                          std::span<const Vector3<double>> to) {
  const Vector3<double> from_mean = mean_of(from);
  const Vector3<double> to_mean = mean_of(to);
  double s[3][3] = {};
  for (std::size_t v = 0; v < from.size(); ++v) {
    const Vector3<double> a = to[v] - to_mean;
    const Vector3<double> b = from[v] - from_mean;
    const double rows[3] = {a.x, a.y, a.z};
    for (int r = 0; r < 3; ++r) {
      s[r][0] += rows[r] * b.x;
      s[r][1] += rows[r] * b.y;
      s[r][2] += rows[r] * b.z;
    }
  }
  double largest = 0;
  for (const auto& row : s) {
    for (const double value : row) largest = std::max(largest, std::abs(value));
  }
  const Quaternion none{1, 0, 0, 0};
  if (!(largest > 0)) return none;
  for (auto& row : s) {
    for (double& value : row) value /= largest;
  }
  return best_rotation(s, none, none);
}

double largest_change(std::span<const Quaternion> before, std::span<const Quaternion> after) {
  double largest = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    const Quaternion& a = before[v];
    const Quaternion& b = after[v];
    largest = std::max({largest, std::abs(a.w - b.w), std::abs(a.x - b.x), std::abs(a.y - b.y),
                        std::abs(a.z - b.z)});
  }
  return largest;
}

/// Returns z of all frames: for each vertex, those in all frames, (k, n_frames). Q is fitted to a
/// frame until it no longer changes, from the rotation that fits the whole frame best, since its
/// pose may be far from `first`.
std::vector<Vector3<double>> training_shapes(const TrainingFrames& training,
                                             const DetailOperator& k, const Cells& cells,
                                             std::span<const Vector3<double>> first,
                                             double mean_edge, Workers& workers) {
  const std::size_t n_vertices = first.size();
  std::vector<Vector3<double>> shapes(n_vertices * training.size());
  std::vector<Vector3<double>> first_shape(n_vertices);
  std::vector<Vector3<double>> x(n_vertices);
  std::vector<Vector3<double>> kx(n_vertices);
  std::vector<Quaternion> before(n_vertices);
  apply_operator(k, first, 1, first_shape, workers);
  Rotations rotations(cells, workers);
  rotations.reset(rotations.prepare(first), first, mean_edge);
  for (std::size_t frame = 0; frame < training.size(); ++frame) {
    std::ranges::copy(training[frame], x.begin());
    std::ranges::fill(rotations.quaternions(), whole_rotation(first, x));
    for (int n = 0; n < most_fits; ++n) {
      std::ranges::copy(rotations.quaternions(), before.begin());
      rotations.fit(x);
      if (largest_change(before, rotations.quaternions()) <= settled) break;
    }
    apply_operator(k, x, 1, kx, workers);
    rotations.turn_back(kx, kx);
    for (std::size_t v = 0; v < n_vertices; ++v) {
      shapes[v * training.size() + frame] = kx[v] - first_shape[v];
    }
  }
  return shapes;
}

}  // namespace

Modes training_modes(const TrainingFrames& training, const SurfaceParts& parts,
                     const DetailOperator& k, const Cells& cells,
                     std::span<const Vector3<double>> first, double mean_edge,
                     const Rounding& rounding, const DetailConstants& constants, Workers& workers) {
  const auto shapes = training_shapes(training, k, cells, first, mean_edge, workers);
  ModeScale scale = {mean_edge, 0};
  for (const auto& frame : training) {
    scale.rounding = std::max(scale.rounding, rounding.mean_square(frame));
  }
  return Modes(parts, shapes, training.size(), constants.training, scale);
}

}  // namespace dynmesh
