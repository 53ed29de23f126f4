#include "kernels/lanes.hpp"
#include "kernels/sweeps.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

/// If rows are not in order, they are prefetched this many rows ahead.
constexpr Index ahead = 24;

/// Loads a row of three, by a single load if there are bytes after it.
template <class Real>
[[gnu::always_inline]] inline Quad<Real> load_row(const Real* row, bool is_last) {
  using Unaligned [[gnu::aligned(sizeof(Real)), gnu::may_alias]] = Quad<Real>;
  Quad<Real> point = {row[0], row[1], row[2], Real(0)};
  if (!is_last) {
    point = *reinterpret_cast<const Unaligned*>(row);
    point[3] = Real(0);
  }
  return point;
}

template <class Real>
[[gnu::always_inline]] inline void put_row(Real* data, Index row, Quad<Real> point) {
  Real* at = data + 3 * static_cast<std::size_t>(row);
  at[0] = point[0];
  at[1] = point[1];
  at[2] = point[2];
}

/// Reads one vertex. Returns ones in the lanes in which a known coordinate is beyond the limit.
template <class Real>
[[gnu::always_inline]] inline Bits<Real> read_one(Quad<Real> point, const std::uint8_t* observed,
                                                  Real limit, Index v, Real* points,
                                                  std::uint8_t* known) {
  constexpr Real largest = sizeof(Real) == 4 ? Real(3.4028234e38) : Real(1.7976931348623157e308);
  Index is_known = 0;
  if (observed != nullptr) {
    is_known = *observed != 0 ? 1 : 0;
  } else {
    const Bits<Real> finite = within<Real>(point, largest);
    is_known = static_cast<Index>(finite[0] & finite[1] & finite[2]) & 1;
  }
  known[v] = static_cast<std::uint8_t>(is_known);
  quad_of(points, v) = point;
  return ~within<Real>(point, limit) & (Bits<Real>{} - is_known);
}

template <class Real>
bool read(const PackedRows<const Real>& rows, const std::uint8_t* observed, Real limit, Index first,
          Index last, Real* points, std::uint8_t* known) {
  const Real* data = rows.data;
  const Index* row_of = rows.row_of;
  Bits<Real> beyond{};
  if (row_of == nullptr && observed != nullptr) {  // the usual case; its loop has no branch
    for (Index v = first; v < last; ++v) known[v] = observed[v] != 0 ? 1 : 0;
    const auto store = [&](Index v, Quad<Real> point) {
      quad_of(points, v) = point;
      beyond |= ~within<Real>(point, limit) & (Bits<Real>{} - Index{known[v]});
    };
    for (Index v = first; v < last - 1; ++v) {
      store(v, load_row(data + 3 * static_cast<std::size_t>(v), false));
    }
    store(last - 1, load_row(data + 3 * static_cast<std::size_t>(last - 1), true));
  } else {
    for (Index v = first; v < last; ++v) {
      const auto row = static_cast<std::size_t>(row_of != nullptr ? row_of[v] : v);
      if (row_of != nullptr && v + ahead < last) {
        const auto later = static_cast<std::size_t>(row_of[v + ahead]);
        __builtin_prefetch(data + 3 * later);
        if (observed != nullptr) __builtin_prefetch(observed + later);
      }
      const Quad<Real> point = load_row(data + 3 * row, row_of != nullptr || v + 1 == last);
      const std::uint8_t* of_row = observed != nullptr ? observed + row : nullptr;
      beyond |= read_one(point, of_row, limit, v, points, known);
    }
  }
  return (beyond[0] | beyond[1] | beyond[2]) == 0;
}

template <class Real>
void write(Real* points, const Real* previous, Real limit, Index first, Index last,
           const PackedRows<Real>& rows) {
  using Unaligned [[gnu::aligned(sizeof(Real)), gnu::may_alias]] = Quad<Real>;
  Real* data = rows.data;
  const Index* row_of = rows.row_of;
  Bits<Real> beyond{};
  if (row_of == nullptr) {
    // Each row takes one store, which spills into the next row before that is written.
    for (Index v = first; v < last - 1; ++v) {
      const Quad<Real> point = quad_of<Real>(points, v);
      beyond |= ~within<Real>(point, limit);
      *reinterpret_cast<Unaligned*>(data + 3 * static_cast<std::size_t>(v)) = point;
    }
  }
  for (Index v = row_of == nullptr ? last - 1 : first; v < last; ++v) {
    if (row_of != nullptr && v + ahead < last) {
      __builtin_prefetch(data + 3 * static_cast<std::size_t>(row_of[v + ahead]), 1);
    }
    const Quad<Real> point = quad_of<Real>(points, v);
    beyond |= ~within<Real>(point, limit);
    put_row(data, row_of != nullptr ? row_of[v] : v, point);
  }
  if (__builtin_expect((beyond[0] | beyond[1] | beyond[2]) == 0, 1)) return;
  for (Index v = first; v < last; ++v) {
    const Bits<Real> good = within<Real>(quad_of<Real>(points, v), limit);
    if ((good[0] & good[1] & good[2]) != 0) continue;
    quad_of(points, v) = quad_of(previous, v);
    put_row(data, row_of != nullptr ? row_of[v] : v, quad_of(previous, v));
  }
}

}  // namespace

extern const RowKernels<float> row_kernels_of_floats;
extern const RowKernels<double> row_kernels_of_doubles;
const RowKernels<float> row_kernels_of_floats = {read<float>, write<float>};
const RowKernels<double> row_kernels_of_doubles = {read<double>, write<double>};

}  // namespace dynmesh::DYNMESH_KERNELS
