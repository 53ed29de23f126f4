#include "factor/subtrees.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "support/indices.hpp"

namespace dynmesh {
namespace {

/// A subtree has at most this share of the work. With smaller ones, threads wait less for the last
/// of them, but more work is left above them.
constexpr double largest_share = 1.0 / 10;

}  // namespace

Subtrees::Subtrees(const Elimination& plan)
    : parents_(plan.parents), firsts_(plan.parents.size()), groups_(1, 0) {
  std::vector<Index> sizes(parents_.size(), 1);
  std::iota(firsts_.begin(), firsts_.end(), Index{0});
  for (Index s = 0; s < static_cast<Index>(parents_.size()); ++s) {
    const Index up = parents_[at(s)];
    if (up == none) continue;
    sizes[at(up)] += sizes[at(s)];
    firsts_[at(up)] = std::min(firsts_[at(up)], firsts_[at(s)]);
  }
  for (Index s = 0; s < static_cast<Index>(parents_.size()); ++s) {
    if (sizes[at(s)] != s - firsts_[at(s)] + 1) firsts_[at(s)] = none;
  }
  subtrees_.reserve(parents_.size());
  groups_.reserve(parents_.size() + 1);
}

void Subtrees::clear() {
  subtrees_.clear();
  groups_.resize(1);
}

void Subtrees::divide(std::span<double> work) {
  clear();
  const double largest = largest_share * std::accumulate(work.begin(), work.end(), 0.0);
  const auto n = static_cast<Index>(parents_.size());
  for (Index s = 0; s < n; ++s) {
    if (parents_[at(s)] != none) work[at(parents_[at(s)])] += work[at(s)];
  }
  double in_group = 0;
  const auto is_small = [&](Index s) { return firsts_[at(s)] != none && work[at(s)] <= largest; };
  for (Index s = n; s-- > 0;) {
    if (!is_small(s)) continue;
    subtrees_.push_back({firsts_[at(s)], s});
    s = firsts_[at(s)];
  }
  std::ranges::reverse(subtrees_);
  for (Index i = 0; i < static_cast<Index>(subtrees_.size()); ++i) {
    const double mine = work[at(subtrees_[at(i)].root)];
    if (i > 0 && in_group + mine > largest) {
      groups_.push_back(i);
      in_group = 0;
    }
    in_group += mine;
  }
  if (!subtrees_.empty()) groups_.push_back(static_cast<Index>(subtrees_.size()));
}

}  // namespace dynmesh
