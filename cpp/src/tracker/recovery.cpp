#include "tracker/recovery.hpp"

#include <algorithm>
#include <stdexcept>

#include "registration/register_measurement.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

double wrong_share(const Agreement& agreement) {
  return agreement.far_share + agreement.disagreeing;
}

}  // namespace

template <class Real>
Recovery<Real>::Recovery(const Frame& first_frame, const TrackerSettings& settings)
    : is_wanted_(settings.recover), threads_(settings.threads) {
  if (is_wanted_) good_ = first_frame;
}

/// The share of a frame without points is NaN.
template <class Real>
bool Recovery<Real>::is_due(const Agreement& agreement) const {
  return is_wanted_ && pause_ == 0 && agreement.far_share > TrackingConstants().lost_far;
}

template <class Real>
bool Recovery<Real>::improve(SurfaceTracking& surface, const PointScan& measurement,
                             SurfaceTracking::Found& found) const {
  const double lost = wrong_share(found.agreements.all);
  if (const auto start = registered(surface, measurement)) {
    Writer writer;
    surface.write_memory(writer);
    const auto memory = writer.take_sealed();
    const std::vector<Vector3<double>> last(surface.last().begin(), surface.last().end());
    const auto return_to_last = [&] {
      Reader reader(memory);
      surface.read_memory(reader, last);
    };
    surface.place(*start);
    try {
      found = surface.track(measurement);
    } catch (...) {
      return_to_last();
      throw;
    }
    if (wrong_share(found.agreements.all) < lost) return true;
    return_to_last();
  }
  found = surface.track(measurement);
  return false;
}

/// The last good shape where it was measured; none if there are too few points, or those of
/// something of another size.
template <class Real>
std::optional<std::vector<Vector3<double>>> Recovery<Real>::registered(
    const SurfaceTracking& surface, const PointScan& measurement) const {
  std::vector<Real> coordinates;
  for (const auto& x : good_) coordinates.insert(coordinates.end(), {x.x, x.y, x.z});
  const auto faces = surface.faces();
  std::vector<Vector3<double>> positions;
  try {
    const auto found = register_measurement<Real>({faces.data()->data(), faces.size()},
                                                  {coordinates.data(), good_.size()}, measurement,
                                                  {.threads = threads_});
    const Points<const Real> rows(found.vertices.data(), good_.size());
    for (std::size_t v = 0; v < rows.count; ++v) positions.push_back(in_double(row(rows, v)));
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
  return positions;
}

template <class Real>
void Recovery<Real>::remember(const Frame& completed, const Agreement& agreement,
                              bool was_due) noexcept {
  if (!is_wanted_) return;
  constexpr TrackingConstants constants;
  const bool is_good = agreement.far_share <= constants.lost_far;
  if (is_good) std::ranges::copy(completed, good_.begin());
  if (was_due) {
    pause_ = static_cast<std::uint8_t>(constants.frames_between_recoveries - 1);
  } else if (pause_ == until_good) {
    if (is_good) pause_ = 0;
  } else if (pause_ > 0) {
    --pause_;
  }
}

template <class Real>
void Recovery<Real>::write_memory(Writer& writer) const {
  if (!is_wanted_) return;
  writer.write(good_);
  writer.write(pause_);
}

template <class Real>
void Recovery<Real>::read_memory(Reader& reader) {
  if (!is_wanted_) return;
  reader.read(good_);
  pause_ = reader.read<std::uint8_t>();
  if (!std::ranges::all_of(good_, is_in_range<Real>) ||
      (pause_ != until_good && pause_ >= TrackingConstants().frames_between_recoveries)) {
    refuse_state("does not contain a valid last good frame");
  }
}

template class Recovery<float>;
template class Recovery<double>;

}  // namespace dynmesh
