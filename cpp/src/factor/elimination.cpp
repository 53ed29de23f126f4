#include "factor/elimination.hpp"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <numeric>

#include "kernels/kernels.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// A subtree has at most this share of the work. With smaller ones, threads wait less for the last
/// of them, but more work is left above them.
constexpr double largest_share = 1.0 / 10;

std::vector<Index> inverse(const std::vector<Index>& order) {
  std::vector<Index> positions(order.size());
  for (std::size_t p = 0; p < order.size(); ++p) {
    positions[order[p]] = static_cast<Index>(p);
  }
  return positions;
}

/// Calls `visit(other)` for the positions before `position` at which its column has entries.
template <class Visit>
void for_each_before(const SparseMatrix& matrix, const Elimination& plan, Index position,
                     const Visit& visit) {
  for (SparseMatrix::InnerIterator e(matrix, plan.column_at[position]); e; ++e) {
    const Index other = plan.position_of[e.row()];
    if (other < position) visit(other);
  }
}

/// Returns the elimination tree (Liu 1986): the parent of each position, or none for a root.
std::vector<Index> elimination_tree(const SparseMatrix& matrix, const Elimination& plan) {
  std::vector<Index> parent(matrix.cols(), none);
  std::vector<Index> ancestor(matrix.cols(), none);
  for (Index position = 0; position < matrix.cols(); ++position) {
    for_each_before(matrix, plan, position, [&](Index i) {
      while (i != none && i < position) {
        const Index next = ancestor[i];
        ancestor[i] = position;
        if (next == none) parent[i] = position;
        i = next;
      }
    });
  }
  return parent;
}

/// Returns the positions of a forest in postorder: every subtree is contiguous and precedes its
/// root.
std::vector<Index> postorder(const std::vector<Index>& parent) {
  std::vector<Index> first_child(parent.size(), none);
  std::vector<Index> sibling(parent.size(), none);
  std::vector<Index> stack;
  for (Index i = static_cast<Index>(parent.size()); i-- > 0;) {
    const Index p = parent[i];
    if (p == none) {
      stack.push_back(i);
    } else {
      sibling[i] = first_child[p];
      first_child[p] = i;
    }
  }
  std::vector<Index> order;
  order.reserve(parent.size());
  while (!stack.empty()) {
    const Index i = stack.back();
    const Index child = first_child[i];
    if (child == none) {
      order.push_back(i);
      stack.pop_back();
    } else {
      first_child[i] = sibling[child];
      stack.push_back(child);
    }
  }
  return order;
}

/// Returns the number of entries of each column of the factor, including the diagonal.
std::vector<Index> column_counts(const SparseMatrix& matrix, const Elimination& plan,
                                 const std::vector<Index>& parent) {
  std::vector<Index> counts(matrix.cols(), 1);
  std::vector<Index> visited(matrix.cols(), none);
  for (Index position = 0; position < matrix.cols(); ++position) {
    visited[position] = position;
    for_each_before(matrix, plan, position, [&](Index i) {
      for (; visited[i] != position; i = parent[i]) {
        ++counts[i];
        visited[i] = position;
      }
    });
  }
  return counts;
}

/// Contiguous columns that may become a supernode.
struct Block {
  Index first;
  Index columns;
  Index rows;   // of its first column, including the diagonal
  double held;  // the number of nonzero entries

  [[nodiscard]] double share_of_zeros() const {
    const double entries = columns * (rows - 0.5 * (columns - 1));
    return 1 - held / entries;
  }
};

/// Limits the share of zeros by the width of the block. Narrow blocks are joined more readily,
/// since the mask removes columns from them and very narrow blocks are slow.
bool is_worth_joining(const Block& joined) {
  if (joined.columns <= 6) return true;
  const double zeros = joined.share_of_zeros();
  if (joined.columns <= 16) return zeros < 0.4;
  if (joined.columns <= 32) return zeros < 0.2;
  return zeros < 0.05;
}

/// Finds runs of columns with nearly the same rows. A block may be joined with the previous one if
/// that is a subtree below it, since the rows of a child are among those of its parent.
std::vector<Block> find_blocks(const std::vector<Index>& parent, const std::vector<Index>& counts) {
  std::vector<Block> blocks;
  for (Index j = 0; j < static_cast<Index>(parent.size()); ++j) {
    Block block = {j, 1, counts[j], static_cast<double>(counts[j])};
    while (!blocks.empty()) {
      const Block& below = blocks.back();
      const Index root = parent[block.first - 1];
      if (root == none || root > j) break;
      const Block joined = {below.first, below.columns + block.columns, below.columns + block.rows,
                            below.held + block.held};
      const bool is_chain = below.rows == joined.rows;  // joining adds no zeros
      if (!is_chain && !is_worth_joining(joined)) break;
      block = joined;
      blocks.pop_back();
    }
    blocks.push_back(block);
  }
  return blocks;
}

}  // namespace

