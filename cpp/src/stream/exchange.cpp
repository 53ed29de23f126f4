#include <atomic>

#include "stream/stream.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

template <class Real>
bool is_packed(const Points<Real>& rows) {
  return rows.row_stride == 3 && rows.column_stride == 1;
}

}  // namespace

template <class Real>
Exchange<Real>::Exchange(const Numbering& numbering, Workers& workers)
    : numbering_(numbering), workers_(workers), kernels_(best_kernels().rows<Real>()) {}

template <class Real>
bool Exchange<Real>::read(Points<const Real> rows, KnownMask known, std::span<Vector3<Real>> points,
                          std::span<std::uint8_t> is_known) {
  const auto k = static_cast<Index>(points.size());
  const Index* caller_indices =
      numbering_.is_natural() ? nullptr : numbering_.caller_indices.data();
  std::atomic<bool> in_range{true};
  workers_.for_each_chunk(k, [&](Index first, Index last) {
    bool good = true;
    if (is_packed(rows) && (known.data == nullptr || known.stride == 1)) {
      const PackedRows<const Real> packed = {rows.data, caller_indices};
      good = kernels_.read(packed, known.data, largest_coordinate<Real>, first, last, &points[0].x,
                           is_known.data());
    } else {
      for (auto internal = static_cast<std::size_t>(first);
           internal < static_cast<std::size_t>(last); ++internal) {
        const std::size_t i = numbering_.caller_index(internal);
        const Vector3<Real> point = row(rows, i);
        const bool observed = known.data == nullptr ? is_finite(point) : known[i];
        is_known[internal] = observed ? 1 : 0;
        points[internal] = point;
        good = good && (!observed || is_in_range(point));
      }
    }
    if (!good) in_range.store(false, std::memory_order_relaxed);
  });
  return in_range;
}

template <class Real>
void Exchange<Real>::write(std::span<Vector3<Real>> points, std::span<const Vector3<Real>> previous,
                           Points<Real> rows) {
  const auto k = static_cast<Index>(points.size());
  const Index* caller_indices =
      numbering_.is_natural() ? nullptr : numbering_.caller_indices.data();
  workers_.for_each_chunk(k, [&](Index first, Index last) {
    if (is_packed(rows)) {
      kernels_.write(&points[0].x, &previous[0].x, largest_coordinate<Real>, first, last,
                     {rows.data, caller_indices});
      return;
    }
    for (auto internal = static_cast<std::size_t>(first); internal < static_cast<std::size_t>(last);
         ++internal) {
      const std::size_t row = numbering_.caller_index(internal);
      if (!is_in_range(points[internal])) points[internal] = previous[internal];
      rows(row, 0) = points[internal].x;
      rows(row, 1) = points[internal].y;
      rows(row, 2) = points[internal].z;
    }
  });
}

template class Exchange<float>;
template class Exchange<double>;

}  // namespace dynmesh
