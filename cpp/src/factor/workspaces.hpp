/// Arrays that the threads of a factorisation need for themselves.
#pragma once

#include <atomic>
#include <cstddef>
#include <dynmesh/types.hpp>
#include <memory>
#include <vector>

#include "kernels/dense_kernels.hpp"

namespace dynmesh {

/// The number of rows of a product of panels that are computed at once, so that they stay in the
/// first-level cache.
constexpr Index rows_of_product = 128;

struct Workspace {
  explicit Workspace(std::size_t n) : local(n) {}

  std::vector<Index> local;  // (n,) the row of the current panel for each row of the submatrix
  std::vector<double> products = std::vector<double>(rows_of_product * widest_supernode);
  std::vector<double> packed = std::vector<double>(most_work);
};

/// One workspace for each thread. Which of them a thread gets has no effect on its results.
class Workspaces {
 public:
  Workspaces(Index threads, std::size_t n)
      : workspaces_(static_cast<std::size_t>(threads), Workspace(n)),
        is_lent_(std::make_unique<std::atomic<bool>[]>(workspaces_.size())) {}

  /// Calls `work` with a workspace that no other thread uses meanwhile. At most as many threads may
  /// do so at a time as there are workspaces.
  template <class Work>
  void lend(const Work& work) {
    std::size_t i = 0;
    while (is_lent_[i].exchange(true, std::memory_order_acquire)) i = (i + 1) % workspaces_.size();
    work(workspaces_[i]);
    is_lent_[i].store(false, std::memory_order_release);
  }

 private:
  std::vector<Workspace> workspaces_;
  std::unique_ptr<std::atomic<bool>[]> is_lent_;
};

}  // namespace dynmesh
