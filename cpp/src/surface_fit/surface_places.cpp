#include "surface_fit/surface_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/rigid_motion.hpp"

namespace dynmesh {
std::vector<std::uint32_t> next_sides(std::span<const Triangle> faces) {
  struct Side {
    std::array<Index, 2> ends;
    std::uint32_t number;
  };
  std::vector<Side> sides;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (std::uint32_t s = 0; s < 3; ++s) {
      const auto [a, b] = std::minmax(faces[f][(s + 1) % 3], faces[f][(s + 2) % 3]);
      sides.push_back({{a, b}, 3 * f + s});
    }
  }
  std::ranges::stable_sort(sides, {}, &Side::ends);
  std::vector<std::uint32_t> next(sides.size());
  for (auto first = sides.begin(); first != sides.end();) {
    const auto end = std::find_if(first, sides.end(),
                                  [&](const Side& side) { return side.ends != first->ends; });
    for (auto side = first; side != end; ++side) {
      next[side->number] = (side + 1 == end ? first : side + 1)->number;
    }
    first = end;
  }
  return next;
}

std::vector<Vector3> vertex_normals(std::span<const Triangle> faces, Field frame) {
  std::vector<Vector3> normals(frame.size());
  for (const Triangle& face : faces) {
    const auto normal = normal_of(face, frame);
    for (const Index v : face) normals[v] = normals[v] + normal;
  }
  std::ranges::transform(normals, normals.begin(), unit_of);
  return normals;
}

std::vector<double> find_outsides(std::span<const Triangle> faces, const Topology& topology,
                                  Field frame, double mean_edge) {
  std::vector<double> volumes(topology.report.components);
  std::vector<Vector3> origins(volumes.size());
  for (std::size_t v = frame.size(); v-- > 0;) origins[topology.component[v]] = frame[v];
  for (const Triangle& face : faces) {
    const Index c = topology.component[face[0]];
    const auto arm = [&](std::size_t s) { return (1 / mean_edge) * (frame[face[s]] - origins[c]); };
    volumes[c] += dot(arm(0), cross(arm(1), arm(2)));
  }
  for (double& volume : volumes) volume = volume < 0 ? -1 : 1;
  return volumes;
}

SurfacePlaces::SurfacePlaces(std::span<const Triangle> faces, Field frame)
    : faces_(faces),
      order_(faces.size()),
      next_sides_(next_sides(faces)),
      faces_at_(lists_by_key(frame.size(), [&](const auto& visit) {
        for (std::size_t f = 0; f < faces.size(); ++f) {
          for (const Index v : faces[f]) visit(v, static_cast<Index>(f));
        }
      })) {
  std::vector<Eigen::Vector3d> centres;
  for (const auto& [a, b, c] : faces) centres.push_back(to_eigen(frame[a] + frame[b] + frame[c]));
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.assign(1, {{}, 0, static_cast<std::uint32_t>(faces.size())});
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const auto [first, count] = std::pair(nodes_[i].first, nodes_[i].count);
    if (count <= leaf_size) continue;
    const auto begin = order_.begin() + first;
    Eigen::AlignedBox3d box;
    for (auto f = begin; f != begin + count; ++f) box.extend(centres[*f]);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::uint32_t half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(centres[a][axis], a) < std::pair(centres[b][axis], b);
    });
    nodes_[i].first = static_cast<std::uint32_t>(nodes_.size());
    nodes_[i].count = 0;
    nodes_.push_back({{}, first, half});
    nodes_.push_back({{}, first + half, count - half});
  }
}

Place SurfacePlaces::walk(Field x, const Vector3& point, std::uint32_t from) const {
  Place here = place_on(x, from, point);
  while (true) {
    const auto n_zero = (here.shares[0] == 0) + (here.shares[1] == 0) + (here.shares[2] == 0);
    if (n_zero == 0) return here;
    Place best = here;
    const auto try_face = [&](std::uint32_t face) {
      const Place place = place_on(x, face, point);
      if (place.squared < best.squared) best = place;
    };
    if (n_zero == 1) {
      const std::uint32_t side = here.shares[0] == 0 ? 0 : here.shares[1] == 0 ? 1 : 2;
      try_face(next_sides_[3 * here.face + side] / 3);
    } else {
      for (const Index face : faces_at_[here.nearest_corner()]) try_face(face);
    }
    if (!(best.squared < here.squared)) return here;
    here = best;
  }
}

void SurfacePlaces::update_boxes(Field x) {
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    Eigen::AlignedBox3d& box = node->box;
    box.setEmpty();
    if (node->count == 0) box.extend(nodes_[node->first].box).extend(nodes_[node->first + 1].box);
    for (std::uint32_t i = node->first; i < node->first + node->count; ++i) {
      for (const Index v : faces_[order_[i]]) box.extend(to_eigen(x[v]));
    }
  }
}

}  // namespace dynmesh
