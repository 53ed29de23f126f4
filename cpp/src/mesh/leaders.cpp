#include "mesh/leaders.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <utility>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"
#include "base/rigid_motion.hpp"
#include "mesh/clusters.hpp"
#include "mesh/ties.hpp"

namespace dynmesh {
namespace {

/// Each component is compared with so many others at most, fewer if there are many components, from
/// so many of its vertices at most.
constexpr std::size_t most_others = 32;
constexpr std::size_t most_pairs = 32'768;
constexpr std::size_t n_samples = 32;
/// Distances are measured between so many vertices of each component of a pair, in places that are
/// nearest to the other component or farther by at most this, in mean edges.
constexpr std::size_t n_measured = 4;
constexpr double measured_within = 1.5;

constexpr double sigma = 0.5;
constexpr double kept_departure = 0.9;  // of s^2, from frame to frame
constexpr double largest_departure = 1e60;
/// What counts of the share of the leader that touches the follower.
constexpr double share_of_leader = 0.1;
/// The trust in a way through a component that does not lead itself.
constexpr double trust_through = 0.1;
/// What has a smaller share of the greatest trust does not lead a component along with others. It
/// is more than what a way through a component that is hardly more trusted can have.
constexpr double least_share = 0.15;
constexpr int agreements = 5;
/// Frames are scaled so that their coordinates are at most this, and their squares in range.
constexpr double largest_scaled = 1e150;
/// Trusts that differ by less are equal.
constexpr double rounding = 1e-9;

}  // namespace

Leaders::Leaders(const Topology& topology, Field first_frame, const TrainingFrames& training)
    : first_frame_(first_frame),
      mean_edge_(mean_edge_length(topology.cells, first_frame)),
      scale_(std::exp2(-std::ilogb(mean_edge_))),
      rank_(topology.report.components, none),
      pairs_of_(rank_.size()),
      leads_({}, 1),
      of_component_(rank_.size()) {
  const std::size_t n = rank_.size();
  if (n < 2) return;
  double largest = 0;
  for (const auto& x : first_frame)
    largest = std::max({largest, std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  while (scale_ * largest > largest_scaled) scale_ /= 2;
  squared_edge_ = std::pow(scale_ * mean_edge_, 2);
  const std::size_t others =
      std::min(n - 1, std::clamp<std::size_t>(most_pairs / n, 2, most_others));
  find_pairs(topology, others);
  for (Pair& pair : pairs_) choose_measured(pair);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    for (const Index c : pairs_[i].components) pairs_of_[at(c)].push_back(i);
  }
  trained_.resize(n * others);
  for (const auto& frame : training) {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      trained_[i] = std::max(trained_[i], squared_departure(pairs_[i], frame));
    }
  }
  Lent<Leads> leads = leads_.lend();
  leads.leads.reserve(n);
  leads.shares.resize(pairs_.size());
  std::size_t most = 0;
  for (const auto& pairs : pairs_of_) most = std::max(most, pairs.size());
  beside_.reserve(most);
}

/// Compares each component with those that are nearest to some of its vertices, and keeps the pairs
/// of those that it touches most. All orders are those of the positions.
void Leaders::find_pairs(const Topology& topology, std::size_t others) {
  const std::vector<Index> order = in_order(topology.cells, first_frame_);
  std::vector<std::vector<std::uint32_t>> members(rank_.size());
  std::vector<std::array<double, 3>> positions;
  std::vector<Index> by_rank;
  for (const Index v : order) {
    const Index c = topology.component[v];
    if (members[at(c)].empty()) {
      rank_[at(c)] = static_cast<Index>(by_rank.size());
      by_rank.push_back(c);
    }
    members[at(c)].push_back(static_cast<std::uint32_t>(v));
    positions.push_back(array_of(scale_ * first_frame_[v]));
  }
  const PointTree<3> tree(std::move(positions));

  struct Nearest {
    Index component;
    Index vertex;
    double squared;
  };
  struct Other {
    double nearness = 0;
    std::vector<Place> places;
  };
  std::map<std::array<Index, 2>, std::size_t> numbers;
  std::vector<Nearest> nearest;
  for (const Index c : by_rank) {
    std::map<Index, Other> found;  // by rank
    const auto samples = spread(members[at(c)], n_samples, first_frame_);
    for (const std::uint32_t v : samples) {
      nearest.clear();
      double radius = std::numeric_limits<double>::infinity();
      const auto visit = [&](std::uint32_t number, double squared) {
        const Nearest here = {topology.component[order[number]], order[number], squared};
        if (here.component == c) return radius;
        const auto same = std::ranges::find(nearest, here.component, &Nearest::component);
        if (same != nearest.end()) {
          if (squared < same->squared) *same = here;
        } else if (nearest.size() < others) {
          nearest.push_back(here);
        } else {
          *std::ranges::max_element(nearest, {}, &Nearest::squared) = here;
        }
        if (nearest.size() == others) {
          radius = std::ranges::max_element(nearest, {}, &Nearest::squared)->squared;
        }
        return radius;
      };
      tree.search(array_of(scale_ * first_frame_[v]), radius, visit);
      for (const Nearest& of : nearest) {
        Other& other = found[rank_[at(of.component)]];
        const double weight = 1 / (1 + of.squared / squared_edge_);
        other.nearness += weight / static_cast<double>(samples.size());
        other.places.push_back({{static_cast<Index>(v), of.vertex}, weight});
      }
    }
    std::vector<Index> ranks;
    for (const auto& [rank, other] : found) ranks.push_back(rank);
    std::ranges::stable_sort(ranks, std::greater{},
                             [&](Index rank) { return found[rank].nearness; });
    ranks.resize(std::min(ranks.size(), others));
    for (const Index rank : ranks) {
      const bool is_first = rank_[at(c)] < rank;
      const auto key = is_first ? std::array{rank_[at(c)], rank} : std::array{rank, rank_[at(c)]};
      const auto [known, is_new] = numbers.try_emplace(key, pairs_.size());
      if (is_new) pairs_.emplace_back().components = {by_rank[at(key[0])], by_rank[at(key[1])]};
      Pair& pair = pairs_[known->second];
      pair.nearness[is_first ? 0 : 1] = found[rank].nearness;
      for (Place& place : found[rank].places) {
        if (!is_first) std::swap(place.vertices[0], place.vertices[1]);
        pair.places.push_back(place);
      }
    }
  }
}

void Leaders::choose_measured(Pair& pair) const {
  std::vector<Place> near = pair.places;
  std::ranges::stable_sort(near, std::greater{}, &Place::weight);
  const auto distance = [](const Place& place) { return std::sqrt(1 / place.weight - 1); };
  const auto beyond =
      std::ranges::upper_bound(near, distance(near[0]) + measured_within, {}, distance);
  const auto n = static_cast<std::size_t>(beyond - near.begin());
  near.resize(std::min(near.size(), std::max(n, n_measured)));
  for (std::size_t side = 0; side < 2; ++side) {
    std::vector<std::uint32_t> vertices;
    for (const Place& place : near) {
      const auto v = static_cast<std::uint32_t>(place.vertices[side]);
      if (std::ranges::find(vertices, v) == vertices.end()) vertices.push_back(v);
    }
    for (const std::uint32_t v : spread(vertices, n_measured, first_frame_)) {
      pair.measured[side].push_back(static_cast<Index>(v));
    }
  }
}

/// r^2 of a frame.
double Leaders::squared_departure(const Pair& pair, Field x) const {
  double sum = 0;
  for (const Index v : pair.measured[0]) {
    for (const Index w : pair.measured[1]) {
      const auto length = [&](Field frame) {
        return std::sqrt(squared_norm(scale_ * (frame[v] - frame[w])));
      };
      const double change = length(x) - length(first_frame_);
      sum += change * change;
    }
  }
  const auto n = static_cast<double>(pair.measured[0].size() * pair.measured[1].size());
  const double mean = sum / n / squared_edge_;
  return mean < largest_departure ? mean : largest_departure;  // also if it is not a number
}

void Leaders::learn(Field x, std::span<const std::uint8_t> is_seen,
                    std::span<const double> departures, std::span<double> next) const {
  std::ranges::copy(departures, next.begin());
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const auto& [a, b] = pairs_[i].components;
    if (is_seen[at(a)] == 0 || is_seen[at(b)] == 0) continue;
    next[i] = std::max(kept_departure * departures[i], squared_departure(pairs_[i], x));
  }
}

