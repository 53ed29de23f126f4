#include "stream/disconnected.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "support/geometry.hpp"
#include "support/point_tree.hpp"
#include "support/rigid_motion.hpp"

namespace dynmesh {
namespace {

constexpr Index fewest_anchors = 4;       // in a component whose vertices may be donors
constexpr std::size_t fewest_donors = 4;  // that a component must have to follow them

}  // namespace

/// Two components differ in a bit of their numbers. So the nearest vertex of another component is
/// the nearest one over all bits of those whose component has the other value of the bit, which
/// takes two trees for each bit. In one tree of all vertices, a search from inside a large
/// component would visit all of that component first.
template <class Real>
std::vector<Index> find_donors(std::span<const Vector3<Real>> frame,
                               std::span<const Index> component) {
  constexpr double scale = 0x1p-200;  // with which squares of all accepted coordinates are in range
  std::vector<std::array<double, 3>> positions;
  for (const auto& x : frame) positions.push_back(array_of(scale * in_double(x)));
  std::vector<Index> donors(frame.size(), -1);
  std::vector<double> squared_distances(frame.size(), std::numeric_limits<double>::infinity());
  const auto last = static_cast<std::uint32_t>(component.empty() ? 0 : std::ranges::max(component));
  for (std::uint32_t bit = 0; last >> bit > 0; ++bit) {
    std::array<std::vector<Index>, 2> sides;
    for (std::size_t v = 0; v < frame.size(); ++v) {
      sides[component[v] >> bit & 1].push_back(static_cast<Index>(v));
    }
    for (std::size_t side = 0; side < 2; ++side) {
      std::vector<std::array<double, 3>> points;
      for (const Index v : sides[side]) points.push_back(positions[v]);
      const PointTree<3> tree(std::move(points));
      for (const Index v : sides[1 - side]) {
        tree.search(positions[v], squared_distances[v], [&](std::uint32_t i, double squared) {
          donors[v] = sides[side][i];
          return squared_distances[v] = squared;
        });
      }
    }
  }
  return donors;
}

template <class Real>
Disconnected<Real>::Disconnected(const Topology& topology, DisconnectedRule rule, Frame first_frame)
    : topology_(topology), rule_(rule), components_(topology.report.components) {
  for (std::size_t v = 0; v < first_frame.size(); ++v) {
    components_[topology.component[v]].members.push_back(static_cast<Index>(v));
  }
  if (rule_ == DisconnectedRule::hold) return;
  const std::vector<Index> donor_of = find_donors(first_frame, topology.component);
  for (Component& component : components_) {
    std::vector<Index>& donors = component.donors;
    for (const Index v : component.members) {
      if (donor_of[v] != none) donors.push_back(donor_of[v]);
    }
    std::ranges::sort(donors);
    donors.erase(std::unique(donors.begin(), donors.end()), donors.end());
  }
  chosen_.reserve(first_frame.size());
}

template <class Real>
void Disconnected<Real>::complete(Frame previous, std::span<Vector3<Real>> points,
                                  const Generations& generations) {
  if (generations.disconnected_vertices() == 0) return;

  const auto generation = generations.of_vertices();
  for (Component& component : components_) component.anchors = 0;
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (generation[v] == Generations::anchor) ++components_[topology_.component[v]].anchors;
  }

  const auto fit_to_chosen = [&] { return fit_rigid_motion<Real>(chosen_, previous, points); };
  std::optional<RigidMotion> of_all_anchors;
  const auto motion_of = [&](const Component& component) {
    chosen_.clear();
    for (const Index donor : component.donors) {
      const Component& home = components_[topology_.component[donor]];
      if (home.anchors >= fewest_anchors) chosen_.push_back(donor);
    }
    if (chosen_.size() >= fewest_donors) return fit_to_chosen();
    if (!of_all_anchors) {
      chosen_.clear();
      for (std::size_t v = 0; v < generation.size(); ++v) {
        if (generation[v] == Generations::anchor) chosen_.push_back(static_cast<Index>(v));
      }
      of_all_anchors = fit_to_chosen();
    }
    return *of_all_anchors;
  };
  const bool stays = rule_ == DisconnectedRule::hold || generations.anchors() == 0;
  for (const Component& component : components_) {
    if (component.anchors > 0) continue;
    const RigidMotion motion = stays ? RigidMotion{} : motion_of(component);
    for (const Index v : component.members) {
      points[v] = stays ? previous[v] : motion.apply(previous[v]);
    }
  }
}

template std::vector<Index> find_donors(std::span<const Vector3<float>>, std::span<const Index>);
template std::vector<Index> find_donors(std::span<const Vector3<double>>, std::span<const Index>);
template class Disconnected<float>;
template class Disconnected<double>;

}  // namespace dynmesh
