#include "tracker/recovery.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "registration/register_measurement.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

double wrong_share(const Agreement& agreement) {
  return agreement.far_share + agreement.disagreeing;
}

}  // namespace

template <class Real>
Recovery<Real>::Recovery(SurfaceTracking& surface, const Numbering& numbering,
                         std::size_t n_vertices, const TrackerSettings& settings)
    : surface_(surface),
      numbering_(numbering),
      is_wanted_(settings.recover),
      threads_(settings.threads),
      none_good_(static_cast<std::uint8_t>(surface.constants().frames_between_recoveries)),
      good_(settings.recover ? n_vertices : 0),
      pause_(none_good_) {}

template <class Real>
void Recovery<Real>::begin(const Frame& first_frame) noexcept {
  if (is_wanted_) std::ranges::copy(first_frame, good_.begin());
  pause_ = none_good_;
}

/// The share of a frame without points is NaN.
template <class Real>
bool Recovery<Real>::is_due(const Agreement& agreement) const {
  return is_wanted_ && pause_ == 0 && agreement.far_share > surface_.constants().lost_far;
}

template <class Real>
bool Recovery<Real>::improve(const PointScan& measurement, SurfaceTracking::Found& found) {
  const double lost = wrong_share(found.agreements.all);
  surface_.undo();
  const auto start = registered(measurement);
  if (start) {
    Writer writer(surface_.memory_size() + sizeof(std::uint64_t));
    surface_.write_memory(writer);
    const auto bytes = writer.take_sealed();
    Reader reader(bytes);
    const auto memory = surface_.read_memory(reader);
    const std::vector<Vector3<double>> last(surface_.last().begin(), surface_.last().end());
    surface_.place(*start);
    try {
      found = surface_.track(measurement);
    } catch (...) {
      surface_.recall(memory, last);
      throw;
    }
    if (wrong_share(found.agreements.all) < lost) return true;
    surface_.undo();
    surface_.recall(memory, last);
  }
  found = surface_.track(measurement);
  return false;
}

/// The last good shape where it was measured; none if there are too few points, or those of
/// something of another size.
template <class Real>
std::optional<std::vector<Vector3<double>>> Recovery<Real>::registered(
    const PointScan& measurement) const {
  std::vector<Real> coordinates;
  for (const auto& x : good_) coordinates.insert(coordinates.end(), {x.x, x.y, x.z});
  const auto faces = surface_.faces();
  std::vector<Vector3<double>> positions(good_.size());
  try {
    const auto found = register_measurement<Real>({faces.data()->data(), faces.size()},
                                                  {coordinates.data(), good_.size()}, measurement,
                                                  {.threads = threads_});
    for (std::size_t v = 0; v < positions.size(); ++v) {
      const Real* x = &found.vertices[3 * v];
      positions[v] = {static_cast<double>(x[0]), static_cast<double>(x[1]),
                      static_cast<double>(x[2])};
    }
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
  return positions;
}

template <class Real>
void Recovery<Real>::remember(const Frame& completed, const Agreement& agreement,
                              bool was_due) noexcept {
  if (!is_wanted_) return;
  const auto& constants = surface_.constants();
  const bool is_good = agreement.far_share <= constants.lost_far;
  if (is_good) std::ranges::copy(completed, good_.begin());
  if (was_due) {
    pause_ = static_cast<std::uint8_t>(constants.frames_between_recoveries - 1);
  } else if (pause_ == none_good_) {
    if (is_good) pause_ = 0;
  } else if (pause_ > 0) {
    --pause_;
  }
}

template <class Real>
std::size_t Recovery<Real>::memory_size() const {
  return is_wanted_ ? good_.size() * 3 * sizeof(Real) + sizeof pause_ : 0;
}

template <class Real>
void Recovery<Real>::write_memory(Writer& writer) const {
  if (!is_wanted_) return;
  writer.write(to_caller_order(numbering_, good_));
  writer.write(pause_);
}

template <class Real>
typename Recovery<Real>::Memory Recovery<Real>::read_memory(Reader& reader) const {
  Memory memory;
  if (!is_wanted_) return memory;
  memory.good.resize(good_.size());
  reader.read(memory.good);
  memory.pause = reader.read<std::uint8_t>();
  if (!std::ranges::all_of(memory.good, is_in_range<Real>) || memory.pause > none_good_) {
    refuse_state("does not contain a valid last good frame");
  }
  memory.good = to_internal_order(numbering_, memory.good);
  return memory;
}

template <class Real>
void Recovery<Real>::recall(Memory memory) noexcept {
  good_ = std::move(memory.good);
  pause_ = memory.pause;
}

template class Recovery<float>;
template class Recovery<double>;

}  // namespace dynmesh
