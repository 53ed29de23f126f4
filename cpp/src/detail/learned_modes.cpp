#include "detail/learned_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
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

/// The bound of the coordinates of a shape in mean edge lengths, about 1 where the surface is
/// creased. A frame beyond it does not enter: it holds positions far out of the range of the
/// subject, and the products would be dominated by them.
constexpr double largest_in_edges = 1e6;

/// The bound in any unit, within which modes are in the range of float.
constexpr double largest_in_float = 0x1p100;

/// Products are sums over chunks of vertices, which do not depend on the number of threads.
constexpr Index vertices_of_a_sum = 256;

/// One shape enters per this many frames.
constexpr std::uint64_t interval = 2;

}  // namespace

ShapeLibrary::ShapeLibrary(const SurfaceParts& parts, Workers& workers, double mean_edge)
    : workers_(workers),
      largest_coordinate_(std::min(largest_in_edges * mean_edge, largest_in_float)),
      n_parts_(static_cast<std::size_t>(parts.n_parts)),
      offsets_(parts.offsets),
      rows_(parts.offsets.size() - 1),
      products_(n_parts_ * slots * slots) {
  parts_.reserve(parts.entries.size());
  weights_.reserve(parts.entries.size());
  for (const auto& [part, weight] : parts.entries) {
    parts_.push_back(part);
    weights_.push_back(static_cast<float>(weight));
  }
  std::iota(order_.begin(), order_.end(), 0);
  partial_products_.resize((rows_.size() + vertices_of_a_sum - 1) / vertices_of_a_sum * n_parts_ *
                           slots);
}

bool ShapeLibrary::offer(std::span<const ShapeTerms> memory) {
  if (++n_offered_ % interval != 0) return false;
  for (std::size_t v = 0; v < rows_.size(); ++v) {
    const Vector3<double>& back = memory[v].to_rest;
    const auto is_small = [&](double x) { return std::abs(x) <= largest_coordinate_; };
    if (!is_small(back.x) || !is_small(back.y) || !is_small(back.z)) return false;
  }
  const Index slot = order_[n_members_++];
  store(memory, slot);
  multiply(slot);
  if (n_members_ > most_members) release(least_needed());
  return true;
}

void ShapeLibrary::store(std::span<const ShapeTerms> memory, Index slot) {
  const auto s = static_cast<std::size_t>(slot);
  for (std::size_t v = 0; v < rows_.size(); ++v) {
    const Vector3<double>& back = memory[v].to_rest;
    rows_[v][s] = static_cast<float>(-back.x);
    rows_[v][slots + s] = static_cast<float>(-back.y);
    rows_[v][2 * slots + s] = static_cast<float>(-back.z);
  }
}

/// Computes the products of the shape in this slot with all others.
void ShapeLibrary::multiply(Index slot) {
  std::ranges::fill(partial_products_, 0.0);
  const ModeData entries = {offsets_.data(), parts_.data(), nullptr};
  const auto k = static_cast<Index>(rows_.size());
  workers_.for_each((k + vertices_of_a_sum - 1) / vertices_of_a_sum, [&](Index i) {
    best_kernels().modes.add_products(
        entries, shapes(), slot, &partial_products_[static_cast<std::size_t>(i) * n_parts_ * slots],
        i * vertices_of_a_sum, std::min(k, (i + 1) * vertices_of_a_sum));
  });
  const auto s = static_cast<std::size_t>(slot);
  for (std::size_t part = 0; part < n_parts_; ++part) {
    for (std::size_t other = 0; other < slots; ++other) {
      double sum = 0;
      for (std::size_t n = part * slots + other; n < partial_products_.size();
           n += n_parts_ * slots) {
        sum += partial_products_[n];
      }
      products_[(part * slots + s) * slots + other] = sum;
      products_[(part * slots + other) * slots + s] = sum;
    }
  }
}

/// The older one of the two shapes that are closest over the whole surface.
std::size_t ShapeLibrary::least_needed() const {
  constexpr std::size_t whole = 0;
  const auto squared_norm_of = [&](Index slot) { return product(whole, slot, slot); };
  std::size_t found = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n_members_; ++i) {
    for (std::size_t j = i + 1; j < n_members_; ++j) {
      const Index a = order_[i];
      const Index b = order_[j];
      const double distance = squared_norm_of(a) - 2 * product(whole, a, b) + squared_norm_of(b);
      if (distance < least) {
        least = distance;
        found = i;
      }
    }
  }
  return found;
}

/// Its slot becomes the one that is free most recently.
void ShapeLibrary::release(std::size_t member) {
  const auto slot = order_.begin() + static_cast<std::ptrdiff_t>(member);
  std::rotate(slot, slot + 1, order_.end());
  --n_members_;
}

void ShapeLibrary::recall() {
  std::array<Index, slots> all, ascending = order_;
  std::iota(all.begin(), all.end(), 0);
  std::ranges::sort(ascending);
  if (ascending != all || n_members_ > most_members) {
    refuse_state("does not contain a valid library of shapes");
  }
  for (const Index slot : all) multiply(slot);
}

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
      fit_(ShapeFit::Of::change, cells, workers, constants, Modes(parts, scale.mean_edge)),
      next_(parts, scale.mean_edge),
      used_(static_cast<std::size_t>(constants.local_parts + 1)),
      making_(static_cast<std::size_t>(constants.local_parts + 1)) {}

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
