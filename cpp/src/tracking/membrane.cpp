#include "tracking/membrane.hpp"

#include <algorithm>

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
      edges_.push_back({i, j, -k.values[static_cast<std::size_t>(e)], edge});
    }
  }
  rotations_.reset(rotations_.prepare(first_frame), first_frame, mean_edge);
}

void Membrane::add_forces(Field x, std::span<const Quaternion> rotations,
                          std::span<Vector3<double>> forces) {
  // Those of the shape are averages over clusters, with which cloth could not fold.
  std::ranges::copy(rotations, rotations_.quaternions().begin());
  rotations_.fit_narrowly(x);
  const auto q = rotations_.quaternions();
  for (const Edge& e : edges_) {
    const auto strain = turned(q[e.from], e.wanted) - (x[e.from] - x[e.to]);
    const auto half = (0.5 * constants_.membrane * e.weight) * strain;
    forces[e.from] = forces[e.from] + half;
    forces[e.to] = forces[e.to] - half;
  }
}

}  // namespace dynmesh
