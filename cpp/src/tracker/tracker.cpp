#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <dynmesh/registration.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "registration/pose_search.hpp"
#include "stream/arguments.hpp"
#include "stream/report_fields.hpp"
#include "stream/state.hpp"
#include "stream/stream.hpp"
#include "support/checks.hpp"
#include "support/geometry.hpp"
#include "support/stored_numbers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/scan_arguments.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
template <class Real>
constexpr StateKind kind = {{'d', 'y', 'n', 't', 'r', 'a', 'c', '9'}, "tracker", sizeof(Real)};

/// Refuses a first scan that lies elsewhere than the template. Later ones may show that
/// the subject has left.
void check_first_scan(const PointScan& scan, const SurfaceTracking::Found& found,
                      const SurfaceTracking& surface) {
  const double far_share = found.agreements.all.far_share;
  const double observed = static_cast<double>(std::ranges::count(found.observed, 1)) /
                          static_cast<double>(found.observed.size());
  const bool are_most_far = far_share > 0.5;  // false without points: the share is NaN
  if (!are_most_far || !(observed < surface.constants().least_observed_at_first)) return;
  const auto distance = std::sqrt(squared_norm(median_of(scan.points) - median_of(surface.last())));
  refuse("points", "the template is far from the first scan: it is more than a mean edge from ",
         to_text(100 * far_share, 3), " % of the points, and their middles are ",
         to_text(distance, 4), " apart, ", to_text(distance / surface.mean_edge(), 4),
         " mean edges of the template; both must be in the same axes and unit of length, and the ",
         "template in the pose of the scan");
}

double wrong_share(const Agreement& agreement) {
  return agreement.far_share + agreement.disagreeing;
}

}  // namespace

/// What a tracker does when the template is lost, see TrackerSettings::recover: it registers the
/// frame anew from the last good one. It is not in the anonymous namespace since
/// `Tracker::Parts`, which has external linkage, holds one.
class Recovery {
 public:
  using Frame = std::vector<Vector3<double>>;

  /// Begins a sequence. `mesh` must outlive this object.
  Recovery(StreamMesh& mesh, Frame first_frame, bool is_wanted)
      : mesh_(mesh), is_wanted_(is_wanted), good_(std::move(first_frame)) {}

  /// Whether a frame is to be registered anew. The share of one without points is NaN.
  [[nodiscard]] bool is_due(const Agreement& agreement) const {
    return is_wanted_ && pause_ == 0 && agreement.far_share > TrackingConstants().lost_far;
  }

