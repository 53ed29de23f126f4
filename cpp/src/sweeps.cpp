#include "sweeps.hpp"

// Compiled several times with different instructions, each in a namespace of its own. Nothing here
// may be instantiated elsewhere too, or the linker could choose the wrong one: so no templates and
// no inline functions of the standard library.
#ifndef DYNMESH_SWEEPS
#define DYNMESH_SWEEPS portable
#endif

namespace dynmesh::DYNMESH_SWEEPS {
namespace {

template <class Real>
struct Lanes;
template <>
struct Lanes<float> {
  using Quad [[gnu::vector_size(16), gnu::may_alias]] = float;
  using Bits [[gnu::vector_size(16), gnu::may_alias]] = std::int32_t;
};
template <>
struct Lanes<double> {
  using Quad [[gnu::vector_size(32), gnu::may_alias]] = double;
  using Bits [[gnu::vector_size(32), gnu::may_alias]] = std::int64_t;
};
template <class Real>
using Quad = typename Lanes<Real>::Quad;
template <class Real>
using Bits = typename Lanes<Real>::Bits;

template <class Real>
[[gnu::always_inline]] inline const Quad<Real>& quad(const Real* quads, std::uint32_t offset) {
  return *reinterpret_cast<const Quad<Real>*>(reinterpret_cast<const char*>(quads) + offset);
}
template <class Real>
[[gnu::always_inline]] inline Quad<Real>& quad_of(Real* quads, Index vertex) {
  return reinterpret_cast<Quad<Real>*>(quads)[vertex];
}
template <class Real>
[[gnu::always_inline]] inline const Quad<Real>& quad_of(const Real* quads, Index vertex) {
  return reinterpret_cast<const Quad<Real>*>(quads)[vertex];
}
template <int place, class Vector>
[[gnu::always_inline]] inline Vector spread(Vector v) {
  return __builtin_shufflevector(v, v, place, place, place, place);
}
template <class Vector>
[[gnu::always_inline]] inline Vector larger(Vector a, Vector b) {
  return a > b ? a : b;
}

/// s_ij of up to four neighbours, as Motion::inverse_squared_distance.
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
  const Quad<Real> x = __builtin_shufflevector(ab_xy, cd_xy, 0, 1, 4, 5) * data.inverse_mean_edge;
  const Quad<Real> y = __builtin_shufflevector(ab_xy, cd_xy, 2, 3, 6, 7) * data.inverse_mean_edge;
  const Quad<Real> z = __builtin_shufflevector(ab_z, cd_z, 0, 1, 4, 5) * data.inverse_mean_edge;
  const Quad<Real> floor = Quad<Real>{} + Real(1e-12);
  const Quad<Real> ceiling = Quad<Real>{} + Real(1e24);
  const Quad<Real> length = larger(x * x + y * y + z * z, floor);
  return Real(1) / (length < ceiling ? length : ceiling);
}

/// The sum of s_ij times the estimate over four places.
template <class Real>
[[gnu::always_inline]] inline Quad<Real> sum_of(const Real* estimates,
                                                const std::uint32_t* neighbours, Quad<Real> s,
                                                Quad<Real> sum) {
  sum += spread<0>(s) * quad(estimates, neighbours[0]);
  sum += spread<1>(s) * quad(estimates, neighbours[1]);
  sum += spread<2>(s) * quad(estimates, neighbours[2]);
  sum += spread<3>(s) * quad(estimates, neighbours[3]);
  return sum;
}

/// The same over a cell of any size, s_ij anew each time.
template <class Real>
Quad<Real> sum_of_wide(const SweepData<Real>& data, Index j) {
  constexpr std::uint32_t size = sizeof(Quad<Real>);
  Quad<Real> sum{};
  const Index end = data.cell_offsets[j + 1];
  for (Index i = data.cell_offsets[j]; i < end; i += 4) {
    std::uint32_t neighbours[4];
    Quad<Real> taken{};
    for (Index place = 0; place < 4; ++place) {
      const bool is_taken = i + place < end;
      const Index neighbour = is_taken ? data.cell_neighbours[i + place] : j;
      neighbours[place] = size * static_cast<std::uint32_t>(neighbour);
      taken[place] = is_taken ? Real(1) : Real(0);
    }
    const auto s = inverse_squared_distances(data, neighbours, quad_of(data.previous, j));
    sum = sum_of(data.before, neighbours, s * taken, sum);
  }
  return sum;
}

/// Eq. (4) after the sums, divided by t + 1 for the next iteration. Returns -1 in all lanes if the
/// vertex is reached, else 0.
template <class Real>
[[gnu::always_inline]] inline Bits<Real> settle(const SweepData<Real>& data, Index j,
                                                Quad<Real> sum, Real next_share) {
  constexpr Real smallest = sizeof(Real) == 4 ? Real(1.2e-38) : Real(2.3e-308);
  const Quad<Real> denominator = spread<3>(sum);
  const Bits<Real> reached = denominator > Real(0);
  const Quad<Real> one = Quad<Real>{} + Real(1);
  const Quad<Real> visits =
      reinterpret_cast<Quad<Real>>(reinterpret_cast<Bits<Real>>(one) & reached) + data.visits[j];
  data.visits[j] = visits[0];
  // Where nothing is reached, sum and visits are zero and so is this.
  const Quad<Real> scale = visits * next_share / larger(denominator, Quad<Real>{} + smallest);
  quad_of(data.after, j) = sum * scale;
  return reached;
}

template <class Real>
Rows prepare(const SweepData<Real>& arrays, Index first, Index last) {
  const SweepData<Real> data = arrays;  // which no write below can change
  Rows rows = {first, last, 0, 0};
  for (Index v = first; v < last; ++v) {
    const Index known = data.known[v];  // 0 or 1
    Quad<Real> motion = quad_of<Real>(data.points, v) - quad_of(data.previous, v);
    motion[3] = Real(1);
    const Bits<Real> all = Bits<Real>{} - known;
    motion = reinterpret_cast<Quad<Real>>(reinterpret_cast<Bits<Real>>(motion) & all);
    quad_of(data.before, v) = motion;
    quad_of(data.after, v) = motion;
    data.visits[v] = Real(0);
    data.generation[v] = 0;

    const Index narrow = data.valence[v] <= places ? 1 : 0;
    data.rows[first + rows.narrow] = v;
    rows.narrow += (1 - known) & narrow;
    if (__builtin_expect((1 - known) & (1 - narrow), 0)) data.rows[last - ++rows.wide] = v;
  }
  return rows;
}

template <class Real>
Index first_sweep(const SweepData<Real>& arrays, const Rows& of_rows) {
  const SweepData<Real> data = arrays;  // which no write below can change
  const Rows rows = of_rows;
  alignas(sizeof(Quad<Real>)) static constexpr Real taken[16] = {1, 1, 1, 1, 1, 1, 1, 1};
  using Unaligned [[gnu::aligned(sizeof(Real)), gnu::may_alias]] = Quad<Real>;
  const Real next_share = Real(1) / Real(2);
  Bits<Real> reached{};
  for (Index r = rows.first; r < rows.first + rows.narrow; ++r) {
    const Index j = data.rows[r];
    const std::uint32_t* neighbours = data.neighbours + places * static_cast<std::size_t>(j);
    Quad<Real>* weights =
        reinterpret_cast<Quad<Real>*>(data.weights + places * static_cast<std::size_t>(j));
    const Real* is_taken = taken + (places - data.valence[j]);  // slides ones out, zeros in
    const Quad<Real> v_j = quad_of(data.previous, j);
    weights[0] = inverse_squared_distances(data, neighbours, v_j) *
                 *reinterpret_cast<const Unaligned*>(is_taken);
    weights[1] = inverse_squared_distances(data, neighbours + 4, v_j) *
                 *reinterpret_cast<const Unaligned*>(is_taken + 4);
    const Quad<Real> low = sum_of<Real>(data.before, neighbours, weights[0], Quad<Real>{});
    const Quad<Real> high = sum_of<Real>(data.before, neighbours + 4, weights[1], Quad<Real>{});
    reached -= settle(data, j, low + high, next_share);
  }
  for (Index r = rows.last - rows.wide; r < rows.last; ++r) {
    const Index j = data.rows[r];
    reached -= settle(data, j, sum_of_wide(arrays, j), next_share);
  }
  return static_cast<Index>(reached[0]);
}

template <class Real>
Index next_sweep(const SweepData<Real>& arrays, const Rows& of_rows, Index t) {
  const SweepData<Real> data = arrays;  // which no write below can change
  const Rows rows = of_rows;
  const Real next_share = Real(1) / static_cast<Real>(t + 1);
  Bits<Real> reached{};
  for (Index r = rows.first; r < rows.first + rows.narrow; ++r) {
    const Index j = data.rows[r];
    const std::uint32_t* neighbours = data.neighbours + places * static_cast<std::size_t>(j);
    const Quad<Real>* weights =
        reinterpret_cast<const Quad<Real>*>(data.weights + places * static_cast<std::size_t>(j));
    const Quad<Real> low = sum_of<Real>(data.before, neighbours, weights[0], Quad<Real>{});
    const Quad<Real> high = sum_of<Real>(data.before, neighbours + 4, weights[1], Quad<Real>{});
    reached -= settle(data, j, low + high, next_share);
  }
  for (Index r = rows.last - rows.wide; r < rows.last; ++r) {
    const Index j = data.rows[r];
    reached -= settle(data, j, sum_of_wide(arrays, j), next_share);
  }
  return static_cast<Index>(reached[0]);
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
  for (Index r = rows.first; r < rows.first + rows.narrow; ++r) {
    finish_row(data, data.rows[r], iterations);
  }
  for (Index r = rows.last - rows.wide; r < rows.last; ++r) {
    finish_row(data, data.rows[r], iterations);
  }
}

}  // namespace

extern const Sweeps<float> of_floats;
extern const Sweeps<double> of_doubles;
const Sweeps<float> of_floats = {prepare<float>, first_sweep<float>, next_sweep<float>,
                                 finish<float>};
const Sweeps<double> of_doubles = {prepare<double>, first_sweep<double>, next_sweep<double>,
                                   finish<double>};

}  // namespace dynmesh::DYNMESH_SWEEPS
