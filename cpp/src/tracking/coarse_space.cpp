#include "tracking/coarse_space.hpp"

#include <algorithm>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// How often the functions of patches are averaged: about as often as a patch has rings.
constexpr int averagings = 6;
/// Smaller values of them are left out, so that few meet at a vertex.
constexpr double least_value = 0.02;

}  // namespace

CoarseSpace::CoarseSpace(const Cells& cells, Field first_frame, const Clusters& clusters,
                         const Multiply& multiply) {
  std::vector<Vector3<double>> centres;
  for (const Index centre : clusters.centres) {
    centres.push_back(first_frame[static_cast<std::size_t>(centre)]);
  }
  const Clusters patches = cluster_vertices(clusters.neighbours, centres);
  std::vector<std::uint32_t> patch_of(cells.size());
  for (std::size_t v = 0; v < patch_of.size(); ++v) {
    const auto cluster = static_cast<std::size_t>(clusters.of_vertex[v]);
    patch_of[v] = static_cast<std::uint32_t>(patches.of_vertex[cluster]);
  }
  find_shares(cells, patch_of);
  find_pairs(patches.size(), multiply);
}

void CoarseSpace::find_shares(const Cells& cells, std::span<const std::uint32_t> patch_of) {
  const std::size_t k = cells.size();
  std::vector<std::vector<Share>> shares(k);
  for (std::size_t v = 0; v < k; ++v) shares[v] = {{patch_of[v], 1.0}};
  const auto is_same = [](const Share& a, const Share& b) { return a.patch == b.patch; };
  for (int n = 0; n < averagings; ++n) {
    std::vector<std::vector<Share>> averaged(k);
    for (std::size_t v = 0; v < k; ++v) {
      const auto cell = cells[static_cast<Index>(v)];
      std::vector<Share> all = shares[v];
      for (const Index j : cell) {
        const auto& other = shares[static_cast<std::size_t>(j)];
        all.insert(all.end(), other.begin(), other.end());
      }
      std::ranges::stable_sort(all, {}, &Share::patch);
      const double part = 1 / static_cast<double>(cell.size() + 1);
      for (auto first = all.begin(); first != all.end();) {
        const auto end = std::find_if_not(
            first, all.end(), [&](const Share& share) { return is_same(share, *first); });
        double sum = 0;
        for (auto share = first; share != end; ++share) sum += share->value;
        averaged[v].push_back({first->patch, part * sum});
        first = end;
      }
    }
    shares = std::move(averaged);
  }
  ends_ = {0};
  for (auto& of_vertex : shares) {
    std::erase_if(of_vertex, [](const Share& share) { return share.value < least_value; });
    double sum = 0;
    for (const Share& share : of_vertex) sum += share.value;
    for (const Share& share : of_vertex) shares_.push_back({share.patch, share.value / sum});
    ends_.push_back(static_cast<std::uint32_t>(shares_.size()));
  }
}

