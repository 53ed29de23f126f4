#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "detail/modes.hpp"
#include "detail/rotations.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"

namespace dynmesh {
namespace {

constexpr int most_fits = 100;
constexpr double settled = 1e-9;  // of the components of a quaternion

/// The rotation that best maps one frame to another as a whole.
Quaternion whole_rotation(std::span<const Vector3<double>> from,
                          std::span<const Vector3<double>> to) {
  const RigidMotion motion = fit_rigid_motion<double>(from, to);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rows(
      motion.rotation.front().data());
  const Eigen::Quaterniond q(Eigen::Matrix3d{rows});
  return {q.w(), q.x(), q.y(), q.z()};
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
