#include "surface_fit/learned_ties.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace dynmesh {

LearnedTies::LearnedTies(const Topology& topology, Field first_frame, Field normals,
                         double mean_edge, const TrackingConstants& constants)
    : constants_(constants),
      mean_edge_(mean_edge),
      ties_(find_ties(topology, first_frame, mean_edge, constants.tie_weight)),
      most_pairs_(most_tied_pairs(topology.report.components)) {
  std::map<std::pair<Index, Index>, std::uint32_t> numbers;
  for (const Tie& tie : ties_) {
    const auto pair = std::minmax(topology.component[tie.i], topology.component[tie.j]);
    const auto next = static_cast<std::uint32_t>(numbers.size());
    pair_of_.push_back(numbers.try_emplace(pair, next).first->second);
  }
  n_pairs_ = numbers.size();
  const auto walls =
      find_walls(topology, first_frame, normals, mean_edge, constants.wall, constants.tie_weight);
  ties_.insert(ties_.end(), walls.begin(), walls.end());
}

std::vector<double> LearnedTies::departed(Field x, Field differences,
                                          std::span<const double> departures) const {
  std::vector<double> sums(most_pairs_), counts(n_pairs_);
  for (std::size_t t = 0; t < pair_of_.size(); ++t) {
    const auto difference = x[ties_[t].i] - x[ties_[t].j];
    sums[pair_of_[t]] += squared_norm(differences[t] - difference);
    counts[pair_of_[t]] += 1;
  }
  for (std::size_t pair = 0; pair < n_pairs_; ++pair) {
    sums[pair] = std::max(constants_.kept_departure * departures[pair],
                          sums[pair] / (counts[pair] * mean_edge_ * mean_edge_));
  }
  return sums;
}

std::vector<double> LearnedTies::departed(Field x, std::span<const Quaternion> q,
                                          std::span<const double> departures) const {
  std::vector<Vector3> differences;
  for (const Tie& tie : between()) differences.push_back(kept(tie, q));
  return departed(x, differences, departures);
}

WeightedTies LearnedTies::weighted(std::span<const double> departures) const {
  WeightedTies ties{ties_, {}};
  for (std::size_t t = 0; t < pair_of_.size(); ++t) {
    const double sigma = constants_.tie_departure;
    const double far = 1 + departures[pair_of_[t]] / (sigma * sigma);
    ties.all[t].weight = ties_[t].weight / (far * far);
    ties.hold.push_back(4 * ties.all[t].weight >= ties_[t].weight ? 1 : 0);
  }
  return ties;
}

}  // namespace dynmesh
