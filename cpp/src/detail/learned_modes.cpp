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

/// Factors of modes that there are not are 0.
std::size_t LearnedModes::Combination::n_modes() const {
  std::size_t n = 0;
  for (std::size_t part = 0; at(part, 0) < factors.size(); ++part) {
    for (std::size_t j = 0; j < modes_of_part; ++j) {
      bool is_mode = false;
      for (std::size_t l = 0; l < n_members; ++l) is_mode |= factors[at(part, l) + j] != 0;
      n += is_mode ? 1 : 0;
    }
  }
  return n;
}

LearnedModes::LearnedModes(const SurfaceParts& parts, Workers& workers,
                           const TrainingConstants& constants, const ModeScale& scale)
    : workers_(workers),
      constants_(constants),
      scale_(scale),
      n_parts_(static_cast<std::size_t>(parts.n_parts)),
      weights_(weights_of(parts)),
      library_(parts, workers, scale.mean_edge),
      next_(parts, scale.mean_edge),
      used_(static_cast<std::size_t>(constants.local_parts + 1)),
      making_(static_cast<std::size_t>(constants.local_parts + 1)) {}

void LearnedModes::advance(Field memory, bool is_evident, ShapeFit& fit) {
  if (n_slices_ > 0) make_slice(fit);
  if (!is_evident) return;
  has_changed_ |= library_.offer(memory);
  // The slices of earlier modes are made by now.
  if (library_.n_offered() % remade_after != 0 || !has_changed_) return;
  const auto members = library_.members();
  if (members.size() < fewest_shapes) return;
  making_.members = {};
  std::ranges::copy(members, making_.members.begin());
  making_.n_members = members.size();
  has_changed_ = false;
  n_slices_ = 1;
}

void LearnedModes::make_slice(ShapeFit& fit) {
  if (n_slices_ == 1) {
    combine();
  } else {
    form(n_slices_ - 2);
  }
  if (++n_slices_ <= remade_after) return;
  hand_over(fit);
  n_slices_ = 0;
}

/// Finds the leading eigenvectors of each part.
void LearnedModes::combine() {
  workers_.for_each(static_cast<Index>(n_parts_),
                    [&](Index part) { combine_part(static_cast<std::size_t>(part)); });
  next_.set_size(making_.n_modes());
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
  const double least =
      std::max(constants_.least_eigenvalue * solver.eigenvalues()[n - 1],
               scale_.least_eigenvalue(making_.n_members, weights_[part], constants_));
  const double scale = 1 / std::sqrt(static_cast<double>(n));
  for (Eigen::Index j = 0; j < modes_of_part; ++j) {
    const double value = j < n ? solver.eigenvalues()[n - 1 - j] : 0;
    const bool is_kept = value > least;
    const auto mode = static_cast<std::size_t>(j);
    for (Eigen::Index l = 0; l < most_learned_shapes; ++l) {
      making_.factors[making_.at(part, static_cast<std::size_t>(l)) + mode] =
          is_kept && l < n ? static_cast<float>(scale * solver.eigenvectors()(l, n - 1 - j)) : 0.0F;
    }
  }
}

/// Forms the modes of a third of the vertices.
void LearnedModes::form(Index slice) {
  constexpr std::size_t n = remade_after - 1;
  const std::size_t k = library_.rows().size();
  const auto bound = [&](Index s) {
    return static_cast<Index>(k * static_cast<std::size_t>(s) / n);
  };
  next_.form(library_.shapes(), making_.data(), bound(slice), bound(slice + 1), workers_);
}

void LearnedModes::hand_over(ShapeFit& fit) {
  std::swap(used_, making_);
  fit.replace(next_);
}

std::size_t LearnedModes::memory_size(const TrainingConstants& constants) {
  return ShapeLibrary::memory_size + 2 + 2 * (1 + slots) +
         static_cast<std::size_t>(constants.local_parts + 1) * slots * modes_of_part;
}

void LearnedModes::append_memory(std::vector<double>& memory) const {
  library_.append_memory(memory);
  memory.push_back(static_cast<double>(n_slices_));
  memory.push_back(has_changed_ ? 1 : 0);
  for (const Combination* combination : {&used_, &making_}) {
    memory.push_back(static_cast<double>(combination->n_members));
    for (const Index slot : combination->members) memory.push_back(static_cast<double>(slot));
  }
  for (const float factor : used_.factors) memory.push_back(static_cast<double>(factor));
}

bool LearnedModes::accepts(std::span<const double> memory, std::span<const Row> rows,
                           const TrainingConstants& constants) {
  if (memory.size() != memory_size(constants)) return false;
  if (!ShapeLibrary::accepts(memory.first(ShapeLibrary::memory_size), rows)) return false;
  memory = memory.subspan(ShapeLibrary::memory_size);
  if (!is_count(memory[0], remade_after) || !is_count(memory[1], 1)) return false;
  const bool is_making = memory[0] > 0;
  memory = memory.subspan(2);
  const auto is_slot = [](double slot) { return is_count(slot, slots - 1); };
  for (int n = 0; n < 2; ++n) {
    if (!is_count(memory[0], slots) || !std::ranges::all_of(memory.subspan(1, slots), is_slot)) {
      return false;
    }
    if (n == 1 && is_making && memory[0] < 1) return false;
    memory = memory.subspan(1 + slots);
  }
  // A component of a unit vector, divided by a root.
  return std::ranges::all_of(memory, [](double factor) {
    return std::abs(factor) <= 1 && static_cast<double>(static_cast<float>(factor)) == factor;
  });
}

void LearnedModes::recall(std::span<const double> memory, std::span<const Row> rows,
                          ShapeFit& fit) {
  library_.recall(memory.first(ShapeLibrary::memory_size), rows);
  memory = memory.subspan(ShapeLibrary::memory_size);
  n_slices_ = static_cast<Index>(memory[0]);
  has_changed_ = memory[1] != 0;
  memory = memory.subspan(2);
  for (Combination* combination : {&used_, &making_}) {
    combination->n_members = static_cast<std::size_t>(memory[0]);
    std::ranges::transform(memory.subspan(1, slots), combination->members.begin(),
                           [](double slot) { return static_cast<Index>(slot); });
    memory = memory.subspan(1 + slots);
  }
  std::ranges::transform(memory.first(used_.factors.size()), used_.factors.begin(),
                         [](double factor) { return static_cast<float>(factor); });
  next_.form(library_.shapes(), used_.data(), 0, static_cast<Index>(rows.size()), workers_);
  next_.set_size(used_.n_modes());
  fit.replace(next_);
  // The slices that had been made.
  if (n_slices_ > 1) combine();
  for (Index slice = 2; slice < n_slices_; ++slice) form(slice - 2);
}

}  // namespace dynmesh
