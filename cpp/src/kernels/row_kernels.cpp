#include "kernels/lanes.hpp"
#include "kernels/sweeps.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

template <class Real>
using AnyRow [[gnu::aligned(sizeof(Real)), gnu::may_alias]] = Quad<Real>;

template <class Real>
[[gnu::always_inline]] inline Quad<Real> load_row(const Real* row, bool is_last) {
  Quad<Real> point = {row[0], row[1], row[2], Real(0)};
  if (!is_last) {  // a single load takes the number after it as well
    point = *reinterpret_cast<const AnyRow<Real>*>(row);
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
    *reinterpret_cast<AnyRow<Real>*>(rows + 3 * static_cast<std::size_t>(v)) = point_of(v);
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

}  // namespace

extern const RowKernels<float> row_kernels_of_floats;
extern const RowKernels<double> row_kernels_of_doubles;
const RowKernels<float> row_kernels_of_floats = {read<float>, write<float>};
const RowKernels<double> row_kernels_of_doubles = {read<double>, write<double>};

}  // namespace dynmesh::DYNMESH_KERNELS
