#include "shape/shape_library.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <dynmesh/training.hpp>
#include <limits>
#include <numeric>

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

/// For so many shapes, and one more: a multiple of four.
constexpr std::size_t slots_for(std::size_t most) { return (most + 4) / 4 * 4; }
constexpr std::size_t most_slots = slots_for(Training<double>::most_frames);

constexpr int most_fits = 100;
constexpr double settled = 1e-9;  // of the components of a quaternion

/// The largest share of the area of a closed surface that is missing, and the largest mean
/// correlation of its heights with those of mirror images.
constexpr double most_open = 0.05;
constexpr double mirrored = -0.75;

bool are_near(const Quaternion& a, const Quaternion& b) {
  return std::abs(a.w - b.w) <= settled && std::abs(a.x - b.x) <= settled &&
         std::abs(a.y - b.y) <= settled && std::abs(a.z - b.z) <= settled;
}

/// How high vertices are above their neighbours, along the normals of the faces. Mirror images have
/// the opposite heights, in any pose.
std::vector<double> heights_of(std::span<const Triangle> faces, Field x) {
  std::vector<Vector3> away(x.size()), normals(x.size());
  for (const Triangle& face : faces) {
    const Vector3 normal = normal_of(face, x);
    for (const Index v : face) {
      for (const Index other : face) away[at(v)] = away[at(v)] + (x[at(v)] - x[at(other)]);
      normals[at(v)] = normals[at(v)] + normal;
    }
  }
  std::vector<double> heights;
  for (std::size_t v = 0; v < x.size(); ++v) heights.push_back(dot(away[v], normals[v]));
  return heights;
}

/// The normals of a closed surface, as long as its areas, cancel out.
bool is_closed(std::span<const Triangle> faces, Field x) {
  Vector3 sum;
  double area = 0;
  for (const Triangle& face : faces) {
    sum = sum + normal_of(face, x);
    area += std::sqrt(squared_norm(normal_of(face, x)));
  }
  return std::sqrt(squared_norm(sum)) < most_open * area;
}

/// Whether the frames are mirror images of a closed surface; an open one may be bent the other way.
bool are_mirrored(std::span<const std::vector<Vector3>> training, std::span<const Triangle> faces,
                  Field first_frame) {
  if (!is_closed(faces, first_frame)) return false;
  const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  };
  const std::vector<double> own = heights_of(faces, first_frame);
  double correlations = 0;
  for (const auto& frame : training) {
    const std::vector<double> heights = heights_of(faces, frame);
    correlations +=
        product(own, heights) / std::sqrt(product(own, own) * product(heights, heights));
  }
  return correlations < mirrored * static_cast<double>(training.size());
}

}  // namespace

ShapeLibrary::ShapeLibrary(const Modes& modes, std::size_t most, double mean_edge, double rounding,
                           Workers& workers)
    : workers_(workers),
      parts_(modes.parts()),
      most_(most),
      slots_(slots_for(most)),
      n_parts_(at(parts_.n_parts)),
      unit_(modes.unit()),
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

/// Computes the products of the shape in this slot with all others. They are exact sums of three
/// products of floats, up to the rounding of doubles, and the same whichever of two shapes is in
/// the slot.
void ShapeLibrary::multiply(Index slot) {
  const auto add = [&](double* of_chunk, Index first, Index last) {
    std::array<double, most_slots> products{};
    for (Index v = first; v < last; ++v) {
      const float* shapes = &rows_[3 * slots_ * at(v)];
      std::ranges::fill(products, 0.0);
      for (std::size_t c = 0; c < 3; ++c, shapes += slots_) {
        const auto one = static_cast<double>(shapes[slot]);
        for (std::size_t l = 0; l < slots_; ++l)
          products[l] += one * static_cast<double>(shapes[l]);
      }
      for (Index e = parts_.offsets[at(v)]; e < parts_.offsets[at(v) + 1]; ++e) {
        double* sums = of_chunk + slots_ * at(parts_.parts[e]);
        for (std::size_t l = 0; l < slots_; ++l) sums[l] += parts_.weights[e] * products[l];
      }
    }
  };
  sums_.find(n_parts_ * slots_, workers_, add, [&](std::size_t i, double sum) {
    const std::size_t other = i % slots_;
    const std::size_t first = i - other;  // of the part
    products_[(first + at(slot)) * slots_ + other] = sum;
    products_[i * slots_ + at(slot)] = sum;
  });
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
  modes.form({rows_, std::span(order_).first(n_members_), factors_}, size, workers_);
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

void ShapeLibrary::multiply_all() {
  std::vector<Index> all(slots_);
  std::iota(all.begin(), all.end(), Index{0});
  if (!std::ranges::is_permutation(order_, all) || n_members_ > most_) {
    refuse_state("does not contain a valid library of shapes");
  }
  for (std::size_t i = 0; i < n_members_; ++i) multiply(order_[i]);
}

LearnedModes::LearnedModes(const ShapeModel& model, Workers& workers)
    : model_(model),
      modes_(divide_surface(model.topology.cells, model.first_frame), model.mean_edge),
      library_(modes_, training_constants.most_learned, model.mean_edge,
               model.rounding.mean_square(model.first_frame), workers) {}

void LearnedModes::learn(const Memory& memory) {
  if (memory.generations.anchors() == 0) return;
  if (++n_evident_ % training_constants.learned_interval != 0) return;
  const double largest = training_constants.largest_learned * model_.mean_edge;
  const auto is_small = [&](double x) { return std::abs(x) <= largest; };
  const auto shape_of = [&](std::size_t v) { return -1.0 * (model_.first_shape[v] - memory.m[v]); };
  for (std::size_t v = 0; v < memory.m.size(); ++v) {
    const auto [x, y, z, unused] = shape_of(v);
    if (!is_small(x) || !is_small(y) || !is_small(z)) return;
  }
  library_.add(shape_of);
  if (library_.size() > 1) library_.make(modes_);
}

void LearnedModes::make() {
  library_.multiply_all();
  if (library_.size() > 1) library_.make(modes_);
}

/// Q is fitted to a frame until it no longer changes, from the rotation that fits the whole frame
/// best, since its pose may be far from frame 0.
Modes training_modes(std::span<const std::vector<Vector3>> training,
                     std::span<const Triangle> faces, const ShapeModel& model, Workers& workers) {
  if (training.empty() || are_mirrored(training, faces, model.first_frame)) return {};
  double largest_rounding = 0;
  for (const auto& frame : training) {
    largest_rounding = std::max(largest_rounding, model.rounding.mean_square(frame));
  }
  Modes modes(divide_surface(model.topology.cells, model.first_frame), model.mean_edge);
  ShapeLibrary library(modes, training.size(), model.mean_edge, largest_rounding, workers);
  std::vector<Vector3> kx(model.size());
  std::vector<Quaternion> q(model.size()), before(model.size());
  Rotations rotations(model.surroundings, workers);
  for (const auto& frame : training) {
    std::ranges::fill(q, quaternion_of(fit_rigid_motion(model.first_frame, frame).rotation));
    for (int n = 0; n < most_fits; ++n) {
      before = q;
      rotations.fit(frame, q);
      if (std::ranges::equal(before, q, are_near)) break;
    }
    apply_operator(model.k, frame, 1, kx, workers);
    turn_back(q, kx, kx, workers);
    library.add([&](std::size_t v) { return kx[v] - model.first_shape[v]; });
  }
  library.make(modes);
  return modes;
}

}  // namespace dynmesh
