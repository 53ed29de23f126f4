#include "mesh/decimation.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "mesh/clusters.hpp"

namespace dynmesh {
namespace {

/// How much the square of a length counts beside that of a distance from the surface: on a body
/// that bends, edges of equal lengths matter more than few triangles where it is flat.
constexpr double length_weight = 0.1;
/// The least cosine between the normals of a triangle before and after one of its corners moves.
constexpr double least_cosine = 0.5;
/// Costs are rounded, so that equal ones are equal wherever the mesh is.
constexpr double cost_steps = 1 << 20;

class Decimation {
 public:
  Decimation(std::span<const Triangle> faces, const Topology& topology, Field frame)
      : topology_(topology),
        faces_(faces.begin(), faces.end()),
        faces_at_(frame.size()),
        quadrics_(frame.size(), Eigen::Matrix4d::Zero()),
        areas_(frame.size()),
        is_fixed_(frame.size()),
        changes_(frame.size()),
        n_in_component_(topology.report.components),
        rank_(frame.size()) {
    const double scale = 1 / mean_edge_length(topology.cells, frame);
    for (const Vector3& x : frame) x_.push_back(scale * to_eigen(x - frame[0]));
    for (const Index c : topology.component) ++n_in_component_[at(c)];
    const std::vector<Index> order = in_order(topology.cells, frame);
    for (std::size_t r = 0; r < order.size(); ++r) rank_[at(order[r])] = r;
    for (Index f = 0; f < std::ssize(faces_); ++f) {
      const auto& [a, b, c] = faces_[at(f)];
      if (a == b || b == c || c == a) {
        for (const Index v : faces_[at(f)]) is_fixed_[at(v)] = 1;
        continue;
      }
      for (const Index v : faces_[at(f)]) faces_at_[at(v)].push_back(f);
    }
    for (const Triangle& face : faces_) add_planes(face);
  }

  DecimatedMesh run(const DecimationLimits& limits) {
    const auto group_of = [&](Index component) {
      return limits.group_of.empty() ? 0U : limits.group_of[at(component)];
    };
    std::vector<std::size_t> n_in_group(limits.most.size());
    for (const Index component : topology_.component) ++n_in_group[group_of(component)];
    for (Index v = 0; v < std::ssize(x_); ++v) offer(v);
    while (!offers_.empty()) {
      const auto [cost, rank, from, to, changes] = offers_.top();
      offers_.pop();
      if (changes != changes_[at(from)]) continue;
      const Index component = topology_.component[at(from)];
      std::size_t& left = n_in_component_[at(component)];
      std::size_t& left_in_group = n_in_group[group_of(component)];
      if (left <= limits.fewest || left_in_group <= limits.most[group_of(component)]) continue;
      if (!is_possible(from, to)) {  // what is two edges away has changed
        offer(from);
        continue;
      }
      collapse(from, to);
      --left;
      --left_in_group;
    }
    return result();
  }

 private:
  struct Offer {
    double cost;
    std::size_t rank;
    Index from, to;
    int changes;
    bool operator<(const Offer& other) const {
      return std::tie(cost, rank) > std::tie(other.cost, other.rank);
    }
  };

  [[nodiscard]] bool has_corner(Index f, Index v) const {
    return std::ranges::find(faces_[at(f)], v) != faces_[at(f)].end();
  }
  /// The number of faces with a side: those at one end that have the other one.
  [[nodiscard]] std::ptrdiff_t n_faces(Index v, Index other) const {
    return std::ranges::count_if(faces_at_[at(v)], [&](Index f) { return has_corner(f, other); });
  }
  [[nodiscard]] std::vector<Index> neighbours(Index v) const {
    std::vector<Index> around;
    for (const Index f : faces_at_[at(v)]) {
      for (const Index other : faces_[at(f)]) {
        if (other != v) around.push_back(other);
      }
    }
    std::ranges::sort(around);
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return around;
  }
  [[nodiscard]] Eigen::Vector3d twice_area(const Triangle& face) const {
    const auto& [a, b, c] = face;
    return (x_[at(b)] - x_[at(a)]).cross(x_[at(c)] - x_[at(a)]);
  }

  void add_plane(Index v, const Eigen::Vector3d& normal, double weight) {
    Eigen::Vector4d plane;
    plane << normal, -normal.dot(x_[at(v)]);
    quadrics_[at(v)] += weight * plane * plane.transpose();
  }

