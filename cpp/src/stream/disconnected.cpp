#include "stream/disconnected.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "support/rigid_motion.hpp"

namespace dynmesh {
namespace {

constexpr Index fewest_anchors = 4;       // in a component whose vertices may be donors
constexpr std::size_t fewest_donors = 4;  // that a component must have to follow them

}  // namespace

template <class Real>
Disconnected<Real>::Disconnected(const Topology& topology, DisconnectedRule rule, Frame first_frame)
    : topology_(topology),
      rule_(rule),
      member_ends_(topology.report.components + 1, 0),
      anchors_in_(topology.report.components) {
  const auto& component = topology.component;
  members_.resize(component.size());
  std::iota(members_.begin(), members_.end(), 0);
  const auto component_of = [&](Index v) { return component[v]; };
  std::ranges::stable_sort(members_, {}, component_of);
  for (const Index label : component) ++member_ends_[label + 1];
  std::partial_sum(member_ends_.begin(), member_ends_.end(), member_ends_.begin());
  if (rule_ == DisconnectedRule::hold) return;
  donor_ends_.push_back(0);
  const std::vector<Index> donor_of = find_donors(first_frame, component);
  for (std::size_t c = 0; c < topology.report.components; ++c) {
    const auto first = static_cast<std::ptrdiff_t>(donors_.size());
    for (std::size_t m = member_ends_[c]; m < member_ends_[c + 1]; ++m) {
      const Index donor = donor_of[members_[m]];
      if (donor >= 0) donors_.push_back(donor);
    }
    std::sort(donors_.begin() + first, donors_.end());
    donors_.erase(std::unique(donors_.begin() + first, donors_.end()), donors_.end());
    donor_ends_.push_back(donors_.size());
  }
  chosen_.reserve(first_frame.size());
}

template <class Real>
std::span<const Index> Disconnected<Real>::usable_donors(std::size_t component) {
  chosen_.clear();
  for (std::size_t i = donor_ends_[component]; i < donor_ends_[component + 1]; ++i) {
    const auto home = static_cast<std::size_t>(topology_.component[donors_[i]]);
    if (anchors_in_[home] >= fewest_anchors) chosen_.push_back(donors_[i]);
  }
  return chosen_;
}

template <class Real>
void Disconnected<Real>::complete(Frame previous, std::span<Vector3<Real>> points,
                                  const Generations& generations) {
  if (generations.disconnected_vertices() == 0) return;

  const auto generation = generations.of_vertices();
  std::ranges::fill(anchors_in_, 0);
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (generation[v] == Generations::anchor) {
      ++anchors_in_[topology_.component[v]];
    }
  }

  const auto fit = [&](std::span<const Index> vertices) {
    return fit_rigid_motion<Real>(vertices, previous, points);
  };
  const auto fit_to_all_anchors = [&] {
    chosen_.clear();
    for (std::size_t v = 0; v < generation.size(); ++v) {
      if (generation[v] == Generations::anchor) chosen_.push_back(static_cast<Index>(v));
    }
    return fit(chosen_);
  };
  std::optional<RigidMotion> of_all_anchors;
  const bool stays = rule_ == DisconnectedRule::hold || generations.anchors() == 0;
  for (std::size_t c = 0; c < anchors_in_.size(); ++c) {
    if (anchors_in_[c] > 0) continue;
    RigidMotion motion;
    if (!stays) {
      const auto donors = usable_donors(c);
      if (donors.size() >= fewest_donors) {
        motion = fit(donors);
      } else {
        if (!of_all_anchors) of_all_anchors = fit_to_all_anchors();
        motion = *of_all_anchors;
      }
    }
    for (std::size_t m = member_ends_[c]; m < member_ends_[c + 1]; ++m) {
      const auto v = static_cast<std::size_t>(members_[m]);
      points[v] = stays ? previous[v] : motion.apply(previous[v]);
    }
  }
}

template class Disconnected<float>;
template class Disconnected<double>;

}  // namespace dynmesh
