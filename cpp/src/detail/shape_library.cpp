#include "detail/shape_library.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "support/stored_numbers.hpp"

namespace dynmesh {
namespace {

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
  std::array<Index, slots> ascending = order_;
  std::ranges::sort(ascending);
  for (std::size_t slot = 0; slot < slots; ++slot) {
    if (ascending[slot] != static_cast<Index>(slot) || n_members_ > most_members) {
      refuse_state("does not contain a valid library of shapes");
    }
  }
  for (Index slot = 0; slot < most_learned_shapes; ++slot) multiply(slot);
}

}  // namespace dynmesh
