#include "shape/disconnected.hpp"

#include <algorithm>
#include <cmath>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "frame/generations.hpp"
#include "shape/constants.hpp"

namespace dynmesh {
namespace {

/// If the vertices that lead a component are nearer to a line than this share of its distance from
/// them, how they turn would move it much farther than themselves.
constexpr double least_lever = 0.25;

}  // namespace

Disconnected::Disconnected(const Topology& topology, DisconnectedRule rule, Leaders& leaders,
                           Index fewest_anchors)
    : topology_(topology),
      rule_(rule),
      leaders_(leaders),
      fewest_anchors_(fewest_anchors),
      members_(topology.report.components),
      anchors_(members_.size()),
      is_complete_(members_.size()),
      may_lead_(members_.size()) {
  for (std::size_t v = 0; v < topology.component.size(); ++v) {
    members_[at(topology.component[v])].push_back(static_cast<Index>(v));
  }
  all_anchors_.reserve(topology.component.size());
}

void Disconnected::count_anchors(const Generations& generations) {
  const auto generation = generations.of_vertices();
  std::ranges::fill(anchors_, 0);
  all_anchors_.clear();
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (generation[v] != Generations::anchor) continue;
    ++anchors_[at(topology_.component[v])];
    all_anchors_.push_back(static_cast<Index>(v));
  }
  for (std::size_t i = 0; i < anchors_.size(); ++i) {
    is_complete_[i] = anchors_[i] > 0 ? 1 : 0;
    may_lead_[i] = anchors_[i] >= fewest_anchors_ ? 1 : 0;
  }
}

void Disconnected::complete(const Memory& memory, Memory& next,
                            std::span<const Quaternion> rotations) {
  if (next.generations.disconnected_vertices() == 0) return;
  count_anchors(next.generations);
  const auto move = [&](std::size_t component, const RigidMotion& motion) {
    for (const Index v : members_[component]) next.last[v] = motion.apply(memory.last[v]);
    is_complete_[component] = 1;
  };
  const bool stays = rule_ == DisconnectedRule::hold || all_anchors_.empty();
  if (!stays) {
    for (const Leaders::Lead& lead : leaders_.find(may_lead_, memory.departures, memory.last)) {
      if (is_complete_[at(lead.follower)] != 0) continue;
      leaders_.agree(lead, next.last);
      move(at(lead.follower), motion_of(lead, memory.last, next.last, rotations));
    }
  }
  if (std::ranges::all_of(is_complete_, [](auto is) { return is != 0; })) return;
  const RigidMotion of_all =
      stays ? RigidMotion{} : fit_rigid_motion(all_anchors_, memory.last, next.last);
  for (std::size_t i = 0; i < members_.size(); ++i) {
    if (is_complete_[i] != 0) continue;
    if (stays) {
      for (const Index v : members_[i]) next.last[v] = memory.last[v];
    } else {
      move(i, of_all);
    }
  }
}

RigidMotion Disconnected::motion_of(const Leaders::Lead& lead, Field previous, Field points,
                                    std::span<const Quaternion> rotations) const {
  Moments moments;
  leaders_.for_each_place_around(lead, [&](Index v, double weight) {
    moments.add({weight, to_eigen(previous[v]), to_eigen(points[v]), {}});
  });
  RigidMotion motion = fit_rigid_motion(moments);
  const double least = increment_constants.least_across * leaders_.mean_edge();
  const double square = motion.squared_across / moments.number;
  if (rotations.empty()) {
    if (!(square > least * least)) motion.rotation.setIdentity();
    return motion;
  }
  const auto& members = members_[at(lead.follower)];
  double reach = 0;
  for (const Index v : members) {
    reach +=
        (to_eigen(previous[v]) - motion.from).squaredNorm() / static_cast<double>(members.size());
  }
  if (square > std::max(least * least, std::pow(least_lever, 2) * reach)) return motion;
  const auto& [w, x, y, z] = rotations[at(lead.follower)];
  motion.rotation = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
  return motion;
}

void Disconnected::remember(const Memory& memory, Memory& next) {
  if (memory.departures.empty()) return;
  count_anchors(next.generations);
  leaders_.learn(next.last, is_complete_, memory.departures, next.departures);
}

}  // namespace dynmesh
