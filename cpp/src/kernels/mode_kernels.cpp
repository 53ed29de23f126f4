#include "kernels/mode_kernels.hpp"

#include <cstddef>

#include "kernels/lanes.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

constexpr int quads = modes_of_part / 4;

/// The x of the modes of an entry; the y and the z follow.
[[gnu::always_inline]] inline const Floats* of_entry(const ModeData& modes, Index e) {
  return reinterpret_cast<const Floats*>(modes.values) + std::ptrdiff_t{3} * quads * e;
}

template <class Number, class Quads>
[[gnu::always_inline]] inline Quads* of_part(Number* values, const ModeData& modes, Index e) {
  return reinterpret_cast<Quads*>(values) + std::ptrdiff_t{quads} * modes.parts[e];
}

[[gnu::always_inline]] inline double sum_of(const Floats (&sums)[quads]) {
  const Floats sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  static_assert(quads == 4);
  return static_cast<double>((sum[0] + sum[1]) + (sum[2] + sum[3]));
}

void combine(const ModeData& modes, const float* coefficients, Vector3* combined, Index first,
             Index last) {
  for (Index i = first; i < last; ++i) {
    Floats sums[3][quads] = {};
    for (Index e = modes.offsets[i]; e < modes.offsets[i + 1]; ++e) {
      const Floats* mode = of_entry(modes, e);
      const auto* a = of_part<const float, const Floats>(coefficients, modes, e);
      for (int c = 0; c < 3; ++c) {
        for (int q = 0; q < quads; ++q) sums[c][q] += a[q] * mode[quads * c + q];
      }
    }
    combined[i] = {sum_of(sums[0]), sum_of(sums[1]), sum_of(sums[2])};
  }
}

template <bool with_squares>
void add_projections(const ModeData& modes, const Vector3* field, const double* weights,
                     float* sums, float* squares, Index first, Index last) {
  for (Index i = first; i < last; ++i) {
    const auto v_x = static_cast<float>(field[i].x);
    const auto v_y = static_cast<float>(field[i].y);
    const auto v_z = static_cast<float>(field[i].z);
    const auto weight = with_squares ? static_cast<float>(weights[i]) : 0.0F;
    for (Index e = modes.offsets[i]; e < modes.offsets[i + 1]; ++e) {
      const Floats* mode = of_entry(modes, e);
      auto* sum = of_part<float, Floats>(sums, modes, e);
      auto* square = with_squares ? of_part<float, Floats>(squares, modes, e) : nullptr;
      for (int q = 0; q < quads; ++q) {
        const Floats x = mode[q], y = mode[quads + q], z = mode[2 * quads + q];
        sum[q] += v_x * x + v_y * y + v_z * z;
        if constexpr (with_squares) square[q] += weight * (x * x + y * y + z * z);
      }
    }
  }
}

void project(const ModeData& modes, const Vector3* field, const double* weights, float* sums,
             float* squares, Index first, Index last) {
  const auto add = weights != nullptr ? add_projections<true> : add_projections<false>;
  add(modes, field, weights, sums, squares, first, last);
}

void form(const ModeData& modes, const ShapeData& shapes, const CombinationData& combinations,
          float* values, Index first, Index last) {
  const std::ptrdiff_t slots = shapes.slots;
  for (Index i = first; i < last; ++i) {
    const float* shape = shapes.shapes + 3 * slots * i;
    for (Index e = modes.offsets[i]; e < modes.offsets[i + 1]; ++e) {
      Floats sums[3][quads] = {};
      const auto* factors = reinterpret_cast<const Floats*>(combinations.combinations) +
                            std::ptrdiff_t{quads} * combinations.n_slots * modes.parts[e];
      for (Index l = 0; l < combinations.n_slots; ++l, factors += quads) {
        const float* numbers = shape + combinations.slots[l];
        for (int c = 0; c < 3; ++c) {
          for (int q = 0; q < quads; ++q) sums[c][q] += numbers[c * slots] * factors[q];
        }
      }
      auto* mode = reinterpret_cast<Floats*>(values) + std::ptrdiff_t{3} * quads * e;
      for (int c = 0; c < 3; ++c) {
        for (int q = 0; q < quads; ++q) mode[quads * c + q] = shapes.weights[e] * sums[c][q];
      }
    }
  }
}

/// The products with several shapes are exact sums of three products of floats, up to the rounding
/// of doubles, and the same whichever of two shapes is in `slot`.
void add_products(const ModeData& modes, const ShapeData& shapes, Index slot, double* sums,
                  Index first, Index last) {
  const std::ptrdiff_t slots = shapes.slots;
  const std::ptrdiff_t quads_of_slots = slots / 4;
  for (Index i = first; i < last; ++i) {
    const float* shape = shapes.shapes + 3 * slots * i;
    Doubles products[most_shapes / 4] = {};
    for (int c = 0; c < 3; ++c) {
      const auto* all = reinterpret_cast<const Floats*>(shape + c * slots);
      const auto one = static_cast<double>(shape[c * slots + slot]);
      for (int q = 0; q < quads_of_slots; ++q) {
        products[q] += one * __builtin_convertvector(all[q], Doubles);
      }
    }
    for (Index e = modes.offsets[i]; e < modes.offsets[i + 1]; ++e) {
      double* sum = sums + slots * modes.parts[e];
      const auto weight = static_cast<double>(shapes.weights[e]);
      for (int q = 0; q < quads_of_slots; ++q) {
        store(sum + 4 * q, load(sum + 4 * q) + weight * products[q]);
      }
    }
  }
}

}  // namespace

extern const ModeKernels mode_kernels;
const ModeKernels mode_kernels = {combine, project, form, add_products};

}  // namespace dynmesh::DYNMESH_KERNELS
