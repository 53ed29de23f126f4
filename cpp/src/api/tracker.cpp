#include <algorithm>
#include <cmath>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "api/recovery.hpp"
#include "api/state.hpp"
#include "api/stream.hpp"
#include "base/arguments.hpp"
#include "base/checks.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "base/training_frames.hpp"
#include "shape/memory.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/scan_arguments.hpp"
#include "surface_fit/surface_fit.hpp"

namespace dynmesh {

namespace {

/// The quality of a frame is that of its measure.
void describe_quality(TrackingReport& report) {
  report.quality = report.measure.quality;
  report.reason = {};
  report.measure.reason().copy(report.reason.data(), report.reason.size() - 1);
}

/// Whether no vertex was seen since frame 0, as of a sequence that begins with empty scans.
bool is_unseen(const Memory& memory) {
  return static_cast<std::size_t>(std::ranges::min(memory.age)) == memory.n_frames;
}

/// Refuses a first scan that lies elsewhere than the template. Later ones may show that
/// the subject has left.
void check_first_scan(const PointScan& scan, const FittedSurface& found, Field last,
                      const SurfaceLevel& surface) {
  const double far_share = found.agreements.all.far_share;
  const double observed = static_cast<double>(std::ranges::count(found.observed, 1)) /
                          static_cast<double>(found.observed.size());
  const bool are_most_far = far_share > 0.5;  // false without points: the share is NaN
  if (!are_most_far || !(observed < surface.constants().least_observed_at_first)) return;
  const auto distance = std::sqrt(squared_norm(median_of(scan.points) - median_of(last)));
  refuse("points", "the template is far from the first scan: it is more than a mean edge from ",
         to_text(100 * far_share, 3), " % of the points, and their middles are ",
         to_text(distance, 4), " apart, ", to_text(distance / surface.mean_edge(), 4),
         " mean edges of the template; both must be in the same axes and unit of length, and the ",
         "template in the pose of the scan");
}

/// Finds frames in scans, and again where the template was lost.
struct Tracking {
  using Settings = TrackerSettings;
  using Report = TrackingReport;

  /// What a state is of. The last character is the version of the format.
  static constexpr StateFormat format = {'d', 'y', 'n', 't', 'r', 'a', 'c', 'P'};
  static constexpr const char* name = "tracker";

  Tracking(Stream& shared, const TrackerSettings& settings, std::vector<Vector3> frame)
      : stream(shared),
        first_frame(std::move(frame)),
        surface(stream.faces, stream.topology, stream.workers, first_frame, stream.training,
                {at(settings.resolution), settings.uncertainty, stream.coordinates.epsilon}),
        recovery(stream, surface.whole(), first_frame, settings.recover) {}

  [[nodiscard]] static bool is_reusable() { return true; }

  [[nodiscard]] Memory first_memory() const {
    Memory memory(first_frame);
    surface.begin(memory);
    recovery.begin(memory);
    return memory;
  }

  /// Completes the report of the last frame of a memory that is frame 0 or was stored.
  static void begin(const Memory& memory, TrackingReport& report) {
    Recovery::check(memory);
    if (memory.n_frames == 0) report.measure.is_start = memory.tracking.is_start != 0;
    report.measure.quality = quality_of(report.measure);
    describe_quality(report);
    describe(memory, report);
  }

  /// Finds the next frame in what was measured, and how well it explains what each sensor
  /// measured.
  TrackingReport track(const Memory& memory, const PointScan& measurement, Memory& next,
                       std::vector<Agreement>& sensor_agreements) {
    FittedSurface found = surface.fit(memory, measurement, next);
    if (is_unseen(memory)) check_first_scan(measurement, found, memory.last, surface.whole());
    TrackingReport report;
    report.measure = recovery.measure(memory, found);
    std::optional<Recovery::Sought> sought;
    if (recovery.is_due(memory, report.measure)) {
      sought = recovery.seek(surface, memory, measurement, found, report.measure, next);
    }
    report.recovered = sought && sought->is_better;
    if (report.recovered) {
      found = std::move(sought->found);
      report.measure = sought->measure;
      std::swap(next, sought->next);
    }
    describe_quality(report);
    std::ranges::copy(found.observed, next.known.begin());
    next.generations.classify(stream.topology.cells, next.known);
    // Components that were not observed are where their ties hold them.
    const bool moves = next.generations.anchors() > 0;
    std::ranges::copy(moves ? found.x : Field(memory.last), next.last.begin());
    stream.reset_diverged(memory.last, next.last);
    stream.count_frames(memory, next);
    const Memory& from = report.recovered ? sought->start : memory;
    const bool is_lost = report.quality == Quality::ruined;
    surface.measure_errors(found, is_lost, from, next);
    surface.remember(from, found, moves, is_lost, next);
    recovery.remember(memory, report.measure, sought, next);
    report.iterations = static_cast<std::size_t>(found.iterations);
    report.stages.prior_weight = next.fit.prior_weight;
    report.stages.prior_share = next.fit.prior_share;
    describe(next, report);
    sensor_agreements = std::move(found.agreements.of_sensors);
    return report;
  }

