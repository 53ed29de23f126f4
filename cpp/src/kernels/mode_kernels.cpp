#include "kernels/mode_kernels.hpp"

#include <cstddef>

#include "kernels/lanes.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

constexpr int n = modes_of_part;

[[gnu::always_inline]] inline const float* of_entry(const ModeData& modes, Index e) {
  return modes.values + static_cast<std::ptrdiff_t>(3 * n) * e;
}

void combine(const ModeData& modes, const float* coefficients, Vector3<double>* combined,
             Index first, Index last) {
  for (Index i = first; i < last; ++i) {
    float x[n] = {};
    float y[n] = {};
    float z[n] = {};
    for (Index e = modes.offsets[i]; e < modes.offsets[i + 1]; ++e) {
      const float* mode = of_entry(modes, e);
      const float* a = coefficients + static_cast<std::ptrdiff_t>(n) * modes.parts[e];
      for (int j = 0; j < n; ++j) x[j] += a[j] * mode[j];
      for (int j = 0; j < n; ++j) y[j] += a[j] * mode[n + j];
      for (int j = 0; j < n; ++j) z[j] += a[j] * mode[2 * n + j];
    }
    for (int half = n / 2; half > 0; half /= 2) {
      for (int j = 0; j < half; ++j) {
        x[j] += x[half + j];
        y[j] += y[half + j];
        z[j] += z[half + j];
      }
    }
    combined[i] = {static_cast<double>(x[0]), static_cast<double>(y[0]), static_cast<double>(z[0])};
  }
}

void project(const ModeData& modes, const Vector3<double>* field, float* sums, Index first,
             Index last) {
  for (Index i = first; i < last; ++i) {
    const auto x = static_cast<float>(field[i].x);
    const auto y = static_cast<float>(field[i].y);
    const auto z = static_cast<float>(field[i].z);
    for (Index e = modes.offsets[i]; e < modes.offsets[i + 1]; ++e) {
      const float* mode = of_entry(modes, e);
      float* sum = sums + static_cast<std::ptrdiff_t>(n) * modes.parts[e];
      for (int j = 0; j < n; ++j) {
        sum[j] += x * mode[j] + y * mode[n + j] + z * mode[2 * n + j];
      }
    }
  }
}

void add_squares(const ModeData& modes, const double* weights, float* sums, Index first,
                 Index last) {
  for (Index i = first; i < last; ++i) {
    const auto weight = static_cast<float>(weights[i]);
    for (Index e = modes.offsets[i]; e < modes.offsets[i + 1]; ++e) {
      const float* mode = of_entry(modes, e);
      float* sum = sums + static_cast<std::ptrdiff_t>(n) * modes.parts[e];
      for (int j = 0; j < n; ++j) {
        sum[j] += weight * (mode[j] * mode[j] + mode[n + j] * mode[n + j] +
                            mode[2 * n + j] * mode[2 * n + j]);
      }
    }
  }
}

}  // namespace

extern const ModeKernels mode_kernels;
const ModeKernels mode_kernels = {combine, project, add_squares};

}  // namespace dynmesh::DYNMESH_KERNELS
