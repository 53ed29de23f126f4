#include "shape/disconnected.hpp"

#include <algorithm>
#include <cmath>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "frame/generations.hpp"
#include "mesh/clusters.hpp"
#include "shape/constants.hpp"
#include "shape/rotations.hpp"

namespace dynmesh {
namespace {

/// If the vertices that lead a component are nearer to a line than this share of its distance from
/// them, how they turn would move it much farther than themselves.
constexpr double least_lever = 0.25;

}  // namespace

Disconnected::Disconnected(const Topology& topology, DisconnectedRule rule, Leaders& leaders,
                           Index fewest_anchors)
    : rule_(rule),
      leaders_(leaders),
      fewest_anchors_(fewest_anchors),
      members_(find_components(topology.cells)),
      seen_(Seen(members_.size()), 1) {
  seen_.lend().anchors.reserve(topology.cells.size());
}

auto Disconnected::seen_in(const Generations& generations) -> Lent<Seen> {
  const auto generation = generations.of_vertices();
  Lent<Seen> seen = seen_.lend();
  seen.anchors.clear();
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const auto is_anchor = [&](Index v) { return generation[v] == Generations::anchor; };
    const auto number = std::ranges::count_if(members_[i], is_anchor);
    seen.has_anchors[i] = number > 0 ? 1 : 0;
    seen.may_lead[i] = number >= fewest_anchors_ ? 1 : 0;
  }
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (generation[v] == Generations::anchor) seen.anchors.push_back(static_cast<Index>(v));
  }
  return seen;
}

void Disconnected::complete(const Memory& memory, Memory& next,
                            std::span<const Quaternion> rotations) {
  if (next.generations.disconnected_vertices() == 0) return;
  Lent<Seen> seen = seen_in(next.generations);
  auto& is_complete = seen.has_anchors;
  const auto move = [&](std::size_t component, const RigidMotion& motion) {
    for (const Index v : members_[component]) next.last[v] = motion.apply(memory.last[v]);
    is_complete[component] = 1;
  };
  const bool stays = rule_ == DisconnectedRule::hold || seen.anchors.empty();
  if (!stays) {
    Lent<Leaders::Leads> leads = leaders_.find(seen.may_lead, memory.departures, memory.last);
    for (const Leaders::Lead& lead : leads.leads) {
      if (is_complete[at(lead.follower)] != 0) continue;
      leaders_.agree(lead, next.last, leads);
      move(at(lead.follower), motion_of(lead, leads, memory.last, next.last, rotations));
    }
  }
  if (std::ranges::all_of(is_complete, [](auto is) { return is != 0; })) return;
  const RigidMotion of_all =
      stays ? RigidMotion{} : fit_rigid_motion(seen.anchors, memory.last, next.last);
  for (std::size_t i = 0; i < members_.size(); ++i) {
    if (is_complete[i] != 0) continue;
    if (stays) {
      for (const Index v : members_[i]) next.last[v] = memory.last[v];
    } else {
      move(i, of_all);
    }
  }
}

RigidMotion Disconnected::motion_of(const Leaders::Lead& lead, const Leaders::Leads& leads,
                                    Field previous, Field points,
                                    std::span<const Quaternion> rotations) const {
  Moments moments;
  leaders_.for_each_place_around(lead, leads, [&](Index v, double weight) {
    moments.add({weight, to_eigen(previous[v]), to_eigen(points[v]), {}});
  });
  RigidMotion motion = fit_rigid_motion(moments);
  const double least = increment_constants.least_across * leaders_.mean_edge();
  const double square = motion.squared_across / moments.number;
  if (rotations.empty()) {
    if (!(square > least * least)) motion.rotation.setIdentity();
    return motion;
  }
  const auto members = members_[at(lead.follower)];
  double reach = 0;
  for (const Index v : members) {
    reach +=
        (to_eigen(previous[v]) - motion.from).squaredNorm() / static_cast<double>(members.size());
  }
  if (square > std::max(least * least, std::pow(least_lever, 2) * reach)) return motion;
  motion.rotation = rotation_matrix(rotations[at(lead.follower)]);
  return motion;
}

void Disconnected::remember(const Memory& memory, Memory& next) {
  if (memory.departures.empty()) return;
  leaders_.learn(next.last, seen_in(next.generations).has_anchors, memory.departures,
                 next.departures);
}

}  // namespace dynmesh