/// The lead of one component of a pair by the other.
Leaders::Lead Leaders::lead_of(Index follower, std::size_t number, double departure) const {
  const Pair& pair = pairs_[number];
  const std::size_t side = pair.side_of(follower);
  const double far = 1 + departure / (sigma * sigma);
  const double near = pair.nearness[side] + share_of_leader * pair.nearness[1 - side];
  return {follower, pair.components[1 - side], number, near / (far * far)};
}

/// The lead of one component of a pair by the other, which may not lead through what leads it.
Leaders::Lead Leaders::trust_of(Index follower, std::size_t number,
                                std::span<const std::uint8_t> may_lead, double departure) const {
  Lead lead = lead_of(follower, number, departure);
  if (may_lead[at(lead.leader)] == 0) {
    lead.trust *= trust_through * of_component_[at(lead.leader)].trust;
  }
  return lead;
}

bool Leaders::is_better(const Lead& lead, const Lead& than) const {
  if (!(lead.trust > 0)) return false;
  if (std::abs(lead.trust - than.trust) > rounding * lead.trust) return lead.trust > than.trust;
  return rank_[at(lead.leader)] < rank_[at(than.leader)];
}

Leaders::Lead Leaders::best(Index component, std::span<const std::uint8_t> may_lead,
                            std::span<const double> departures) const {
  Lead found;
  for (const std::size_t pair : pairs_of_[at(component)]) {
    const Lead lead = lead_of(component, pair, departures[pair]);
    if (may_lead[at(lead.leader)] != 0 && is_better(lead, found)) found = lead;
  }
  return found;
}