  /// Registers it, and tracks it again from there. `found` is what the surface has just found, and
  /// becomes the better of both. Returns whether that is the new one; if not, nothing but time
  /// tells of the attempt. If it throws, the surface remembers the same as before.
  bool improve(SurfaceTracking& surface, const PointScan& measurement,
               SurfaceTracking::Found& found) const {
    const double lost = wrong_share(found.agreements.all);
    if (const auto start = registered(measurement)) {
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

  /// Remembers a frame, and whether it was registered anew.
  void remember(const Frame& completed, const Agreement& agreement, bool was_due) noexcept {
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

  /// What later frames depend on.
  void write_memory(Writer& writer) const {
    if (!is_wanted_) return;
    writer.write(good_);
    writer.write(pause_);
  }
  void read_memory(Reader& reader) {
    if (!is_wanted_) return;
    reader.read(good_);
    pause_ = reader.read<std::uint8_t>();
    if (!std::ranges::all_of(good_, is_in_range<double>) ||
        (pause_ != until_good && pause_ >= TrackingConstants().frames_between_recoveries)) {
      refuse_state("does not contain a valid last good frame");
    }
  }

 private:
  /// The last good shape where it was measured; none if there are too few points, or those of
  /// something of another size.
  [[nodiscard]] std::optional<Frame> registered(const PointScan& measurement) const {
    if (measurement.size() < TrackingConstants{}.fewest) return std::nullopt;
    const double ratio = size_of(measurement.points) / size_of(good_);
    if (!(std::max(ratio, 1 / ratio) <= AlignmentConstants{}.other_unit)) return std::nullopt;
    const Template good = {mesh_.faces, good_, {}};
    const RegistrationSettings settings;
    PoseSearch search(good, mesh_.topology, mesh_.workers, settings,
                      std::numeric_limits<double>::epsilon());
    return search.run(measurement, {}).x;
  }

  StreamMesh& mesh_;
  bool is_wanted_;
  Frame good_;  // the last frame that was not lost
  // The number of frames that are not registered. A scan that has been far from the surface from
  // the start may show other things beside it, so the first pause lasts until a frame is good.
  std::uint8_t pause_ = until_good;
  static constexpr std::uint8_t until_good = 255;
};

/// One sequence of frames, tracked after the public functions have checked the arguments.
template <class Real>
struct Tracker<Real>::Parts {
  using Frame = std::vector<Vector3<Real>>;

  Parts(std::shared_ptr<StreamMesh> of_all, const TrackerSettings& chosen, Frame first_frame)
      : mesh(std::move(of_all)),
        settings(chosen),
        stream(*mesh, std::move(first_frame), DisconnectedRule::follow),
        surface(mesh->faces, mesh->topology, mesh->workers, widened(stream.first_frame),
                TrackingConstants{}, mesh->training, settings.uncertainty,
                std::numeric_limits<Real>::epsilon()),
        recovery(*mesh, widened(stream.first_frame), settings.recover),
        completed(stream.n_vertices()) {
    stream.keep(surface.shape().error_bars().of_vertices());
    stream.count(report);
    Writer writer;
    write(writer);
    state_size = writer.take_sealed().size();
  }

  /// Finds the frame in what was measured. Only this can fail, and nothing that is kept between
  /// calls changes before it is done.
  TrackingReport track(const PointScan& measurement, Points<Real> tracked,
                       Clock::time_point start) {
    SurfaceTracking::Found found = surface.track(measurement);
    if (stream.n_frames == 0) check_first_scan(measurement, found, surface);
    const bool is_lost = recovery.is_due(found.agreements.all);
    const bool recovered = is_lost && recovery.improve(surface, measurement, found);
    std::ranges::copy(found.observed, stream.current_known.begin());
    stream.generations.classify(mesh->topology.cells, stream.current_known);
    const auto generation = stream.generations.of_vertices();
    for (std::size_t v = 0; v < stream.current.size(); ++v) {
      const Vector3<double>& x = found.x[v];
      const bool is_found = generation[v] != Generations::disconnected;
      stream.current[v] = is_found ? saturated<Real>(x) : stream.previous[v];
    }
    stream.write(tracked);
    surface.measure_errors(stream.generations,
                           found.agreements.all.far_share > surface.constants().lost_far);
    std::ranges::transform(stream.current, completed.begin(), in_double<Real>);
    surface.remember(completed, stream.generations.anchors() > 0);
    stream.advance();
    stream.keep(surface.shape().error_bars().of_vertices());
    recovery.remember(completed, found.agreements.all, is_lost);
    TrackingReport made;
    stream.count(made);
    made.iterations = static_cast<std::size_t>(found.iterations);
    made.agreement = found.agreements.all;
    made.recovered = recovered;
    made.stages.prior_weight = surface.shape().rest().prior_weight();
    made.stages.prior_share = surface.shape().rest().prior_share();
    made.standard_error = mean_standard_error();
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    report = made;
    of_sensors = std::move(found.agreements.of_sensors);
    return report;
  }

  /// The root mean square of the standard errors that are finite; 0 without any.
  [[nodiscard]] double mean_standard_error() const {
    double sum = 0;
    std::size_t n = 0;
    for (const double value : surface.shape().error_bars().of_vertices()) {
      if (!std::isfinite(value)) continue;
      sum += value * value;
      ++n;
    }
    return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
  }

  /// Writes everything that later frames depend on.
  void write(Writer& writer) const {
    begin_state(writer, kind<Real>, *mesh, settings);
    writer.write(stream.first_frame);
    for_each_stored_field(report, [&](const auto& field) { writer.write(field); });
    write_fields(writer, stream);
    for_each_field(report.agreement, [&](auto, const auto& number, auto) { writer.write(number); });
    writer.write(static_cast<std::uint8_t>(report.recovered ? 1 : 0));
    surface.write_memory(writer);
    recovery.write_memory(writer);
  }

  /// Reads what follows frame 0.
  void read(Reader& reader) {
    for_each_stored_field(report, [&](auto& field) { reader.read_finite(std::span(&field, 1)); });
    read_fields(reader, stream);
    stream.recall();
    // Without points, there are numbers that are NaN.
    for_each_field(report.agreement,
                   [&](auto, auto& number, auto) { reader.read(std::span(&number, 1)); });
    report.recovered = reader.read<std::uint8_t>() != 0;
    surface.read_memory(reader, widened(stream.previous));
    recovery.read_memory(reader);
    stream.keep(surface.shape().error_bars().of_vertices());
    stream.count(report);
    report.standard_error = mean_standard_error();
  }

  std::shared_ptr<StreamMesh> mesh;  // of all sequences
  TrackerSettings settings;
  Stream<Real> stream;
  SurfaceTracking surface;
  Recovery recovery;
  std::vector<Vector3<double>> completed;  // the current frame in double precision
  TrackingReport report;
  std::vector<Agreement> of_sensors;
  std::size_t state_size = 0;
};

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame,
                       const TrackerSettings& settings) {
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  auto mesh = std::make_shared<StreamMesh>(faces, first_frame, settings.threads,
                                           task_sharing_of_tracking());
  parts_ = std::make_unique<Parts>(std::move(mesh), settings, std::move(frame));
}

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings,
                       const Training<Real>& training) {
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  auto mesh = std::make_shared<StreamMesh>(faces, first_frame, settings.threads,
                                           task_sharing_of_tracking(), &training);
  parts_ = std::make_unique<Parts>(std::move(mesh), settings, std::move(frame));
}

template <class Real>
Tracker<Real>::~Tracker() = default;
template <class Real>
Tracker<Real>::Tracker(Tracker&&) noexcept = default;
template <class Real>
Tracker<Real>& Tracker<Real>::operator=(Tracker&&) noexcept = default;

template <class Real>
void Tracker<Real>::reset(Points<const Real> frame) {
  check_rows("frame", frame, n_vertices());
  parts_ = std::make_unique<Parts>(parts_->mesh, parts_->settings, complete_frame("frame", frame));
}

template <class Real>
TrackingReport Tracker<Real>::push(const Scan<Real>& scan, Points<Real> tracked) {
  const auto start = Clock::now();
  const PointScan measured = point_scan_of(scan, parts_->mesh->workers);
  check_output(tracked, n_vertices(),
               {{"points", Extent::of(scan.points)},
                {"normals", Extent::of(scan.normals)},
                {"viewpoints", Extent::of(scan.viewpoints)}});
  return parts_->track(measured, tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::push_depth(std::span<const DepthImage> images, Points<Real> tracked) {
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  const TrackingConstants& constants = parts_->surface.constants();
  return parts_->track(point_scan_of(images, constants.jump * parts_->surface.mean_edge(),
                                     constants.pixels_per_vertex * n_vertices()),
                       tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::skip(Points<Real> tracked) {
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  return parts_->track({}, tracked, start);
}

template <class Real>
std::size_t Tracker<Real>::n_vertices() const {
  return parts_->stream.n_vertices();
}
template <class Real>
std::size_t Tracker<Real>::n_edges() const {
  return parts_->mesh->topology.cells.neighbours.size() / 2;
}
template <class Real>
std::size_t Tracker<Real>::n_frames() const {
  return parts_->stream.n_frames;
}
template <class Real>
const TrackerSettings& Tracker<Real>::settings() const {
  return parts_->settings;
}
template <class Real>
const TopologyReport& Tracker<Real>::topology() const {
  return parts_->mesh->topology.report;
}
template <class Real>
std::span<const std::uint8_t> Tracker<Real>::observed() const {
  return parts_->stream.known;
}
template <class Real>
std::span<const Index> Tracker<Real>::generation() const {
  return parts_->stream.generations.of_vertices();
}
template <class Real>
std::span<const Index> Tracker<Real>::age() const {
  return parts_->stream.age;
}
template <class Real>
std::span<const Real> Tracker<Real>::standard_error() const {
  if (!settings().uncertainty) {
    refuse("standard_error", "requires uncertainty");
  }
  return parts_->stream.standard_error;
}
template <class Real>
const TrackingReport& Tracker<Real>::report() const {
  return parts_->report;
}

template <class Real>
std::span<const Agreement> Tracker<Real>::agreement_of_sensors() const {
  return parts_->of_sensors;
}

template <class Real>
std::size_t Tracker<Real>::state_size() const {
  return parts_->state_size;
}

template <class Real>
std::vector<std::byte> Tracker<Real>::state() const {
  Writer writer(state_size());
  parts_->write(writer);
  return writer.take_sealed();
}

template <class Real>
void Tracker<Real>::restore(std::span<const std::byte> state) {
  Reader reader = open_state(state, state_size(), kind<Real>, *parts_->mesh, settings());
  auto restored = std::make_unique<Parts>(parts_->mesh, parts_->settings,
                                          stored_frame<Real>(reader, n_vertices()));
  restored->read(reader);
  parts_ = std::move(restored);
}

template class Tracker<float>;
template class Tracker<double>;

}  // namespace dynmesh
