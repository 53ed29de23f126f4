#include "kernels/rotation_kernels.hpp"

#include "kernels/lanes.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

[[gnu::always_inline]] inline Doubles root(Doubles v) {
  return Doubles{__builtin_sqrt(v[0]), __builtin_sqrt(v[1]), __builtin_sqrt(v[2]),
                 __builtin_sqrt(v[3])};
}
[[gnu::always_inline]] inline bool all(Integers v) { return (v[0] & v[1] & v[2] & v[3]) != 0; }

/// The rows of a covariance.
struct Rows {
  Doubles x, y, z;

  [[gnu::always_inline]] void add(const Rows& other) {
    x += other.x;
    y += other.y;
    z += other.z;
  }
};

[[gnu::always_inline]] inline Rows& rows_of(Covariance& covariance) {
  return *reinterpret_cast<Rows*>(&covariance);
}
[[gnu::always_inline]] inline const Rows& rows_of(const Covariance& covariance) {
  return *reinterpret_cast<const Rows*>(&covariance);
}

[[gnu::always_inline]] inline Rows measured(const RotationData& data, Index i) {
  Rows sum{};
  const Doubles here = quad(data.frame + (data.starts != nullptr ? data.starts[i] : i));
  for (Index e = data.offsets[i]; e < data.offsets[i + 1]; ++e) {
    const Doubles edge = quad(data.frame + data.ends[e]) - here;
    const Doubles rest = quad(data.rest_edges + e);
    sum.add({edge[0] * rest, edge[1] * rest, edge[2] * rest});
  }
  return sum;
}

void measure(const RotationData& data, Index first, Index last) {
  for (Index i = first; i < last; ++i) rows_of(data.covariances[i]) = measured(data, i);
}

void add_lists(const Covariance* from, const Index* offsets, const Index* members, Covariance* sums,
               Index first, Index last) {
  for (Index c = first; c < last; ++c) {
    Rows sum = rows_of(from[c]);
    for (Index m = offsets[c]; m < offsets[c + 1]; ++m) sum.add(rows_of(from[members[m]]));
    rows_of(sums[c]) = sum;
  }
}

/// Four quaternions w x y z or covariances, one in each lane.
struct Turns {
  Doubles q[4];
};
struct Covariances {
  Doubles s[3][3];
};

[[gnu::always_inline]] inline Quaternion quaternion(const Turns& turns, int lane) {
  return {turns.q[0][lane], turns.q[1][lane], turns.q[2][lane], turns.q[3][lane]};
}
[[gnu::always_inline]] inline void put(const Quaternion& quaternion, int lane, Turns& turns) {
  const Doubles numbers = load(&quaternion.w);
  for (int c = 0; c < 4; ++c) turns.q[c][lane] = numbers[c];
}

[[gnu::always_inline]] inline Doubles squared_norm(const Turns& turns) {
  const auto& [w, x, y, z] = turns.q;
  return w * w + x * x + y * y + z * z;
}

/// Returns the rotation matrices of quaternions of any length except 0.
[[gnu::always_inline]] inline Covariances matrix_of(const Turns& turns) {
  const auto& [w, x, y, z] = turns.q;
  const Doubles scale = 2 / squared_norm(turns);
  const Doubles xx = scale * x * x, yy = scale * y * y, zz = scale * z * z;
  const Doubles xy = scale * x * y, xz = scale * x * z, yz = scale * y * z;
  const Doubles wx = scale * w * x, wy = scale * w * y, wz = scale * w * z;
  return {{{1 - yy - zz, xy - wz, xz + wy},
           {xy + wz, 1 - xx - zz, yz - wx},
           {xz - wy, yz + wx, 1 - xx - yy}}};
}

