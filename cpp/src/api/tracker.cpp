#include <algorithm>
#include <chrono>
#include <cmath>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "api/recovery.hpp"
#include "api/report_fields.hpp"
#include "api/state.hpp"
#include "api/stream.hpp"
#include "base/arguments.hpp"
#include "base/checks.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "base/training_frames.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/scan_arguments.hpp"
#include "surface_fit/surface_tracking.hpp"

namespace dynmesh {

namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
constexpr StateFormat tracker_state = {'d', 'y', 'n', 't', 'r', 'a', 'c', 'D'};

/// Says of the whole frame what its measure says.
void tell_quality(TrackingReport& report) {
  report.quality = report.measure.quality;
  report.reason = {};
  report.measure.reason().copy(report.reason.data(), report.reason.size() - 1);
}

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

}  // namespace

/// One sequence of frames, tracked after the public functions have checked the arguments.
template <class Real>
struct Tracker<Real>::Parts {
  Parts(std::shared_ptr<StreamMesh> of_all, const TrackerSettings& chosen,
        Stream::Frame first_frame)
      : mesh(std::move(of_all)),
        settings(chosen),
        stream(*mesh, std::move(first_frame), DisconnectedRule::follow, largest_coordinate<Real>),
        surface(mesh->faces, mesh->topology, mesh->workers, stream.first_frame, TrackingConstants{},
                mesh->training, settings.uncertainty, std::numeric_limits<Real>::epsilon()),
        recovery(*mesh, stream.first_frame, settings.recover),
        standard_error(errors().size()) {
    tell_errors(report);
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
    Measure measure = recovery.measure(found);
    const bool is_lost = recovery.is_due(measure);
    TrackingReport made;
    made.recovered = is_lost && recovery.find_again(surface, measurement, found, measure);
    made.measure = measure;
    tell_quality(made);
    std::ranges::copy(found.observed, stream.current_known.begin());
    stream.generations.classify(mesh->topology.cells, stream.current_known);
    const auto generation = stream.generations.of_vertices();
    for (std::size_t v = 0; v < stream.current.size(); ++v) {
      const bool is_found = generation[v] != Generations::disconnected;
      stream.current[v] = is_found ? found.x[v] : stream.previous[v];
    }
    stream.finish();
    surface.measure_errors(stream.generations, measure.quality == Quality::ruined);
    surface.remember(stream.current, stream.generations.anchors() > 0);
    recovery.remember(stream.current, measure, is_lost);
    stream.advance();
    stream.write(tracked);
    stream.count(made);
    made.iterations = static_cast<std::size_t>(found.iterations);
    made.stages.prior_weight = surface.shape().rest().prior_weight();
    made.stages.prior_share = surface.shape().rest().prior_share();
    tell_errors(made);
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    report = made;
    of_sensors = std::move(found.agreements.of_sensors);
    return report;
  }

  [[nodiscard]] std::span<const double> errors() const {
    return surface.shape().error_bars().of_vertices();
  }
  /// Tells the standard errors, and the root mean square of those that are finite; 0 without any.
  void tell_errors(FrameReport& of_frame) {
    std::ranges::transform(errors(), standard_error.begin(), saturated_or_infinite<Real>);
    double sum = 0;
    std::size_t n = 0;
    for (const double value : errors()) {
      if (!std::isfinite(value)) continue;
      sum += value * value;
      ++n;
    }
    of_frame.standard_error = n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
  }

  /// What a state is of.
  static StateKind kind() { return {tracker_state, "tracker", sizeof(Real)}; }

  /// Writes everything that later frames depend on.
  void write(Writer& writer) const {
    begin_state(writer, kind(), *mesh, settings);
    writer.write(stream.first_frame);
    for_each_stored_field(report, [&](const auto& field) { writer.write(field); });
    write_fields(writer, stream);
    const auto put = [&](auto, const auto& number, auto) { writer.write(number); };
    for_each_field(report.measure.agreement, put);
    for_each_number(report.measure, put);
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
    const auto take = [&](auto, auto& number, auto) { reader.read(std::span(&number, 1)); };
    for_each_field(report.measure.agreement, take);
    for_each_number(report.measure, take);
    report.recovered = reader.read<std::uint8_t>() != 0;
    surface.read_memory(reader, stream.previous);
    recovery.read_memory(reader);
    report.measure.is_start = recovery.is_start();
    report.measure.quality = judged(report.measure);
    tell_quality(report);
    stream.count(report);
    tell_errors(report);
  }

  std::shared_ptr<StreamMesh> mesh;  // of all sequences
  TrackerSettings settings;
  Stream stream;
  SurfaceTracking surface;
  Recovery recovery;
  std::vector<Real> standard_error;  // (k,), or empty
  TrackingReport report;
  std::vector<Agreement> of_sensors;
  std::size_t state_size = 0;
};

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame,
                       const TrackerSettings& settings) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  auto mesh = std::make_shared<StreamMesh>(faces, frame.size(), settings.threads,
                                           task_sharing_of_tracking());
  parts_ = std::make_unique<Parts>(std::move(mesh), settings, std::move(frame));
}

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings,
                       const Training<Real>& training) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  auto mesh = std::make_shared<StreamMesh>(faces, frame.size(), settings.threads,
                                           task_sharing_of_tracking(), frames_of(training, frame));
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
  const DefaultArithmetic arithmetic;
  check_rows("frame", frame, n_vertices());
  parts_ = std::make_unique<Parts>(parts_->mesh, parts_->settings, complete_frame("frame", frame));
}

template <class Real>
TrackingReport Tracker<Real>::push(const Scan<Real>& scan, Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  const PointScan measured =
      point_scan_of(scan, parts_->surface.mean_edge(), parts_->mesh->workers);
  check_output(tracked, n_vertices(),
               {{"points", Extent::of(scan.points)},
                {"normals", Extent::of(scan.normals)},
                {"viewpoints", Extent::of(scan.viewpoints)}});
  return parts_->track(measured, tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::push_depth(std::span<const DepthImage> images, Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  const TrackingConstants& constants = parts_->surface.constants();
  return parts_->track(point_scan_of(images, constants.jump * parts_->surface.mean_edge(),
                                     constants.pixels_per_vertex * n_vertices()),
                       tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::skip(Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
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
  return parts_->standard_error;
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
  const DefaultArithmetic arithmetic;
  Reader reader = open_state(state, state_size(), Parts::kind(), *parts_->mesh, settings());
  auto restored = std::make_unique<Parts>(
      parts_->mesh, parts_->settings, stored_frame(reader, n_vertices(), largest_coordinate<Real>));
  restored->read(reader);
  parts_ = std::move(restored);
}

template class Tracker<float>;
template class Tracker<double>;

}  // namespace dynmesh
