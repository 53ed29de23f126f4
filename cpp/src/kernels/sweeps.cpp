#include "kernels/sweeps.hpp"

#include "kernels/lanes.hpp"
#include "support/length_limits.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

/// Returns 1 / |v_i - v_j|^2 as MotionOnce, for one neighbour in each lane
/// of `x`, `y` and `z`, the components of the distances.
template <class Real, class Vector>
[[gnu::always_inline]] inline Vector inverse_squares(Vector x, Vector y, Vector z, Real scale) {
  x *= scale;
  y *= scale;
  z *= scale;
  const Vector floor = Vector{} + Real(squared_length_floor);
  const Vector ceiling = Vector{} + Real(squared_length_ceiling);
  const Vector length = larger(x * x + y * y + z * z, floor);
  return Real(1) / (length < ceiling ? length : ceiling);
}

/// Returns s_ij of four neighbours.
template <class Real>
[[gnu::always_inline]] inline Quad<Real> inverse_squared_distances(const SweepData<Real>& data,
                                                                   const std::uint32_t* neighbours,
                                                                   Quad<Real> v_j) {
  const Quad<Real> a = quad(data.previous, neighbours[0]) - v_j;
  const Quad<Real> b = quad(data.previous, neighbours[1]) - v_j;
  const Quad<Real> c = quad(data.previous, neighbours[2]) - v_j;
  const Quad<Real> d = quad(data.previous, neighbours[3]) - v_j;
  const auto ab_xy = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const auto ab_z = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const auto cd_xy = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const auto cd_z = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  return inverse_squares<Real, Quad<Real>>(__builtin_shufflevector(ab_xy, cd_xy, 0, 1, 4, 5),
                                           __builtin_shufflevector(ab_xy, cd_xy, 2, 3, 6, 7),
                                           __builtin_shufflevector(ab_z, cd_z, 0, 1, 4, 5),
                                           data.inverse_mean_edge);
}

/// Computes s_ij of eight neighbours, and 0 for empty slots.
template <class Real>
[[gnu::always_inline]] inline void weigh(const SweepData<Real>& data, Index j,
                                         const std::uint32_t* neighbours, Quad<Real>* weights) {
  alignas(sizeof(Quad<Real>)) static constexpr Real ones_and_zeros[16] = {1, 1, 1, 1, 1, 1, 1, 1};
  using Unaligned [[gnu::aligned(sizeof(Real)), gnu::may_alias]] = Quad<Real>;
  const Real* taken = ones_and_zeros + (slots - data.valence[j]);
  const Quad<Real> v_j = quad_of(data.previous, j);
  for (int half = 0; half < 2; ++half) {
    weights[half] = inverse_squared_distances(data, neighbours + 4 * half, v_j) *
                    *reinterpret_cast<const Unaligned*>(taken + 4 * half);
  }
}

#ifdef __AVX__
using Octet [[gnu::vector_size(32), gnu::may_alias]] = float;

