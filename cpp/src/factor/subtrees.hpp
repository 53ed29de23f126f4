/// Divides a factorisation into parts that several threads can compute at the same time.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "factor/elimination.hpp"

namespace dynmesh {

/// Supernodes `first` to `root`: all below `root` in the elimination forest, which affect no others
/// but those above it.
struct Subtree {
  Index first;
  Index root;
};

/// Disjoint subtrees of about equal work. All other supernodes are above them, and come after them.
/// The division depends on the matrix and the mask only, so that the results do not depend on the
/// number of threads.
class Subtrees {
 public:
  explicit Subtrees(const Elimination& plan);

  /// Takes the largest subtrees whose work is a small share of all. `work` is that of each
  /// supernode, and is replaced by that of its subtree. Allocates no memory.
  void divide(std::span<double> work);
  /// No subtrees at all.
  void clear();

  /// In ascending order.
  [[nodiscard]] std::span<const Subtree> all() const { return subtrees_; }

  /// The subtrees are divided into groups of about equal work: group i is from groups()[i] to
  /// groups()[i + 1] - 1.
  [[nodiscard]] Index n_groups() const { return static_cast<Index>(groups_.size()) - 1; }
  [[nodiscard]] std::span<const Index> groups() const { return groups_; }

 private:
  std::span<const Index> parents_;
  std::vector<Index> firsts_;  // the first supernode below each one, or -1 if they are not adjacent
  std::vector<Subtree> subtrees_;
  std::vector<Index> groups_;
};

}  // namespace dynmesh
