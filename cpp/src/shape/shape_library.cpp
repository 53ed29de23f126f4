#include "shape/shape_library.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <ranges>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/stored_numbers.hpp"
#include "base/symmetric_eigen.hpp"
#include "shape/constants.hpp"
#include "shape/rotations.hpp"

namespace dynmesh {
namespace {

// A completer that learns allocates no memory.
static_assert(training_constants.most_learned <= largest_without_memory);

constexpr int most_fits = 100;
constexpr double settled = 1e-9;  // of the components of a quaternion

bool are_near(const Quaternion& a, const Quaternion& b) {
  return std::abs(a.w - b.w) <= settled && std::abs(a.x - b.x) <= settled &&
         std::abs(a.y - b.y) <= settled && std::abs(a.z - b.z) <= settled;
}

}  // namespace

ShapeLibrary::ShapeLibrary(const Modes& modes, std::size_t most, double mean_edge, double rounding,
                           Workers& workers)
    : workers_(workers),
      parts_(modes.parts()),
      most_(most),
      slots_((most + 4) / 4 * 4),
      n_parts_(at(parts_.n_parts)),
      unit_(modes.unit()),
      weights_(parts_.weights.begin(), parts_.weights.end()),
      of_parts_(n_parts_),
      rows_(3 * slots_ * parts_.size()),
      products_(n_parts_ * slots_ * slots_),
      sums_(parts_.size(), n_parts_ * slots_),
      vectors_(most * most),
      values_(most),
      factors_(n_parts_ * slots_ * modes_of_part),
      order_(slots_) {
  const double least = training_constants.least_mode * mean_edge / unit_;
  least_eigenvalue_ = least * least + rounding / unit_ / unit_;
  for (std::size_t e = 0; e < parts_.parts.size(); ++e) {
    of_parts_[parts_.parts[e]] += parts_.weights[e];
  }
  std::iota(order_.begin(), order_.end(), 0);
}

/// Computes the products of the shape in this slot with all others.
void ShapeLibrary::multiply(Index slot) {
  const ModeData entries = {parts_.offsets.data(), parts_.parts.data(), nullptr};
  const auto sums =
      sums_.find(n_parts_ * slots_, workers_, [&](double* of_chunk, Index first, Index last) {
        best_kernels().modes.add_products(entries, shapes(), slot, of_chunk, first, last);
      });
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const std::size_t other = i % slots_;
    const std::size_t first = i - other;  // of the part
    products_[(first + at(slot)) * slots_ + other] = sums[i];
    products_[i * slots_ + at(slot)] = sums[i];
  }
}

/// Releases the older one of the two shapes that are closest over the whole surface.
void ShapeLibrary::release_least_needed() {
  constexpr std::size_t whole = 0;
  const auto squared_norm_of = [&](Index slot) { return product(whole, slot, slot); };
  auto found = order_.begin();
  double least = std::numeric_limits<double>::infinity();
  const auto end = order_.begin() + static_cast<std::ptrdiff_t>(n_members_);
  for (auto a = order_.begin(); a != end; ++a) {
    for (auto b = a + 1; b != end; ++b) {
      const double distance =
          squared_norm_of(*a) - 2 * product(whole, *a, *b) + squared_norm_of(*b);
      if (!(distance < least)) continue;
      least = distance;
      found = a;
    }
  }
  std::rotate(found, found + 1, order_.end());
  --n_members_;
}

void ShapeLibrary::make(Modes& modes) {
  std::size_t size = 0;
  for (std::size_t part = 0; part < n_parts_; ++part) size += find_modes(part);
  modes.form(shapes(), {order_.data(), static_cast<Index>(n_members_), factors_.data()}, size,
             workers_);
}

/// Finds the leading eigenvectors of the products of a part, as combinations of the shapes. Those
/// that change the shape too little to be seen are 0. Returns the number of others.
std::size_t ShapeLibrary::find_modes(std::size_t part) {
  const std::size_t n = n_members_;
  const auto vectors = std::span(vectors_).first(n * n);
  const auto values = std::span(values_).first(n);
  for (std::size_t l = 0; l < n; ++l) {
    for (std::size_t m = 0; m < n; ++m) {
      vectors[n * l + m] = product(part, order_[l], order_[m]);
    }
  }
  symmetric_eigen(vectors, values);
  const double least = static_cast<double>(n) * of_parts_[part] * least_eigenvalue_;
  const double scale = 1 / std::sqrt(static_cast<double>(n));
  std::size_t n_modes = 0;
  for (std::size_t j = 0; j < modes_of_part; ++j) {
    const bool is_kept = j < n && values[n - 1 - j] > least;
    n_modes += is_kept ? 1 : 0;
    for (std::size_t l = 0; l < n; ++l) {
      factors_[(part * n + l) * modes_of_part + j] =
          is_kept ? static_cast<float>(scale * vectors[n * (n - 1 - j) + l]) : 0.0F;
    }
  }
  return n_modes;
}

void ShapeLibrary::recall() {
  const auto all = std::views::iota(Index{0}, static_cast<Index>(slots_));
  if (!std::ranges::is_permutation(order_, all) || n_members_ > most_) {
    refuse_state("does not contain a valid library of shapes");
  }
  for (std::size_t i = 0; i < n_members_; ++i) multiply(order_[i]);
}

/// Q is fitted to a frame until it no longer changes, from the rotation that fits the whole frame
/// best, since its pose may be far from `first`.
Modes training_modes(std::span<const std::vector<Vector3<double>>> training,
                     const DetailOperator& k, const Cells& cells,
                     std::span<const Vector3<double>> first, double mean_edge,
                     const Rounding& rounding, Workers& workers) {
  if (training.empty()) return {};
  double largest_rounding = 0;
  for (const auto& frame : training) {
    largest_rounding = std::max(largest_rounding, rounding.mean_square(frame));
  }
  Modes modes(divide_surface(cells, first), mean_edge);
  ShapeLibrary library(modes, training.size(), mean_edge, largest_rounding, workers);
  std::vector<Vector3<double>> first_shape(first.size()), kx(first.size());
  std::vector<Quaternion> before(first.size());
  apply_operator(k, first, 1, first_shape, workers);
  Rotations rotations(cells, workers, first, mean_edge);
  for (const auto& frame : training) {
    const Eigen::Quaterniond whole(fit_rigid_motion(first, frame).rotation);
    std::ranges::fill(rotations.quaternions(),
                      Quaternion{whole.w(), whole.x(), whole.y(), whole.z()});
    for (int n = 0; n < most_fits; ++n) {
      std::ranges::copy(rotations.quaternions(), before.begin());
      rotations.fit(frame);
      if (std::ranges::equal(before, rotations.quaternions(), are_near)) break;
    }
    apply_operator(k, frame, 1, kx, workers);
    rotations.turn_back(kx, kx);
    library.add([&](std::size_t v) { return kx[v] - first_shape[v]; });
  }
  library.make(modes);
  return modes;
}

}  // namespace dynmesh
