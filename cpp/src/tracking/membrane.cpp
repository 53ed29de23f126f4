#include "tracking/membrane.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

Vector3<double> turned(const Quaternion& q, const Vector3<double>& v) {
  const Vector3<double> axis = {q.x, q.y, q.z};
  const auto half = cross(axis, v);
  return v + 2 * (q.w * half + cross(axis, half));
}

}  // namespace

Membrane::Membrane(const DetailOperator& k, Field first_frame, double mean_edge,
                   std::span<const std::uint8_t> is_cloth, const Topology& topology,
                   Workers& workers, const TrackingConstants& constants)
    : constants_(constants), rotations_(topology.cells, workers) {
  for (std::size_t i = 0; i < k.size(); ++i) {
    if (is_cloth[i] == 0) continue;
    for (Index e = k.offsets[i]; e < k.offsets[i + 1]; ++e) {
      const auto j = static_cast<std::size_t>(k.columns[static_cast<std::size_t>(e)]);
      if (j == i) continue;
      const auto edge = first_frame[i] - first_frame[j];
      edges_.push_back({i, j, -k.values[static_cast<std::size_t>(e)], edge, edge});
    }
  }
  rotations_.reset(rotations_.prepare(first_frame), first_frame, mean_edge);
  // A state that is restored remembers frame 0, too.
  const auto none = rotations_.quaternions();
  remember(first_frame, std::vector<Quaternion>(none.begin(), none.end()));
}

/// Finds the rotations of single cells, from those of the shape: these are averages over clusters,
/// with which cloth could not fold.
void Membrane::fit(Field x, std::span<const Quaternion> rotations) {
  std::ranges::copy(rotations, rotations_.quaternions().begin());
  rotations_.fit_narrowly(x);
}

void Membrane::remember(Field last, std::span<const Quaternion> rotations) {
  fit(last, rotations);
  const auto q = rotations_.quaternions();
  for (Edge& e : edges_) {
    const auto now = last[e.from] - last[e.to];
    const double share = std::sqrt(squared_norm(now) / squared_norm(e.first));
    const Quaternion& turn = q[e.from];
    const Quaternion back = {turn.w, -turn.x, -turn.y, -turn.z};
    e.wanted = share > constants_.least_edge ? (1 / share) * turned(back, now) : e.first;
  }
}

void Membrane::add_forces(Field x, std::span<const Quaternion> rotations,
                          std::span<Vector3<double>> forces) {
  fit(x, rotations);
  const auto q = rotations_.quaternions();
  for (const Edge& e : edges_) {
    const auto strain = turned(q[e.from], e.wanted) - (x[e.from] - x[e.to]);
    const auto half = (0.5 * constants_.membrane * e.weight) * strain;
    forces[e.from] = forces[e.from] + half;
    forces[e.to] = forces[e.to] - half;
  }
}

}  // namespace dynmesh