  /// The planes of a triangle, and those across it at a side where the surface ends.
  void add_planes(const Triangle& face) {
    const Eigen::Vector3d area = twice_area(face);
    if (!(area.norm() > 0)) return;
    const Eigen::Vector3d normal = area.normalized();
    for (std::size_t s = 0; s < 3; ++s) {
      const Index a = face[s];
      const Index b = face[(s + 1) % 3];
      add_plane(a, normal, area.norm());
      areas_[at(a)] += area.norm();
      const auto n = n_faces(a, b);
      if (n > 2) is_fixed_[at(a)] = is_fixed_[at(b)] = 1;
      if (n != 1) continue;
      const Eigen::Vector3d side = x_[at(b)] - x_[at(a)];
      for (const Index end : {a, b}) {
        add_plane(end, side.cross(normal).normalized(), side.squaredNorm());
      }
    }
  }

  /// Whether the surface stays a manifold with the same boundary, and no triangle is turned over.
  [[nodiscard]] bool is_possible(Index from, Index to) const {
    const auto around = neighbours(from);
    const auto beside = neighbours(to);
    std::vector<Index> common;
    std::ranges::set_intersection(around, beside, std::back_inserter(common));
    const auto n = n_faces(from, to);
    if (std::ssize(common) != n) return false;
    const auto is_end = [&](Index other) { return n_faces(from, other) == 1; };
    if (n != 1 && std::ranges::any_of(around, is_end)) return false;
    for (const Index f : faces_at_[at(from)]) {
      if (has_corner(f, to)) continue;
      Triangle face = faces_[at(f)];
      const Eigen::Vector3d before = twice_area(face);
      std::ranges::replace(face, from, to);
      const Eigen::Vector3d after = twice_area(face);
      if (!(before.dot(after) > least_cosine * before.norm() * after.norm())) return false;
    }
    return true;
  }

  /// Offers to move a vertex onto the neighbour for which that costs least.
  void offer(Index v) {
    const int changes = ++changes_[at(v)];
    if (is_fixed_[at(v)] != 0) return;
    Offer best = {0, 0, v, none, changes};
    for (const Index to : neighbours(v)) {
      const Eigen::Vector4d place = x_[at(to)].homogeneous();
      const double distance = place.dot(quadrics_[at(v)] * place);
      const double length = areas_[at(v)] * (x_[at(to)] - x_[at(v)]).squaredNorm();
      const double cost = std::round(cost_steps * (distance + length_weight * length));
      const bool is_better =
          best.to == none || std::pair(cost, rank_[at(to)]) < std::pair(best.cost, best.rank);
      if (is_better && is_possible(v, to)) best = {cost, rank_[at(to)], v, to, changes};
    }
    if (best.to == none) return;
    best.rank = rank_[at(v)];
    offers_.push(best);
  }

  void collapse(Index from, Index to) {
    quadrics_[at(to)] += quadrics_[at(from)];
    areas_[at(to)] += areas_[at(from)];
    ++changes_[at(from)];
    const auto around = neighbours(from);
    for (const Index f : std::exchange(faces_at_[at(from)], {})) {
      Triangle& face = faces_[at(f)];
      const bool ends = has_corner(f, to);
      for (const Index v : face) {
        if (ends && v != from) std::erase(faces_at_[at(v)], f);
      }
      if (!ends) faces_at_[at(to)].push_back(f);
      std::ranges::replace(face, from, ends ? none : to);
    }
    is_fixed_[at(from)] = 2;
    for (const Index v : around) offer(v);
    for (const Index v : neighbours(to)) {
      if (std::ranges::find(around, v) == around.end()) offer(v);
    }
  }

  [[nodiscard]] DecimatedMesh result() const {
    DecimatedMesh mesh;
    std::vector<Index> place(x_.size());
    for (std::size_t v = 0; v < x_.size(); ++v) {
      place[v] = static_cast<Index>(mesh.vertices.size());
      if (is_fixed_[v] != 2) mesh.vertices.push_back(static_cast<Index>(v));
    }
    for (const auto& [a, b, c] : faces_) {
      if (a == none || b == none || c == none) continue;
      mesh.faces.push_back({place[at(a)], place[at(b)], place[at(c)]});
    }
    return mesh;
  }

  const Topology& topology_;
  std::vector<Triangle> faces_;
  std::vector<Eigen::Vector3d> x_;  // in mean edges
  std::vector<std::vector<Index>> faces_at_;
  std::vector<Eigen::Matrix4d> quadrics_;
  std::vector<double> areas_;
  std::vector<std::uint8_t> is_fixed_;  // 2: it is gone
  std::vector<int> changes_;            // offers of a vertex made before the last change are void
  std::vector<std::size_t> n_in_component_;
  std::vector<std::size_t> rank_;
  std::priority_queue<Offer> offers_;
};

}  // namespace

DecimatedMesh decimated(std::span<const Triangle> faces, const Topology& topology, Field frame,
                        const DecimationLimits& limits) {
  return Decimation(faces, topology, frame).run(limits);
}

}  // namespace dynmesh
