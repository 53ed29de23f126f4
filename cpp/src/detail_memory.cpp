#include <algorithm>
#include <cmath>

#include "detail.hpp"
#include "geometry.hpp"
#include "stopwatch.hpp"

namespace dynmesh {
namespace {

/// The share that a frame has in the memory of how shape changes: of what it shows some is that
/// earlier frames erred, and later ones average that out. A change by more than a mean edge is an
/// error as a whole.
constexpr double newest = 0.3;

}  // namespace

template <class Real>
void Detail<Real>::remember(Frame completed) {
  const Stopwatch stopwatch(report_.rotation_seconds);
  take(completed);
  rotations_.fit(x_);
  for (std::size_t v = 0; v < x_.size(); ++v) last_memory_[v] = memory_[3 * v];
  take_memory();
  learn_change();
}

/// u: a running mean of how m_prev changes, begun anew where it jumps.
template <class Real>
void Detail<Real>::learn_change() {
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const auto change = memory_[3 * v] - last_memory_[v];
    Vector3<double>& u = memory_[3 * v + 2];
    const bool is_jump = !(squared_norm(change) < mean_edge_ * mean_edge_);
    u = is_jump ? Vector3<double>{} : (1 - newest) * u + newest * change;
  }
}

/// m_prev = Q^T K X, and m_first - m_prev.
template <class Real>
void Detail<Real>::take_memory() {
  apply_operator(x_, 1, kx_);
  workers_.for_each_short_stretch(n_vertices(), [&](Index first, Index last) {
    kernels_.turn_back(rotations_.quaternions().data(), kx_.data(), turned_.data(), first, last);
  });
  for (std::size_t v = 0; v < x_.size(); ++v) {
    memory_[3 * v] = turned_[v];
    memory_[3 * v + 1] = first_memory_[v] - turned_[v];
  }
}

template <class Real>
typename Detail<Real>::Memory Detail<Real>::memory() const {
  Memory memory;
  memory.rows.reserve(memory_rows());
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const Quaternion& q = rotations_.quaternions()[v];
    const Vector3<double>& u = memory_[3 * v + 2];
    memory.rows.push_back({q.w, q.x, q.y, q.z, u.x, u.y, u.z});
  }
  memory.anchor_weight = weight_;
  return memory;
}

template <class Real>
bool Detail<Real>::accepts(const Memory& memory) const {
  constexpr double rounding = 1e-6;
  const auto is_sound = [](const auto& row) {
    const double norm = row[0] * row[0] + row[1] * row[1] + row[2] * row[2] + row[3] * row[3];
    return std::abs(norm - 1) <= rounding && is_in_range(Vector3<double>{row[4], row[5], row[6]});
  };
  return memory.rows.size() == memory_rows() && std::ranges::all_of(memory.rows, is_sound) &&
         memory.anchor_weight >= least_weight && memory.anchor_weight <= largest_weight;
}

template <class Real>
void Detail<Real>::recall(const Memory& memory, Frame completed) {
  std::ranges::transform(memory.rows, rotations_.quaternions().begin(), [](const auto& row) {
    return Quaternion{row[0], row[1], row[2], row[3]};
  });
  weight_ = memory.anchor_weight;
  take(completed);
  take_memory();
  for (std::size_t v = 0; v < x_.size(); ++v) {
    memory_[3 * v + 2] = {memory.rows[v][4], memory.rows[v][5], memory.rows[v][6]};
  }
}

// The members that stand here; all others are made in detail.cpp.
#define DYNMESH_INSTANTIATE(Real)                                            \
  template void Detail<Real>::remember(Estimator<Real>::Frame);              \
  template void Detail<Real>::learn_change();                                \
  template void Detail<Real>::take_memory();                                 \
  template Estimator<Real>::Memory Detail<Real>::memory() const;             \
  template bool Detail<Real>::accepts(const Estimator<Real>::Memory&) const; \
  template void Detail<Real>::recall(const Estimator<Real>::Memory&, Estimator<Real>::Frame);
DYNMESH_INSTANTIATE(float)
DYNMESH_INSTANTIATE(double)
#undef DYNMESH_INSTANTIATE

}  // namespace dynmesh