auto Leaders::find(std::span<const std::uint8_t> may_lead, std::span<const double> departures,
                   Field x) -> Lent<Leads> {
  std::ranges::fill(of_component_, Lead{});
  bool is_changed = true;
  for (std::size_t n = 0; n < of_component_.size() && is_changed; ++n) {
    is_changed = false;
    for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
      for (const Index follower : pairs_[pair].components) {
        if (may_lead[at(follower)] != 0) continue;
        const Lead lead = trust_of(follower, pair, may_lead, departures[pair]);
        if (!is_better(lead, of_component_[at(follower)])) continue;
        of_component_[at(follower)] = lead;
        is_changed = true;
      }
    }
  }
  Lent<Leads> found = leads_.lend();
  found.leads.clear();
  for (const Lead& lead : of_component_) {
    if (lead.trust > 0) found.leads.push_back(lead);
  }
  std::ranges::sort(found.leads, std::greater{}, &Lead::trust);
  for (const Lead& lead : found.leads) {
    share_out(lead, may_lead, departures, found);
    agree(lead, x, found);
  }
  return found;
}

/// Gives shares to what leads a component, by the trust in it.
void Leaders::share_out(const Lead& lead, std::span<const std::uint8_t> may_lead,
                        std::span<const double> departures, Leads& leads) const {
  for (const std::size_t number : pairs_of_[at(lead.follower)]) {
    const Lead other = trust_of(lead.follower, number, may_lead, departures[number]);
    // What is less trusted is not complete when the follower is moved.
    const bool is_complete =
        may_lead[at(other.leader)] != 0 || of_component_[at(other.leader)].trust > lead.trust;
    leads.shares[number][pairs_[number].side_of(lead.follower)] =
        is_complete ? other.trust / lead.trust : 0;
  }
}

void Leaders::agree(const Lead& lead, Field x, Leads& leads) {
  beside_.clear();
  for (const std::size_t number : pairs_of_[at(lead.follower)]) {
    const std::size_t side = pairs_[number].side_of(lead.follower);
    double& share = leads.shares[number][side];
    if (share < least_share) {
      share = 0;
    } else {
      beside_.push_back({&share, share, pairs_[number].measured[1 - side]});
    }
  }
  for (int n = 0; beside_.size() > 1 && n < agreements; ++n) {
    Moments moments;
    for (const Beside& one : beside_) {
      const double weight = *one.share / static_cast<double>(one.vertices.size());
      for (const Index v : one.vertices) {
        moments.add({weight, to_eigen(scale_ * first_frame_[v]), to_eigen(scale_ * x[v]), {}});
      }
    }
    const RigidMotion motion = fit_rigid_motion(moments);
    double least = std::numeric_limits<double>::infinity();
    for (Beside& one : beside_) {
      one.square = 0;
      for (const Index v : one.vertices) {
        const Vector3 off = motion.apply(scale_ * first_frame_[v]) - scale_ * x[v];
        one.square += squared_norm(off) / static_cast<double>(one.vertices.size());
      }
      least = std::min(least, one.square);
    }
    for (const Beside& one : beside_) {
      const double far = 1 + one.square / (sigma * sigma * squared_edge_ + least);
      *one.share = std::isfinite(far) ? one.trust / (far * far) : 0;
    }
    double largest = 0;
    for (const Beside& one : beside_) largest = std::max(largest, *one.share);
    if (!(largest > 0)) {
      for (const Beside& one : beside_) *one.share = one.trust;
      return;
    }
    for (const Beside& one : beside_) *one.share /= largest;
  }
}

}  // namespace dynmesh