/// Executes a step towards the rotation R with the largest tr(R^T S). With P = R^T S, the gradient
/// is the axial vector a of P and the Hessian is G = tr(P) 1 - (P + P^T) / 2. A shift that vanishes
/// at the maximum allows steps of large angles far from it. If G is not safely positive, the scalar
/// step of Mueller, Bender, Chentanez and Macklin (2016) is taken, which increases the trace as
/// well. `is_maximum` is set if G is safely positive even without a shift, so that a step of length
/// 0 has reached the maximum and not a saddle. Returns |step|^2.
[[gnu::always_inline]] inline Doubles turn_once(const Covariances& s, Turns& turns,
                                                Integers& is_maximum) {
  const Covariances r = matrix_of(turns);
  Doubles p[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      p[i][j] = r.s[0][i] * s.s[0][j] + r.s[1][i] * s.s[1][j] + r.s[2][i] * s.s[2][j];
    }
  }
  const Doubles ax = p[2][1] - p[1][2];
  const Doubles ay = p[0][2] - p[2][0];
  const Doubles az = p[1][0] - p[0][1];
  const Doubles trace = p[0][0] + p[1][1] + p[2][2];
  const Doubles size = root(trace * trace + ax * ax + ay * ay + az * az);
  const Doubles shift = 0.5 * (size - trace);
  const Doubles xx = p[1][1] + p[2][2] + shift;
  const Doubles yy = p[0][0] + p[2][2] + shift;
  const Doubles zz = p[0][0] + p[1][1] + shift;
  const Doubles xy = -0.5 * (p[0][1] + p[1][0]);
  const Doubles xz = -0.5 * (p[0][2] + p[2][0]);
  const Doubles yz = -0.5 * (p[1][2] + p[2][1]);
  const Doubles cxx = yy * zz - yz * yz;
  const Doubles cxy = xz * yz - xy * zz;
  const Doubles cxz = xy * yz - xz * yy;
  const Doubles cyy = xx * zz - xz * xz;
  const Doubles cyz = xy * xz - xx * yz;
  const Doubles czz = xx * yy - xy * xy;
  const Doubles determinant = xx * cxx + xy * cxy + xz * cxz;
  const Doubles threshold = 1e-4 * size;
  const Integers is_safe =
      (xx > threshold) & (czz > threshold * size) & (determinant > threshold * size * size);
  is_maximum = is_safe & (trace > Doubles{});  // the shift is small if the step is small
  const Doubles newton = 1 / (is_safe ? determinant : Doubles{} + 1);
  // At half a turn from the maximum, the length of the step is not determined; keep it in range.
  const Doubles scalar = 2 / larger(trace + size, 1e-6 * size + 1e-300);
  const Doubles wx = is_safe ? newton * (cxx * ax + cxy * ay + cxz * az) : scalar * ax;
  const Doubles wy = is_safe ? newton * (cxy * ax + cyy * ay + cyz * az) : scalar * ay;
  const Doubles wz = is_safe ? newton * (cxz * ax + cyz * ay + czz * az) : scalar * az;
  const Doubles hx = 0.5 * wx;
  const Doubles hy = 0.5 * wy;
  const Doubles hz = 0.5 * wz;
  const auto [w, x, y, z] = turns.q;
  turns = {{w - x * hx - y * hy - z * hz, x + w * hx + y * hz - z * hy,
            y + w * hy + z * hx - x * hz, z + w * hz + x * hy - y * hx}};
  return wx * wx + wy * wy + wz * wz;
}

/// Computes the rotation anew, from the last fit, in the lanes that have not converged. These are
/// few: half turns, where the step has length 0 as well, and cells whose covariance is that of a
/// line, a point or a reflection, for which several rotations may be equally good.
[[gnu::cold, gnu::noinline]] void settle(const Covariances& s, const Integers& is_settled,
                                         const Quaternion* last_fit, Index first, Index last,
                                         Turns& turns) {
  for (int lane = 0; lane < 4 && first + lane < last; ++lane) {
    if (is_settled[lane] != 0) continue;
    double covariance[3][3];
    for (int c = 0; c < 3; ++c) {
      for (int d = 0; d < 3; ++d) covariance[c][d] = s.s[c][d][lane];
    }
    put(best_rotation(covariance, last_fit[first + lane], quaternion(turns, lane)), lane, turns);
  }
}

