#include <Eigen/OrderingMethods>
#include <algorithm>

#include "kernels/dense_kernels.hpp"
#include "linear/masked_factor.hpp"

namespace dynmesh {
namespace {

/// The column at each position: approximate minimum degree (Amestoy, Davis and Duff 1996). It
/// depends only on where the matrix has entries.
std::vector<Index> minimum_degree_order(const SparseMatrix& matrix) {
  SparseMatrix copy;  // not by its constructor, which leaks if memory is exhausted
  copy = matrix;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, Index> order;
  Eigen::AMDOrdering<Index>()(copy, order);
  return {order.indices().data(), order.indices().data() + matrix.cols()};
}

std::vector<Index> inverse(const std::vector<Index>& order) {
  std::vector<Index> positions(order.size());
  for (std::size_t p = 0; p < order.size(); ++p) positions[order[p]] = static_cast<Index>(p);
  return positions;
}

/// The elimination tree (Liu 1986), and the number of entries of each column of the factor.
struct Tree {
  std::vector<Index> parents;  // of each position, or none for a root
  std::vector<Index> counts;   // including the diagonal
};

Tree elimination_tree(const SparseMatrix& matrix, const std::vector<Index>& column_at) {
  const std::vector<Index> position_of = inverse(column_at);
  Tree tree = {std::vector<Index>(column_at.size(), none), std::vector<Index>(column_at.size(), 1)};
  std::vector<Index> visited(column_at.size());
  for (Index position = 0; position < matrix.cols(); ++position) {
    visited[position] = position;
    for (SparseMatrix::InnerIterator e(matrix, column_at[position]); e; ++e) {
      Index i = position_of[e.row()];
      if (i > position) continue;
      for (; visited[i] != position; i = tree.parents[i]) {
        if (tree.parents[i] == none) tree.parents[i] = position;
        ++tree.counts[i];
        visited[i] = position;
      }
    }
  }
  return tree;
}

/// Returns the positions of a forest in postorder: every subtree is contiguous and precedes its
/// root.
std::vector<Index> postorder(const std::vector<Index>& parents) {
  const auto n = static_cast<Index>(parents.size());
  std::vector<Index> sizes(parents.size(), 1);
  for (Index i = 0; i < n; ++i) {
    if (parents[i] != none) sizes[parents[i]] += sizes[i];
  }
  // The last subtree takes the last places before its parent, or before the other roots.
  std::vector<Index> order(parents.size());
  std::vector<Index> ends(parents.size());
  Index end_of_roots = n;
  for (Index i = n; i-- > 0;) {
    Index& end = parents[i] == none ? end_of_roots : ends[parents[i]];
    ends[i] = end - 1;
    order[ends[i]] = i;
    end -= sizes[i];
  }
  return order;
}

/// Contiguous columns that may become a supernode.
struct Block {
  Index first;
  Index columns;
  Index rows;   // of its first column, including the diagonal
  double held;  // the number of nonzero entries
};

/// Limits the share of zeros by the width of the block. Narrow blocks are joined more readily,
/// since the mask removes columns from them and very narrow blocks are slow.
bool is_worth_joining(const Block& joined) {
  if (joined.columns <= 6) return true;
  const double zeros =
      1 - joined.held / (joined.columns * (joined.rows - 0.5 * (joined.columns - 1)));
  if (joined.columns <= 16) return zeros < 0.4;
  if (joined.columns <= 32) return zeros < 0.2;
  return zeros < 0.05;
}

/// Finds runs of columns with nearly the same rows. A block may be joined with the previous one if
/// that is a subtree below it, since the rows of a child are among those of its parent.
std::vector<Block> find_blocks(const Tree& tree) {
  std::vector<Block> blocks;
  for (Index j = 0; j < static_cast<Index>(tree.parents.size()); ++j) {
    Block block = {j, 1, tree.counts[j], static_cast<double>(tree.counts[j])};
    while (!blocks.empty()) {
      const Block& below = blocks.back();
      const Index root = tree.parents[block.first - 1];
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

Elimination plan_elimination(const SparseMatrix& matrix) {
  Elimination plan;
  const std::vector<Index> order = minimum_degree_order(matrix);
  for (const Index p : postorder(elimination_tree(matrix, order).parents)) {
    plan.column_at.push_back(order[p]);
  }
  plan.position_of = inverse(plan.column_at);

  for (const Block& block : find_blocks(elimination_tree(matrix, plan.column_at))) {
    for (Index c = 0; c < block.columns; c += widest_supernode) {
      const Index columns = std::min(widest_supernode, block.columns - c);
      plan.supernode_of.insert(plan.supernode_of.end(), at(columns),
                               static_cast<Index>(plan.firsts.size()));
      plan.firsts.push_back(block.first + c);
    }
  }
  plan.firsts.push_back(static_cast<Index>(order.size()));

  // The rows of a supernode are those of its columns and of its children.
  std::vector<std::vector<Index>> children(at(plan.supernodes()));
  std::vector<Index> seen(order.size(), none);
  for (Index s = 0; s < plan.supernodes(); ++s) {
    const Index last = plan.firsts[s + 1] - 1;
    std::vector<Index>& rows = plan.rows.emplace_back();
    const auto add = [&](Index row) {
      if (row <= last || seen[row] == s) return;
      seen[row] = s;
      rows.push_back(row);
    };
    for (Index j = plan.firsts[s]; j <= last; ++j) {
      for (SparseMatrix::InnerIterator e(matrix, plan.column_at[j]); e; ++e) {
        add(plan.position_of[e.row()]);
      }
    }
    for (const Index child : children[s]) std::ranges::for_each(plan.rows[child], add);
    std::ranges::sort(rows);
    plan.parents.push_back(rows.empty() ? none : plan.supernode_of[rows[0]]);
    if (!rows.empty()) children[plan.parents[s]].push_back(s);
    plan.subtree_firsts.push_back(children[s].empty() ? s : plan.subtree_firsts[children[s][0]]);
  }
  return plan;
}

}  // namespace dynmesh