  /// What is remembered beside the memory: nothing.
  template <class Self, class Visit>
  static void each_number(Self& /*self*/, const Visit& /*visit*/) {}

  static void describe(const Memory& memory, TrackingReport& report) {
    const std::span<const double> errors = memory.errors.standard_errors;
    dynmesh::describe(memory, report, [&](std::size_t v) { return std::isfinite(errors[v]); });
  }

  Stream& stream;
  std::vector<Vector3> first_frame;
  SurfaceFit surface;
  Recovery recovery;
};

using TrackingStream = StreamOf<Tracking>;

/// `training` may be null.
template <class Real>
std::unique_ptr<Stream> stream_of(Faces faces, Points<const Real> first_frame,
                                  const TrackerSettings& settings, const Training<Real>* training) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  auto training_frames = training == nullptr ? TrainingFrames() : frames_of(*training, frame);
  return std::make_unique<TrackingStream>(settings, faces, std::move(frame),
                                          task_sharing_of_tracking(), coordinates_of<Real>,
                                          std::move(training_frames));
}

TrackingStream& tracking_stream(Stream& stream) { return static_cast<TrackingStream&>(stream); }

template <class Real>
TrackingReport track(TrackingStream& stream, const PointScan& measurement, Points<Real> tracked,
                     Stream::Clock::time_point start) {
  return stream.finish(
      stream.solver->track(stream.memory, measurement, stream.next, stream.sensor_agreements),
      tracked, start);
}

}  // namespace

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings)
    : FrameStream(stream_of<Real>(faces, first_frame, settings, nullptr)) {}

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings,
                       const Training<Real>& training)
    : FrameStream(stream_of(faces, first_frame, settings, &training)) {}

template <class Real>
void Tracker<Real>::reset(Points<const Real> frame) {
  const DefaultArithmetic arithmetic;
  tracking_stream(*stream_).reset(complete_frame("frame", frame, n_vertices()));
}

template <class Real>
TrackingReport Tracker<Real>::push(const Scan<Real>& scan, Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Stream::Clock::now();
  TrackingStream& stream = tracking_stream(*stream_);
  const PointScan measured =
      point_scan_of(scan, stream.solver->surface.whole().mean_edge(), stream.workers);
  check_output(tracked, n_vertices(),
               {{"points", Extent::of(scan.points)},
                {"normals", Extent::of(scan.normals)},
                {"viewpoints", Extent::of(scan.viewpoints)},
                {"colours", Extent::of(scan.colours)}});
  return track(stream, measured, tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::push_depth(std::span<const DepthImage> images, Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Stream::Clock::now();
  check_output(tracked, n_vertices(), {});
  TrackingStream& stream = tracking_stream(*stream_);
  const SurfaceLevel& surface = stream.solver->surface.whole();
  const TrackingConstants& constants = surface.constants();
  return track(stream,
               point_scan_of(images, constants.jump * surface.mean_edge(),
                             constants.pixels_per_vertex * n_vertices()),
               tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::skip(Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Stream::Clock::now();
  check_output(tracked, n_vertices(), {});
  return track(tracking_stream(*stream_), {}, tracked, start);
}

template <class Real>
const TrackerSettings& Tracker<Real>::settings() const {
  return tracking_stream(*stream_).settings;
}
template <class Real>
std::span<const std::uint8_t> Tracker<Real>::observed() const {
  return stream_->memory.known;
}
template <class Real>
std::span<const Real> Tracker<Real>::standard_error() const {
  if (!settings().uncertainty) {
    refuse("standard_error", "requires uncertainty");
  }
  return stream_->standard_errors<Real>();
}
template <class Real>
TrackingReport Tracker<Real>::report() const {
  return tracking_stream(*stream_).report.get();
}

template <class Real>
std::span<const Agreement> Tracker<Real>::agreement_of_sensors() const {
  return stream_->sensor_agreements;
}

template class Tracker<float>;
template class Tracker<double>;

}  // namespace dynmesh