void fit(const Covariance* covariances, Quaternion* fitted, Index first, Index last) {
  constexpr int most_steps = 8;
  constexpr double small_step =
      1e-7;  // squared; the remaining error is about the square of the step
  for (Index i = first; i < last; i += 4) {
    Covariances s;
    Turns turns;
    for (int lane = 0; lane < 4; ++lane) {
      const Index at = i + lane < last ? i + lane : last - 1;
      const Rows rows = rows_of(covariances[at]);
      for (int d = 0; d < 3; ++d) {
        s.s[0][d][lane] = rows.x[d];
        s.s[1][d][lane] = rows.y[d];
        s.s[2][d][lane] = rows.z[d];
      }
      put(fitted[at], lane, turns);
    }
    // Scale each covariance to its largest entry, so that its powers stay in range.
    Doubles largest{};
    for (auto& row : s.s) {
      for (const Doubles& value : row) largest = larger(largest, value > 0 ? value : -value);
    }
    const Integers is_usable = (largest > 1e-250) & (largest < 1e250);
    const Doubles scale = is_usable ? 1 / largest : Doubles{};
    for (auto& row : s.s) {
      for (Doubles& value : row) value = is_usable ? scale * value : Doubles{};
    }
    Integers is_settled{};
    for (int step = 0; step < most_steps; ++step) {
      Integers is_maximum;
      const Integers has_stopped = turn_once(s, turns, is_maximum) <= small_step;
      is_settled = (has_stopped & is_maximum) | ~is_usable;
      if (all(has_stopped)) break;
    }
    const Doubles norm = 1 / root(squared_norm(turns));
    for (Doubles& q : turns.q) q *= norm;
    if (!all(is_settled)) settle(s, is_settled, fitted, i, last, turns);
    for (int lane = 0; lane < 4 && i + lane < last; ++lane) {
      fitted[i + lane] = quaternion(turns, lane);
    }
  }
}

[[gnu::always_inline]] inline double sum_of(Doubles v) { return (v[0] + v[1]) + (v[2] + v[3]); }

void blend(const OperatorData& weights, const Index* cluster_of, const Quaternion* of_clusters,
           Quaternion* rotations, Index first, Index last) {
  const auto turn_of = [&](Index cluster) { return load(&of_clusters[cluster].w); };
  for (Index i = first; i < last; ++i) {
    const Doubles own = turn_of(cluster_of[i]);
    Doubles sum{};
    for (Index e = weights.offsets[i]; e < weights.offsets[i + 1]; ++e) {
      const Doubles other = turn_of(weights.columns[e]);
      // q and -q are the same rotation.
      sum += (sum_of(own * other) < 0 ? -weights.values[e] : weights.values[e]) * other;
    }
    store(&rotations[i].w, sum / __builtin_sqrt(sum_of(sum * sum)));
  }
}

template <int fields>
void multiply_fields(const OperatorData& k, const Vector3* x, const Index* rows, Vector3* products,
                     Index first, Index last) {
  for (Index n = first; n < last; ++n) {
    const Index i = rows != nullptr ? rows[n] : n;
    Doubles sums[fields] = {};
    for (Index e = k.offsets[i]; e < k.offsets[i + 1]; ++e) {
      const Vector3* other = x + static_cast<std::ptrdiff_t>(k.columns[e]) * fields;
      for (int f = 0; f < fields; ++f) sums[f] += k.values[e] * quad(other + f);
    }
    const double scale = k.scale != nullptr ? k.scale[i] : 1;
    Vector3* product = products + static_cast<std::ptrdiff_t>(n) * fields;
    for (int f = 0; f < fields; ++f) quad(product + f) = scale * sums[f];
  }
}

void multiply(const OperatorData& k, const Vector3* x, int fields, const Index* rows,
              Vector3* products, Index first, Index last) {
  const auto multiply_them = fields == 1 ? multiply_fields<1> : multiply_fields<3>;
  multiply_them(k, x, rows, products, first, last);
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
void turn_fields(const Quaternion* rotations, bool back, const Vector3* values, Vector3* turned,
                 Index first, Index last) {
  const double sign = back ? -1 : 1;
  for (Index i = first; i < last; ++i) {
    const Quaternion& q = rotations[i];
    const Matrix columns = matrix_of(Quaternion{q.w, sign * q.x, sign * q.y, sign * q.z});
    for (int f = 0; f < fields; ++f) {
      const std::ptrdiff_t row = fields * static_cast<std::ptrdiff_t>(i) + f;
      const Vector3& v = values[row];
      quad(turned + row) = v.x * columns.x + v.y * columns.y + v.z * columns.z;
    }
  }
}

void turn(const Quaternion* rotations, bool back, const Vector3* values, int fields,
          Vector3* turned, Index first, Index last) {
  const auto turn_them = fields == 1 ? turn_fields<1> : turn_fields<3>;
  turn_them(rotations, back, values, turned, first, last);
}

}  // namespace

extern const RotationKernels rotation_kernels;
const RotationKernels rotation_kernels = {measure, add_lists, fit, blend, multiply, turn};

}  // namespace dynmesh::DYNMESH_KERNELS
