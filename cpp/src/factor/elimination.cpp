#include "factor/elimination.hpp"

#include <algorithm>
#include <numeric>

#include "kernels/kernels.hpp"
#include "support/indices.hpp"

namespace dynmesh {
namespace {

std::vector<Index> inverse(const std::vector<Index>& order) {
  std::vector<Index> positions(order.size());
  for (std::size_t p = 0; p < order.size(); ++p) {
    positions[static_cast<std::size_t>(order[p])] = static_cast<Index>(p);
  }
  return positions;
}

/// Calls `visit(other)` for the positions before `position` at which its column has entries.
template <class Visit>
void for_each_before(const SymmetricMatrix& matrix, const Elimination& plan, Index position,
                     const Visit& visit) {
  const auto column = at(plan.column_at[at(position)]);
  for (Index e = matrix.offsets[column]; e < matrix.offsets[column + 1]; ++e) {
    const Index other = plan.position_of[at(matrix.rows[at(e)])];
    if (other < position) visit(other);
  }
}

/// Returns the elimination tree (Liu 1986): the parent of each position, or none for a root.
std::vector<Index> elimination_tree(const SymmetricMatrix& matrix, const Elimination& plan) {
  std::vector<Index> parent(matrix.size(), none);
  std::vector<Index> ancestor(matrix.size(), none);
  for (Index position = 0; position < static_cast<Index>(matrix.size()); ++position) {
    for_each_before(matrix, plan, position, [&](Index i) {
      while (i != none && i < position) {
        const Index next = ancestor[at(i)];
        ancestor[at(i)] = position;
        if (next == none) parent[at(i)] = position;
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
    const Index p = parent[at(i)];
    if (p == none) {
      stack.push_back(i);
    } else {
      sibling[at(i)] = first_child[at(p)];
      first_child[at(p)] = i;
    }
  }
  std::vector<Index> order;
  order.reserve(parent.size());
  while (!stack.empty()) {
    const Index i = stack.back();
    const Index child = first_child[at(i)];
    if (child == none) {
      order.push_back(i);
      stack.pop_back();
    } else {
      first_child[at(i)] = sibling[at(child)];
      stack.push_back(child);
    }
  }
  return order;
}

/// Returns the number of entries of each column of the factor, including the diagonal.
std::vector<Index> column_counts(const SymmetricMatrix& matrix, const Elimination& plan,
                                 const std::vector<Index>& parent) {
  std::vector<Index> counts(matrix.size(), 1);
  std::vector<Index> visited(matrix.size(), none);
  for (Index position = 0; position < static_cast<Index>(matrix.size()); ++position) {
    visited[at(position)] = position;
    for_each_before(matrix, plan, position, [&](Index i) {
      for (; visited[at(i)] != position; i = parent[at(i)]) {
        ++counts[at(i)];
        visited[at(i)] = position;
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
    Block block = {j, 1, counts[at(j)], static_cast<double>(counts[at(j)])};
    while (!blocks.empty()) {
      const Block& below = blocks.back();
      const Index root = parent[at(block.first - 1)];
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

Elimination plan_elimination(const SymmetricMatrix& matrix, Ordering ordering) {
  const std::size_t n = matrix.size();
  Elimination plan;
  plan.column_at = elimination_order(matrix, ordering);
  plan.position_of = inverse(plan.column_at);
  const auto order = postorder(elimination_tree(matrix, plan));
  std::vector<Index> column_at(n);
  for (std::size_t p = 0; p < n; ++p) column_at[p] = plan.column_at[at(order[p])];
  plan.column_at = column_at;
  plan.position_of = inverse(plan.column_at);
  const auto parent = elimination_tree(matrix, plan);

  plan.firsts.clear();
  for (const Block& block : find_blocks(parent, column_counts(matrix, plan, parent))) {
    for (Index c = 0; c < block.columns; c += widest_supernode) {
      plan.firsts.push_back(block.first + c);
    }
  }
  plan.firsts.push_back(static_cast<Index>(n));
  std::vector<Index> supernode_of(n);
  for (Index s = 0; s < plan.supernodes(); ++s) {
    for (Index j = plan.firsts[at(s)]; j < plan.firsts[at(s) + 1]; ++j) supernode_of[at(j)] = s;
  }

  // The rows of a supernode are those of its columns and of its children.
  std::vector<Index> first_child(at(plan.supernodes()), none);
  std::vector<Index> sibling(at(plan.supernodes()), none);
  plan.parents.assign(at(plan.supernodes()), none);
  std::vector<Index> seen(n, none);
  plan.row_offsets.push_back(0);
  for (Index s = 0; s < plan.supernodes(); ++s) {
    const Index last = plan.firsts[at(s) + 1] - 1;
    const auto begin = static_cast<std::ptrdiff_t>(plan.rows.size());
    const auto add = [&](Index row) {
      if (row <= last || seen[at(row)] == s) return;
      seen[at(row)] = s;
      plan.rows.push_back(row);
    };
    for (Index j = plan.firsts[at(s)]; j <= last; ++j) {
      const auto column = at(plan.column_at[at(j)]);
      for (Index e = matrix.offsets[column]; e < matrix.offsets[column + 1]; ++e) {
        add(plan.position_of[at(matrix.rows[at(e)])]);
      }
    }
    for (Index child = first_child[at(s)]; child != none; child = sibling[at(child)]) {
      for (Index r = plan.row_offsets[at(child)]; r < plan.row_offsets[at(child) + 1]; ++r) {
        add(plan.rows[at(r)]);
      }
    }
    std::sort(plan.rows.begin() + begin, plan.rows.end());
    plan.row_offsets.push_back(static_cast<Index>(plan.rows.size()));
    if (static_cast<std::ptrdiff_t>(plan.rows.size()) > begin) {
      const Index up = supernode_of[at(plan.rows[static_cast<std::size_t>(begin)])];
      plan.parents[at(s)] = up;
      sibling[at(s)] = first_child[at(up)];
      first_child[at(up)] = s;
    }
  }
  return plan;
}

}  // namespace dynmesh
