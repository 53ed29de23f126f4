#include "detail/learned_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "support/stored_numbers.hpp"
#include "support/symmetric_eigen.hpp"

namespace dynmesh {
namespace {

static_assert(most_learned_shapes <= largest_symmetric);

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

LearnedModes::LearnedModes(const SurfaceParts& parts, const Cells& cells, Workers& workers,
                           const TrainingConstants& constants, const ModeScale& scale)
    : workers_(workers),
      constants_(constants),
      scale_(scale),
      n_parts_(static_cast<std::size_t>(parts.n_parts)),
      weights_(weights_of(parts)),
      library_(parts, workers, scale.mean_edge),
      fit_(ShapeFit::Of::change, cells, workers, constants),
      next_(parts, scale.mean_edge),
      used_(static_cast<std::size_t>(constants.local_parts + 1)),
      making_(static_cast<std::size_t>(constants.local_parts + 1)) {
  fit_.reset(Modes(parts, scale.mean_edge));
}

void LearnedModes::advance(std::span<const ShapeTerms> memory, bool is_evident) {
  if (n_slices_ > 0) make_slice();
  if (!is_evident) return;
  if (library_.offer(memory)) has_changed_ = 1;
  // The slices of earlier modes are made by now.
  if (library_.n_offered() % remade_after != 0 || has_changed_ == 0) return;
  const auto members = library_.members();
  if (members.size() < fewest_shapes) return;
  making_.members = {};
  std::ranges::copy(members, making_.members.begin());
  making_.n_members = members.size();
  has_changed_ = 0;
  n_slices_ = 1;
}

void LearnedModes::make_slice() {
  if (n_slices_ == 1) {
    combine();
  } else {
    form(n_slices_ - 2);
  }
  if (++n_slices_ <= remade_after) return;
  std::swap(used_, making_);
  fit_.replace(next_);
  n_slices_ = 0;
}

/// Finds the leading eigenvectors of each part.
void LearnedModes::combine() {
  workers_.for_each(static_cast<Index>(n_parts_),
                    [&](Index part) { combine_part(static_cast<std::size_t>(part)); });
  next_.set_size(making_.n_modes());
}

void LearnedModes::combine_part(std::size_t part) {
  const std::size_t n = making_.n_members;
  std::array<double, most_learned_shapes * most_learned_shapes> all_vectors;
  std::array<double, most_learned_shapes> all_values;
  const auto vectors = std::span(all_vectors).first(n * n);
  const auto values = std::span(all_values).first(n);
  for (std::size_t l = 0; l < n; ++l) {
    for (std::size_t m = 0; m < n; ++m) {
      vectors[n * l + m] = library_.product(part, making_.members[l], making_.members[m]);
    }
  }
  symmetric_eigen(vectors, values);
  const double least = scale_.least_eigenvalue(making_.n_members, weights_[part], constants_);
  const double scale = 1 / std::sqrt(static_cast<double>(n));
  for (std::size_t j = 0; j < modes_of_part; ++j) {
    const bool is_kept = j < n && values[n - 1 - j] > least;
    for (std::size_t l = 0; l < most_learned_shapes; ++l) {
      making_.factors[making_.at(part, l) + j] =
          is_kept && l < n ? static_cast<float>(scale * vectors[n * (n - 1 - j) + l]) : 0.0F;
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

void LearnedModes::recall() {
  const auto is_slot = [](Index slot) { return slot >= 0 && slot < most_learned_shapes; };
  for (const Combination* of : {&used_, &making_}) {
    if (of->n_members > slots || !std::ranges::all_of(of->members, is_slot)) {
      refuse_state("combines shapes that there are not");
    }
  }
  if (n_slices_ < 0 || n_slices_ > remade_after || (n_slices_ > 0 && making_.n_members == 0)) {
    refuse_state("has an impossible number of slices");
  }
  library_.recall();
  const auto k = static_cast<Index>(library_.rows().size());
  next_.form(library_.shapes(), used_.data(), 0, k, workers_);
  next_.set_size(used_.n_modes());
  fit_.replace(next_);
  // The slices that had been made.
  if (n_slices_ > 1) combine();
  for (Index slice = 2; slice < n_slices_; ++slice) form(slice - 2);
}

}  // namespace dynmesh
