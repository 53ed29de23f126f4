#include "api/disconnected.hpp"

#include <algorithm>
#include <optional>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "mesh/ties.hpp"

namespace dynmesh {
namespace {

constexpr Index fewest_anchors = 4;       // in a component whose vertices may be donors
constexpr std::size_t fewest_donors = 4;  // that a component must have to follow them

}  // namespace

Disconnected::Disconnected(const Topology& topology, DisconnectedRule rule, Field first_frame)
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

void Disconnected::complete(Field previous, std::span<Vector3> points,
                            const Generations& generations, std::span<const Quaternion> rotations) {
  if (generations.disconnected_vertices() == 0) return;

  const auto generation = generations.of_vertices();
  for (Component& component : components_) component.anchors = 0;
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (generation[v] == Generations::anchor) ++components_[topology_.component[v]].anchors;
  }

  const auto fit_to_chosen = [&] { return fit_rigid_motion(chosen_, previous, points); };
  std::optional<RigidMotion> of_all_anchors;
  const auto motion_of = [&](std::size_t component) {
    chosen_.clear();
    for (const Index donor : components_[component].donors) {
      const Component& home = components_[topology_.component[donor]];
      if (home.anchors >= (rotations.empty() ? fewest_anchors : 1)) chosen_.push_back(donor);
    }
    if (chosen_.size() >= fewest_donors) return fit_to_chosen();
    if (!chosen_.empty() && !rotations.empty()) {
      RigidMotion motion = fit_to_chosen();
      const auto& [w, x, y, z] = rotations[component];
      motion.rotation = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
      return motion;
    }
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
  for (std::size_t i = 0; i < components_.size(); ++i) {
    if (components_[i].anchors > 0) continue;
    const RigidMotion motion = stays ? RigidMotion{} : motion_of(i);
    for (const Index v : components_[i].members) {
      points[v] = stays ? previous[v] : motion.apply(previous[v]);
    }
  }
}

}  // namespace dynmesh
