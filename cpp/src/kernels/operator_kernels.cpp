#include "kernels/lanes.hpp"
#include "kernels/rotation_kernels.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

/// Computes row i of C x, times `factor`.
template <int fields>
[[gnu::always_inline]] inline void multiply_row(const OperatorData& k, Index i, double factor,
                                                const Vector3<double>* x,
                                                Vector3<double>* product) {
  Doubles sums[fields] = {};
  for (Index e = k.offsets[i]; e < k.offsets[i + 1]; ++e) {
    const Vector3<double>* other = x + static_cast<std::ptrdiff_t>(k.columns[e]) * fields;
    for (int f = 0; f < fields; ++f) sums[f] += k.values[e] * quad(other + f);
  }
  for (int f = 0; f < fields; ++f) quad(product + f) = factor * sums[f];
}

template <int fields>
void apply_fields(const OperatorData& k, const Vector3<double>* x, Vector3<double>* products,
                  Index first, Index last) {
  for (Index i = first; i < last; ++i) {
    multiply_row<fields>(k, i, k.scale[i], x, products + static_cast<std::ptrdiff_t>(i) * fields);
  }
}

template <int fields>
void apply_transposed_fields(const OperatorData& k, const Vector3<double>* y, const Index* rows,
                             Vector3<double>* products, Index first, Index last) {
  for (Index n = first; n < last; ++n) {
    multiply_row<fields>(k, rows[n], 1, y, products + static_cast<std::ptrdiff_t>(n) * fields);
  }
}

void apply(const OperatorData& k, const Vector3<double>* x, int fields, Vector3<double>* products,
           Index first, Index last) {
  fields == 1 ? apply_fields<1>(k, x, products, first, last)
              : apply_fields<3>(k, x, products, first, last);
}

void apply_transposed(const OperatorData& k, const Vector3<double>* y, int fields,
                      const Index* rows, Vector3<double>* products, Index first, Index last) {
  fields == 1 ? apply_transposed_fields<1>(k, y, rows, products, first, last)
              : apply_transposed_fields<3>(k, y, rows, products, first, last);
}

/// The columns of a rotation matrix.
struct Matrix {
  Doubles x, y, z;
};

[[gnu::always_inline]] inline Matrix matrix_of(const Quaternion& q) {
  const double xx = 2 * q.x * q.x, yy = 2 * q.y * q.y, zz = 2 * q.z * q.z;
  const double xy = 2 * q.x * q.y, xz = 2 * q.x * q.z, yz = 2 * q.y * q.z;
  const double wx = 2 * q.w * q.x, wy = 2 * q.w * q.y, wz = 2 * q.w * q.z;
  return {Doubles{1 - yy - zz, xy + wz, xz - wy, 0}, Doubles{xy - wz, 1 - xx - zz, yz + wx, 0},
          Doubles{xz + wy, yz - wx, 1 - xx - yy, 0}};
}

template <int fields>
void turn_fields(const Quaternion* rotations, const Vector3<double>* values,
                 Vector3<double>* turned, Index first, Index last) {
  for (Index i = first; i < last; ++i) {
    const Matrix q = matrix_of(rotations[i]);
    for (int f = 0; f < fields; ++f) {
      const std::ptrdiff_t row = fields * static_cast<std::ptrdiff_t>(i) + f;
      const Vector3<double>& v = values[row];
      quad(turned + row) = v.x * q.x + v.y * q.y + v.z * q.z;
    }
  }
}

void turn(const Quaternion* rotations, const Vector3<double>* values, int fields,
          Vector3<double>* turned, Index first, Index last) {
  fields == 1 ? turn_fields<1>(rotations, values, turned, first, last)
              : turn_fields<3>(rotations, values, turned, first, last);
}

void turn_back(const Quaternion* rotations, const Vector3<double>* field, Vector3<double>* turned,
               Index first, Index last) {
  for (Index i = first; i < last; ++i) {
    const Quaternion& q = rotations[i];
    const Matrix back = matrix_of({q.w, -q.x, -q.y, -q.z});
    const Vector3<double>& v = field[i];
    quad(turned + i) = v.x * back.x + v.y * back.y + v.z * back.z;
  }
}

}  // namespace

extern const OperatorKernels operator_kernels;
const OperatorKernels operator_kernels = {apply, apply_transposed, turn, turn_back};

}  // namespace dynmesh::DYNMESH_KERNELS