std::vector<Index> elimination_order(const SparseMatrix& matrix) {
  SparseMatrix copy;
  copy = matrix;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, Index> order;
  Eigen::AMDOrdering<Index>()(copy, order);
  return {order.indices().data(), order.indices().data() + matrix.cols()};
}

Elimination plan_elimination(const SparseMatrix& matrix) {
  const auto n = static_cast<Index>(matrix.cols());
  Elimination plan;
  plan.column_at = elimination_order(matrix);
  plan.position_of = inverse(plan.column_at);
  const auto order = postorder(elimination_tree(matrix, plan));
  std::vector<Index> column_at(n);
  for (Index p = 0; p < n; ++p) column_at[p] = plan.column_at[order[p]];
  plan.column_at = column_at;
  plan.position_of = inverse(plan.column_at);
  const auto parent = elimination_tree(matrix, plan);

  plan.firsts.clear();
  for (const Block& block : find_blocks(parent, column_counts(matrix, plan, parent))) {
    for (Index c = 0; c < block.columns; c += widest_supernode) {
      plan.firsts.push_back(block.first + c);
    }
  }
  plan.firsts.push_back(n);
  std::vector<Index> supernode_of(n);
  for (Index s = 0; s < plan.supernodes(); ++s) {
    for (Index j = plan.firsts[s]; j < plan.firsts[s + 1]; ++j) supernode_of[j] = s;
  }

  // The rows of a supernode are those of its columns and of its children.
  std::vector<Index> first_child(at(plan.supernodes()), none);
  std::vector<Index> sibling(at(plan.supernodes()), none);
  plan.parents.assign(at(plan.supernodes()), none);
  std::vector<Index> seen(n, none);
  plan.row_offsets.push_back(0);
  for (Index s = 0; s < plan.supernodes(); ++s) {
    const Index last = plan.firsts[s + 1] - 1;
    const auto begin = static_cast<std::ptrdiff_t>(plan.rows.size());
    const auto add = [&](Index row) {
      if (row <= last || seen[row] == s) return;
      seen[row] = s;
      plan.rows.push_back(row);
    };
    for (Index j = plan.firsts[s]; j <= last; ++j) {
      for (SparseMatrix::InnerIterator e(matrix, plan.column_at[j]); e; ++e) {
        add(plan.position_of[e.row()]);
      }
    }
    for (Index child = first_child[s]; child != none; child = sibling[child]) {
      for (Index r = plan.row_offsets[child]; r < plan.row_offsets[child + 1]; ++r) {
        add(plan.rows[r]);
      }
    }
    std::sort(plan.rows.begin() + begin, plan.rows.end());
    plan.row_offsets.push_back(static_cast<Index>(plan.rows.size()));
    if (static_cast<std::ptrdiff_t>(plan.rows.size()) > begin) {
      const Index up = supernode_of[plan.rows[begin]];
      plan.parents[s] = up;
      sibling[s] = first_child[up];
      first_child[up] = s;
    }
  }
  return plan;
}

Subtrees::Subtrees(const Elimination& plan) : parents_(plan.parents), firsts_(plan.parents.size()) {
  std::vector<Index> sizes(parents_.size(), 1);
  std::iota(firsts_.begin(), firsts_.end(), Index{0});
  for (Index s = 0; s < static_cast<Index>(parents_.size()); ++s) {
    const Index up = parents_[s];
    if (up == none) continue;
    sizes[up] += sizes[s];
    firsts_[up] = std::min(firsts_[up], firsts_[s]);
  }
  for (Index s = 0; s < static_cast<Index>(parents_.size()); ++s) {
    if (sizes[s] != s - firsts_[s] + 1) firsts_[s] = none;
  }
  subtrees_.reserve(parents_.size());
}

void Subtrees::clear() { subtrees_.clear(); }

void Subtrees::divide(std::span<double> work) {
  clear();
  const double largest = largest_share * std::accumulate(work.begin(), work.end(), 0.0);
  const auto n = static_cast<Index>(parents_.size());
  for (Index s = 0; s < n; ++s) {
    if (parents_[s] != none) work[parents_[s]] += work[s];
  }
  const auto is_small = [&](Index s) { return firsts_[s] != none && work[s] <= largest; };
  for (Index s = n; s-- > 0;) {
    if (!is_small(s)) continue;
    subtrees_.push_back({firsts_[s], s});
    s = firsts_[s];
  }
  std::ranges::reverse(subtrees_);
}

}  // namespace dynmesh