/// Three columns of Psi^T N Psi are found with each product, as the coordinates of a field.
void CoarseSpace::find_pairs(std::size_t n_patches, const Multiply& multiply) {
  const std::size_t k = ends_.size() - 1;
  constexpr std::array coordinates = {&Vector3<double>::x, &Vector3<double>::y,
                                      &Vector3<double>::z};
  std::vector<Vector3<double>> functions(k), products(k), column(n_patches);
  for (std::uint32_t first = 0; first < n_patches; first += 3) {
    for (std::size_t v = 0; v < k; ++v) {
      functions[v] = {};
      for (const Share& share : shares_of(v)) {
        if (share.patch < first || share.patch >= first + 3) continue;
        functions[v].*coordinates[share.patch - first] = share.value;
      }
    }
    multiply(functions, products);
    std::ranges::fill(column, Vector3<double>{});
    for (std::size_t v = 0; v < k; ++v) {
      for (const Share& share : shares_of(v)) {
        column[share.patch] = column[share.patch] + share.value * products[v];
      }
    }
    for (std::uint32_t c = first; c < std::min<std::size_t>(first + 3, n_patches); ++c) {
      for (std::uint32_t row = c; row < n_patches; ++row) {
        const double n = column[row].*coordinates[c - first];
        if (n != 0 || row == c) pairs_.push_back({{row, c}, n});
      }
    }
  }
  std::ranges::sort(pairs_, {}, &Pair::patches);
  for (std::size_t v = 0; v < k; ++v) {
    const auto shares = shares_of(v);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        const std::array patches = {shares[i].patch, shares[j].patch};
        const auto pair = std::ranges::lower_bound(pairs_, patches, {}, &Pair::patches);
        pair_of_.push_back(static_cast<std::uint32_t>(pair - pairs_.begin()));
      }
    }
  }
  std::vector<Eigen::Triplet<double>> triplets;
  const auto for_each_entry = [&](const auto& visit) {
    for (const Pair& pair : pairs_) {
      const auto row = 3 * static_cast<int>(pair.patches[0]);
      const auto column_of = 3 * static_cast<int>(pair.patches[1]);
      for (int e = 0; e < 9; ++e) {
        visit(row + e / 3, column_of + e % 3, row != column_of || e / 3 >= e % 3);
      }
    }
  };
  for_each_entry([&](int row, int col, bool is_below) {
    if (is_below) triplets.emplace_back(row, col, 0.0);
  });
  const auto size = static_cast<Eigen::Index>(3 * n_patches);
  matrix_.resize(size, size);
  matrix_.setFromTriplets(triplets.begin(), triplets.end());
  entries_.resize(pairs_.size());
  std::size_t n = 0;
  for_each_entry([&](int row, int col, bool is_below) {
    entries_[n / 9][n % 9] = is_below ? &matrix_.coeffRef(row, col) : nullptr;
    ++n;
  });
  factor_.analyzePattern(matrix_);
  right_side_.resize(size);
}

void CoarseSpace::factorize(const SurfaceRows& rows, double factor, std::span<const double> held) {
  const std::size_t k = ends_.size() - 1;
  at_vertices_.assign(k, {});
  for (const SurfaceRow& row : rows.rows) {
    const auto [x, y, z] = std::array{row.normal.x, row.normal.y, row.normal.z};
    const Block block = {x * x, x * y, x * z, y * y, y * z, z * z};
    for (std::size_t s = 0; s < 3; ++s) {
      const double weight = factor * row.weight * row.shares[s];
      for (std::size_t e = 0; e < 6; ++e) at_vertices_[row.corners[s]][e] += weight * block[e];
    }
  }
  blocks_.assign(pairs_.size(), {});
  const std::uint32_t* pair = pair_of_.data();
  for (std::size_t v = 0; v < k; ++v) {
    for (const std::size_t e : {0U, 3U, 5U}) at_vertices_[v][e] += held[v];
    const auto shares = shares_of(v);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        const double weight = shares[i].value * shares[j].value;
        Block& sum = blocks_[*pair++];
        for (std::size_t e = 0; e < 6; ++e) sum[e] += weight * at_vertices_[v][e];
      }
    }
  }
  constexpr std::array<std::size_t, 9> in_block = {0, 1, 2, 1, 3, 4, 2, 4, 5};
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    for (std::size_t e = 0; e < 9; ++e) {
      if (entries_[p][e] == nullptr) continue;
      *entries_[p][e] = blocks_[p][in_block[e]] + (e % 4 == 0 ? pairs_[p].n : 0);
    }
  }
  factor_.factorize(matrix_);
}

void CoarseSpace::add(Field residual, std::span<Vector3<double>> x) {
  if (factor_.info() != Eigen::Success) return;
  right_side_.setZero();
  for (std::size_t v = 0; v < x.size(); ++v) {
    for (const auto& [patch, value] : shares_of(v)) {
      const auto at = static_cast<Eigen::Index>(3 * patch);
      right_side_[at] += value * residual[v].x;
      right_side_[at + 1] += value * residual[v].y;
      right_side_[at + 2] += value * residual[v].z;
    }
  }
  solution_ = factor_.solve(right_side_);
  for (std::size_t v = 0; v < x.size(); ++v) {
    for (const auto& [patch, value] : shares_of(v)) {
      const auto at = static_cast<Eigen::Index>(3 * patch);
      x[v] = x[v] + value * Vector3<double>{solution_[at], solution_[at + 1], solution_[at + 2]};
    }
  }
}

}  // namespace dynmesh
