#include "detail/learned_modes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

namespace dynmesh {
namespace {

/// A matrix of at most 32 x 32, which allocates no memory.
using Products = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_learned_shapes,
                               most_learned_shapes>;

/// Modes are begun after this many frames. There are as many slices: one of eigenvectors, three of
/// vertices.
constexpr Index remade_after = 4;
constexpr std::size_t fewest_shapes = 2;

}  // namespace

LearnedModes::LearnedModes(const SurfaceParts& parts, Workers& workers,
                           const RehearsalConstants& constants)
    : workers_(workers),
      constants_(constants),
      library_(parts, workers),
      next_(parts),
      used_(static_cast<std::size_t>(parts.n_parts)),
      making_(static_cast<std::size_t>(parts.n_parts)),
      eigenvalues_(static_cast<std::size_t>(parts.n_parts * modes_of_part)),
      carried_(eigenvalues_.size()) {}

void LearnedModes::advance(Field memory, bool is_evident, Pose& pose) {
  if (n_slices_ > 0) make_slice(pose);
  if (!is_evident) return;
  has_changed_ |= library_.offer(memory);
  // The slices of earlier modes are made by now.
  if (library_.n_offered() % remade_after != 0 || !has_changed_) return;
  const auto members = library_.members();
  if (members.size() < fewest_shapes) return;
  std::ranges::copy(members, making_.members.begin());
  making_.n_members = members.size();
  has_changed_ = false;
  n_slices_ = 1;
}

void LearnedModes::make_slice(Pose& pose) {
  if (n_slices_ == 1) {
    combine();
  } else {
    form(n_slices_ - 2);
  }
  if (++n_slices_ <= remade_after) return;
  hand_over(pose);
  n_slices_ = 0;
}

/// Finds the leading eigenvectors of each part.
void LearnedModes::combine() {
  workers_.for_each(static_cast<Index>(n_parts()),
                    [&](Index part) { combine_part(static_cast<std::size_t>(part)); });
  next_.set_size(n_parts() * modes_of_part -
                 static_cast<std::size_t>(std::ranges::count(eigenvalues_, 0.0)));
}

void LearnedModes::combine_part(std::size_t part) {
  const auto n = static_cast<Eigen::Index>(making_.n_members);
  Products products(n, n);
  for (Eigen::Index l = 0; l < n; ++l) {
    for (Eigen::Index m = 0; m < n; ++m) {
      products(l, m) = library_.product(part, making_.members[static_cast<std::size_t>(l)],
                                        making_.members[static_cast<std::size_t>(m)]);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Products> solver(products);
  const double largest = solver.eigenvalues()[n - 1];
  const double scale = 1 / std::sqrt(static_cast<double>(n));
  for (Eigen::Index j = 0; j < modes_of_part; ++j) {
    const double value = j < n ? solver.eigenvalues()[n - 1 - j] : 0;
    const bool is_kept = largest > 0 && value > constants_.least_eigenvalue * largest;
    const auto mode = static_cast<std::size_t>(j);
    eigenvalues_[part * modes_of_part + mode] = is_kept ? value : 0;
    for (Eigen::Index l = 0; l < n; ++l) {
      making_.factors[making_.at(part, static_cast<std::size_t>(l)) + mode] =
          is_kept ? static_cast<float>(scale * solver.eigenvectors()(l, n - 1 - j)) : 0.0F;
    }
  }
}

/// Forms the modes of a third of the vertices.
void LearnedModes::form(Index slice) {
  constexpr std::size_t n = remade_after - 1;
  const std::size_t k = library_.rows().size();
  const auto bound = [&](Index s) { return static_cast<Index>(k * static_cast<std::size_t>(s) / n); };
  next_.form(library_.shapes(), making_.data(), bound(slice), bound(slice + 1), workers_);
}

void LearnedModes::hand_over(Pose& pose) {
  carry_over(pose.coefficients());
  std::swap(used_, making_);
  pose.replace(next_, carried_);
}

/// The coefficients of the new modes that are closest to a shape of the present ones: for each
/// part, with y = U a / sqrt(n) of the present modes, they minimise |Z (U' a' / sqrt(n') - y)|,
/// where Z holds all shapes and Z^T Z are their products. U' are eigenvectors, so that a' =
/// n' / eigenvalue (U' / sqrt(n'))^T Z^T Z y.
void LearnedModes::carry_over(std::span<const double> coefficients) {
  for (std::size_t part = 0; part < n_parts(); ++part) {
    const auto a = coefficients.subspan(part * modes_of_part, modes_of_part);
    std::array<double, slots> shares{};  // y
    for (std::size_t l = 0; l < used_.n_members; ++l) {
      const float* factors = &used_.factors[used_.at(part, l)];
      for (std::size_t j = 0; j < modes_of_part; ++j) {
        shares[l] += static_cast<double>(factors[j]) * a[j];
      }
    }
    std::array<double, slots> projected{};  // Z^T Z y
    for (std::size_t m = 0; m < making_.n_members; ++m) {
      for (std::size_t l = 0; l < used_.n_members; ++l) {
        projected[m] += library_.product(part, making_.members[m], used_.members[l]) * shares[l];
      }
    }
    for (std::size_t j = 0; j < modes_of_part; ++j) {
      double sum = 0;
      for (std::size_t m = 0; m < making_.n_members; ++m) {
        sum += static_cast<double>(making_.factors[making_.at(part, m) + j]) * projected[m];
      }
      const double value = eigenvalues_[part * modes_of_part + j];
      carried_[part * modes_of_part + j] =
          value > 0 ? static_cast<double>(making_.n_members) / value * sum : 0;
    }
  }
}

}  // namespace dynmesh