[[gnu::always_inline]] inline Octet pair(Quad<float> low, Quad<float> high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// The same, with vectors of eight numbers.
template <>
[[gnu::always_inline]] inline void weigh(const SweepData<float>& data, Index j,
                                         const std::uint32_t* neighbours, Quad<float>* weights) {
  static constexpr float ones_and_zeros[16] = {1, 1, 1, 1, 1, 1, 1, 1};
  using Unaligned [[gnu::aligned(4), gnu::may_alias]] = Octet;
  const Octet v_j = pair(quad_of(data.previous, j), quad_of(data.previous, j));
  const auto edges_to = [&](int low, int high) {
    return pair(quad(data.previous, neighbours[low]), quad(data.previous, neighbours[high])) - v_j;
  };
  const Octet a = edges_to(0, 4);
  const Octet b = edges_to(1, 5);
  const Octet c = edges_to(2, 6);
  const Octet d = edges_to(3, 7);
  const auto ab_xy = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
  const auto ab_z = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  const auto cd_xy = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
  const auto cd_z = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
  const Octet s = inverse_squares<float, Octet>(
      __builtin_shufflevector(ab_xy, cd_xy, 0, 1, 8, 9, 4, 5, 12, 13),
      __builtin_shufflevector(ab_xy, cd_xy, 2, 3, 10, 11, 6, 7, 14, 15),
      __builtin_shufflevector(ab_z, cd_z, 0, 1, 8, 9, 4, 5, 12, 13), data.inverse_mean_edge);
  const float* taken = ones_and_zeros + (slots - data.valence[j]);
  *reinterpret_cast<Unaligned*>(weights) = s * *reinterpret_cast<const Unaligned*>(taken);
}
#endif

/// Adds s_ij times the estimate for two or four slots.
template <int count, class Real>
[[gnu::always_inline]] inline Quad<Real> sum_of(const Real* estimates,
                                                const std::uint32_t* neighbours, Quad<Real> s,
                                                Quad<Real> sum) {
  sum += spread<0>(s) * quad(estimates, neighbours[0]);
  sum += spread<1>(s) * quad(estimates, neighbours[1]);
  if constexpr (count == 2) return sum;
  sum += spread<2>(s) * quad(estimates, neighbours[2]);
  sum += spread<3>(s) * quad(estimates, neighbours[3]);
  return sum;
}

/// Returns that of a cell with at most `taken` neighbours.
template <int taken, class Real>
[[gnu::always_inline]] inline Quad<Real> sum_of_cell(const Real* estimates,
                                                     const std::uint32_t* neighbours,
                                                     const Quad<Real>* weights) {
  return sum_of<4>(estimates, neighbours, weights[0], Quad<Real>{}) +
         sum_of<taken - 4>(estimates, neighbours + 4, weights[1], Quad<Real>{});
}

/// Returns the same sum over a cell of any size, whose weights are found first in iteration 1.
template <bool is_first, class Real>
Quad<Real> sum_of_wide(const SweepData<Real>& data, Index j) {
  const std::uint32_t* range = data.neighbours + slots * static_cast<std::size_t>(j);
  Quad<Real> sum{};
  for (std::uint32_t i = range[0]; i < range[1]; i += 4) {
    const std::uint32_t* neighbours = data.wide_neighbours + i;
    auto& weights = *reinterpret_cast<Quad<Real>*>(data.wide_weights + i);
    if (is_first) {
      weights = inverse_squared_distances(data, neighbours, quad_of(data.previous, j));
      for (std::uint32_t slot = 0; slot < 4; ++slot) {
        if (i + slot >= range[2]) weights[slot] = Real(0);
      }
    }
    sum = sum_of<4>(data.before, neighbours, weights, sum);
  }
  return sum;
}

/// Completes eq. (4) after the sums, divided by t + 1 for the next iteration. Returns -1 in all
/// lanes if the vertex is reached, and 0 otherwise.
template <class Real>
[[gnu::always_inline]] inline Bits<Real> settle(const SweepData<Real>& data, Index j,
                                                Quad<Real> sum, Real visits_before,
                                                Real next_share) {
  constexpr Real smallest = sizeof(Real) == 4 ? Real(1.2e-38) : Real(2.3e-308);
  const Quad<Real> denominator = spread<3>(sum);
  const Bits<Real> reached = denominator > Real(0);
  const Quad<Real> one = Quad<Real>{} + Real(1);
  const Quad<Real> visits =
      reinterpret_cast<Quad<Real>>(reinterpret_cast<Bits<Real>>(one) & reached) + visits_before;
  data.visits[j] = visits[0];
  // If the vertex is not reached, sum and visits are zero, and so is this.
  const Quad<Real> scale = visits * next_share / larger(denominator, Quad<Real>{} + smallest);
  quad_of(data.after, j) = sum * scale;
  return reached;
}

template <class Real>
Rows prepare(const SweepData<Real>& arrays, const Rows& chunk_rows) {
  const SweepData<Real> data = arrays;  // which no write below can change
  Rows rows = chunk_rows;
  Index* front = data.rows + rows.first;
  Index* back = data.rows + rows.last - 1;
  for (Index v = rows.first; v < rows.last; ++v) {
    const Index known = data.known[v];  // 0 or 1
    Quad<Real> motion = quad_of<Real>(data.points, v) - quad_of<Real>(data.previous, v);
    motion[3] = Real(1);
    const Bits<Real> all = Bits<Real>{} - known;
    motion = reinterpret_cast<Quad<Real>>(reinterpret_cast<Bits<Real>>(motion) & all);
    quad_of(data.before, v) = motion;
    quad_of(data.after, v) = motion;
    data.generation[v] = 0;
    // Both places are free, since this vertex is not listed yet.
    *front = v;
    *back = v;
    const Index valence = data.valence[v];
    const Index is_usual = valence <= usual_slots ? 1 : 0;
    front += (1 - known) & is_usual;
    back -= (1 - known) & (1 - is_usual) & (valence <= slots ? 1 : 0);
  }
  rows.usual = static_cast<Index>(front - (data.rows + rows.first));
  rows.narrow = static_cast<Index>(data.rows + rows.last - 1 - back);
  rows.wide = 0;
  for (Index w = rows.first_wide; w < rows.last_wide; ++w) {
    const Index v = data.wide[w];
    if (data.known[v] == 0) front[rows.wide++] = v;
  }
  return rows;
}

/// Executes an iteration for some of the rows, whose cells have at most `taken` neighbours.
template <int taken, bool is_first, class Real>
[[gnu::always_inline]] inline Bits<Real> sweep_rows(const SweepData<Real>& data, Index first,
                                                    Index last, Real next_share) {
  Bits<Real> reached{};
  for (Index r = first; r < last; ++r) {
    const Index j = data.rows[r];
    const std::uint32_t* neighbours = data.neighbours + slots * static_cast<std::size_t>(j);
    auto* weights =
        reinterpret_cast<Quad<Real>*>(data.weights + slots * static_cast<std::size_t>(j));
    if (is_first) weigh<Real>(data, j, neighbours, weights);
    const Quad<Real> sum = sum_of_cell<taken>(data.before, neighbours, weights);
    reached -= settle(data, j, sum, is_first ? Real(0) : data.visits[j], next_share);
  }
  return reached;
}

template <bool is_first, class Real>
[[gnu::always_inline]] inline Index sweep_chunk(const SweepData<Real>& arrays, const Rows& of_rows,
                                                Index t) {
  const SweepData<Real> data = arrays;  // which no write below can change
  const Rows rows = of_rows;
  const Real next_share = Real(1) / static_cast<Real>(t + 1);
  const Index first_wide = rows.first + rows.usual;
  Bits<Real> reached =
      sweep_rows<usual_slots, is_first>(data, rows.first, rows.first + rows.usual, next_share);
  reached += sweep_rows<slots, is_first>(data, rows.last - rows.narrow, rows.last, next_share);
  for (Index r = first_wide; r < first_wide + rows.wide; ++r) {
    const Index j = data.rows[r];
    const Real visits = is_first ? Real(0) : data.visits[j];
    reached -= settle(data, j, sum_of_wide<is_first>(arrays, j), visits, next_share);
  }
  return static_cast<Index>(reached[0]);
}

template <class Real>
Index sweep(const SweepData<Real>& data, const Rows& rows, Index t) {
  return t == 1 ? sweep_chunk<true>(data, rows, t) : sweep_chunk<false>(data, rows, t);
}

template <class Real>
void finish_row(const SweepData<Real>& data, Index j, Index iterations) {
  if (data.visits[j] == Real(0)) {
    data.generation[j] = -1;
    return;
  }
  data.generation[j] = iterations + 1 - static_cast<Index>(data.visits[j]);
  const Quad<Real> estimate = quad_of<Real>(data.before, j);
  Quad<Real> motion = estimate / spread<3>(estimate);
  motion[3] = Real(0);
  quad_of(data.points, j) = quad_of(data.previous, j) + motion;  // eq. (3)
}

template <class Real>
void finish(const SweepData<Real>& arrays, const Rows& of_rows, Index iterations) {
  const SweepData<Real> data = arrays;  // which no write below can change
  const Rows rows = of_rows;
  for (Index r = rows.first; r < rows.first + rows.usual + rows.wide; ++r) {
    finish_row(data, data.rows[r], iterations);
  }
  for (Index r = rows.last - rows.narrow; r < rows.last; ++r) {
    finish_row(data, data.rows[r], iterations);
  }
}

template <class Real>
[[gnu::always_inline]] inline Quad<Real> load_row(const Real* row, bool is_last) {
  Quad<Real> point = {row[0], row[1], row[2], Real(0)};
  if (!is_last) {  // a single load takes the number after it as well
    __builtin_memcpy(&point, row, sizeof point);
    point[3] = Real(0);
  }
  return point;
}

template <class Real>
[[gnu::always_inline]] inline void put_row(Real* rows, Index v, Quad<Real> point) {
  for (int c = 0; c < 3; ++c) rows[3 * static_cast<std::size_t>(v) + c] = point[c];
}

template <class Real>
bool read(const Real* rows, const std::uint8_t* observed, Real limit, Index first, Index last,
          Real* points, std::uint8_t* known) {
  constexpr Real largest = sizeof(Real) == 4 ? Real(3.4028234e38) : Real(1.7976931348623157e308);
  if (observed != nullptr) {
    for (Index v = first; v < last; ++v) known[v] = observed[v] != 0 ? 1 : 0;
  }
  Bits<Real> beyond{};
  const auto store = [&](Index v, bool is_last) {
    const Quad<Real> point = load_row(rows + 3 * static_cast<std::size_t>(v), is_last);
    if (observed == nullptr) {
      const Bits<Real> finite = within<Real>(point, largest);
      known[v] = static_cast<std::uint8_t>(finite[0] & finite[1] & finite[2] & 1);
    }
    quad_of(points, v) = point;
    beyond |= ~within<Real>(point, limit) & (Bits<Real>{} - Index{known[v]});
  };
  for (Index v = first; v < last - 1; ++v) store(v, false);
  store(last - 1, true);
  return (beyond[0] | beyond[1] | beyond[2]) == 0;
}

template <class Real>
void write(Real* points, const Real* previous, Real limit, Index first, Index last, Real* rows) {
  Bits<Real> beyond{};
  const auto point_of = [&](Index v) {
    const Quad<Real> point = quad_of<Real>(points, v);
    beyond |= ~within<Real>(point, limit);
    return point;
  };
  // Each row takes one store, which spills into the next row before that is written.
  for (Index v = first; v < last - 1; ++v) {
    const Quad<Real> point = point_of(v);
    __builtin_memcpy(rows + 3 * static_cast<std::size_t>(v), &point, sizeof point);
  }
  put_row(rows, last - 1, point_of(last - 1));
  if (__builtin_expect((beyond[0] | beyond[1] | beyond[2]) == 0, 1)) return;
  for (Index v = first; v < last; ++v) {
    const Bits<Real> good = within<Real>(quad_of<Real>(points, v), limit);
    if ((good[0] & good[1] & good[2]) != 0) continue;
    quad_of(points, v) = quad_of(previous, v);
    put_row(rows, v, quad_of(previous, v));
  }
}

template <class Real>
constexpr Sweeps<Real> all_sweeps = {prepare<Real>, sweep<Real>, finish<Real>, read<Real>,
                                     write<Real>};

}  // namespace

extern const Sweeps<float> sweeps_of_floats;
extern const Sweeps<double> sweeps_of_doubles;
const Sweeps<float> sweeps_of_floats = all_sweeps<float>;
const Sweeps<double> sweeps_of_doubles = all_sweeps<double>;

}  // namespace dynmesh::DYNMESH_KERNELS
