#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "mesh/training_frames.hpp"
#include "stream/arguments.hpp"
#include "stream/state.hpp"
#include "stream/stream.hpp"
#include "support/geometry.hpp"
#include "tracker/recovery.hpp"
#include "tracking/camera_arguments.hpp"
#include "tracking/depth_images.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/robust_size.hpp"
#include "tracking/scan_arguments.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
constexpr StateKind kind = {{'d', 'y', 'n', 't', 'r', 'a', 'c', '7'}, "tracker"};

constexpr std::size_t size_of_agreement = sizeof(std::uint64_t) + 3 * sizeof(double);

void write(Writer& writer, const Agreement& agreement) {
  writer.write(static_cast<std::uint64_t>(agreement.points));
  writer.write(agreement.far_share);
  writer.write(agreement.disagreeing);
  writer.write(agreement.distance);
}

/// Refuses one that no tracker can report: shares are missing without points, and the distance also
/// if all are far.
Agreement read_agreement(Reader& reader) {
  Agreement found;
  found.points = static_cast<std::size_t>(reader.read<std::uint64_t>());
  found.far_share = reader.read<double>();
  found.disagreeing = reader.read<double>();
  found.distance = reader.read<double>();
  const auto is_share = [](double value) { return value >= 0 && value <= 1; };
  const bool is_possible = found.points == 0
                               ? std::isnan(found.far_share) && std::isnan(found.disagreeing)
                               : is_share(found.far_share) && is_share(found.disagreeing);
  const bool has_near = found.points > 0 && found.far_share < 1;
  const bool is_distance =
      has_near ? found.distance >= 0 && std::isfinite(found.distance) : std::isnan(found.distance);
  if (!is_possible || !is_distance) refuse_state("reports what no tracker can report");
  return found;
}

/// Refuses a first scan that lies elsewhere than the template. Later ones may show that
/// the subject has left.
void check_first_scan(const PointScan& scan, const SurfaceTracking::Found& found,
                      const SurfaceTracking& surface) {
  const double far_share = found.agreements.all.far_share;
  const double observed = static_cast<double>(std::ranges::count(found.observed, 1)) /
                          static_cast<double>(found.observed.size());
  const TrackingConstants& constants = surface.constants();
  if (!(far_share > constants.most_far_at_first)) return;
  if (!(observed < constants.least_observed_at_first)) return;
  const auto distance = std::sqrt(squared_norm(median_of(scan.points) - median_of(surface.last())));
  std::array<char, 320> text{};
  (void)std::snprintf(
      text.data(), text.size(),
      "points: the template is far from the first scan: it is more than a mean edge "
      "from %.3g %% of the points, and their middles are %.4g apart, %.4g mean "
      "edges of the template; both must be in the same axes and unit of length, "
      "and the template in the pose of the scan",
      100 * far_share, distance, distance / surface.mean_edge());
  throw std::invalid_argument(text.data());
}

}  // namespace

/// Tracks frames after the public functions have checked the arguments.
template <class Real>
struct Tracker<Real>::Parts {
  using Frame = std::vector<Vector3<Real>>;

  /// `first_frame` and the training frames, x y z of each vertex, are in the caller's order.
  Parts(Faces mesh_faces, const Frame& first_frame, Topology topology,
        const TrackerSettings& chosen, std::span<const std::vector<Real>> training_frames = {})
      : settings(chosen),
        stream(first_frame, std::move(topology), DisconnectedRule::follow, chosen.threads,
               chosen.uncertainty),
        faces(faces_in_internal_order(mesh_faces, stream.numbering)),
        training(take_in_internal_order(training_frames, stream.numbering)),
        completed(first_frame.size()),
        training_hash(hash_of_frames(training_frames)) {
    begin(first_frame);
  }

  [[nodiscard]] std::unique_ptr<SurfaceTracking> surface_of(const Frame& first_frame);
  void begin(const Frame& first_frame);
  void begin(typename Stream<Real>::Prepared prepared,
             std::unique_ptr<SurfaceTracking> begun) noexcept;
  TrackingReport track(const PointScan& measurement, Points<Real> tracked, Clock::time_point start);
  [[nodiscard]] double mean_standard_error() const;

  TrackerSettings settings;
  Stream<Real> stream;
  std::vector<Triangle> faces;  // in the internal order, as the training frames
  TrainingFrames training;
  std::unique_ptr<SurfaceTracking> surface;
  Recovery<Real> recovery;
  PointScan scan;
  DepthImages images;
  std::vector<Vector3<double>> completed;  // the current frame in double precision
  std::uint64_t training_hash = 0;         // of its frames; 0 without training
  TrackingReport report;
  std::vector<Agreement> of_sensors;
};

/// Tracking that begins with a frame in the internal order.
template <class Real>
std::unique_ptr<SurfaceTracking> Tracker<Real>::Parts::surface_of(const Frame& first_frame) {
  return std::make_unique<SurfaceTracking>(
      faces, *stream.topology, stream.workers, widened(first_frame), TrackingConstants{}, training,
      settings.uncertainty, std::numeric_limits<Real>::epsilon());
}

/// Begins a sequence. If memory is exhausted, nothing has changed.
template <class Real>
void Tracker<Real>::Parts::begin(const Frame& first_frame) {
  auto prepared = stream.prepare(first_frame);
  auto begun = surface_of(prepared.first_frame);
  begin(std::move(prepared), std::move(begun));
}

template <class Real>
void Tracker<Real>::Parts::begin(typename Stream<Real>::Prepared prepared,
                                 std::unique_ptr<SurfaceTracking> begun) noexcept {
  surface = std::move(begun);
  stream.begin(std::move(prepared));
  recovery = Recovery<Real>(stream.first_frame, settings);
  report = {};
  of_sensors.clear();
  stream.count(report);
}

/// Finds the frame in what was measured. Only this can fail, and nothing that is kept between calls
/// changes before it is done.
template <class Real>
TrackingReport Tracker<Real>::Parts::track(const PointScan& measurement, Points<Real> tracked,
                                           Clock::time_point start) {
  SurfaceTracking::Found found = surface->track(measurement);
  if (stream.n_frames == 0) check_first_scan(measurement, found, *surface);
  const bool is_lost = recovery.is_due(found.agreements.all);
  const bool recovered = is_lost && recovery.improve(*surface, measurement, found);
  std::ranges::copy(found.observed, stream.known.begin());
  stream.generations.classify(stream.topology->cells, stream.known);
  const auto generation = stream.generations.of_vertices();
  for (std::size_t v = 0; v < stream.current.size(); ++v) {
    const Vector3<double>& x = found.x[v];
    const bool is_found = generation[v] != Generations::disconnected;
    stream.current[v] =
        is_found ? Vector3<Real>{saturated<Real>(x.x), saturated<Real>(x.y), saturated<Real>(x.z)}
                 : stream.previous[v];
  }
  stream.write(tracked);
  surface->measure_errors(stream.generations);
  std::ranges::transform(stream.current, completed.begin(), in_double<Real>);
  surface->remember(completed, stream.generations.anchors() > 0);
  stream.advance();
  recovery.remember(stream.previous, found.agreements.all, is_lost);
  TrackingReport made;
  stream.count(made);
  made.iterations = static_cast<std::size_t>(found.iterations);
  made.agreement = found.agreements.all;
  made.recovered = recovered;
  made.stages.prior_weight = surface->shape().rest().prior_weight();
  made.stages.prior_share = surface->shape().rest().prior_share();
  made.standard_error = mean_standard_error();
  made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  report = made;
  of_sensors = std::move(found.agreements.of_sensors);
  return report;
}

/// The root mean square of the standard errors that are finite; 0 without any.
template <class Real>
double Tracker<Real>::Parts::mean_standard_error() const {
  double sum = 0;
  std::size_t n = 0;
  for (const double value : surface->shape().error_bars().of_vertices()) {
    if (!std::isfinite(value)) continue;
    sum += value * value;
    ++n;
  }
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
}

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame,
                       const TrackerSettings& settings) {
  check_settings(settings);
  const auto frame = first_frame_of(first_frame);
  parts_ = std::make_unique<Parts>(faces, frame, topology_of(faces, frame.size()), settings);
}

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings,
                       const Training<Real>& training) {
  check_settings(settings);
  const auto frame = first_frame_of(first_frame);
  check_training(training, frame.size());
  check_size(training, first_frame);
  parts_ = std::make_unique<Parts>(faces, frame, topology_of(faces, frame.size()), settings,
                                   training.frames());
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
  parts_->begin(complete_frame("frame", frame));
}

template <class Real>
TrackingReport Tracker<Real>::push(const Scan<Real>& scan, Points<Real> tracked) {
  const auto start = Clock::now();
  check_scan(scan);
  check_output(tracked, n_vertices(),
               {{"points", Extent::of(scan.points)},
                {"normals", Extent::of(scan.normals)},
                {"viewpoints", Extent::of(scan.viewpoints)}});
  PointScan& measured = parts_->scan;
  copy(scan, measured, parts_->stream.workers);
  return parts_->track(measured, tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::push_depth(std::span<const DepthImage> images, Points<Real> tracked) {
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  for (std::size_t i = 0; i < images.size(); ++i) check_depth_image(i, images[i]);
  DepthImages& measured = parts_->images;
  measured.clear();
  for (const DepthImage& image : images) {
    copy_depths(image, measured.add(camera_of(image), image.height, image.width));
  }
  const TrackingConstants& constants = parts_->surface->constants();
  measured.convert(constants.jump * parts_->surface->mean_edge(),
                   constants.pixels_per_vertex * n_vertices(), parts_->stream.workers,
                   parts_->scan);
  return parts_->track(parts_->scan, tracked, start);
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
  return parts_->stream.topology->cells.neighbours.size() / 2;
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
  return parts_->stream.topology->report;
}
template <class Real>
std::span<const std::uint8_t> Tracker<Real>::observed() const {
  return parts_->stream.known_of_caller();
}
template <class Real>
std::span<const Index> Tracker<Real>::generation() const {
  return parts_->stream.generation_of_caller();
}
template <class Real>
std::span<const Index> Tracker<Real>::age() const {
  return parts_->stream.age_of_caller();
}
template <class Real>
std::span<const Real> Tracker<Real>::standard_error() const {
  if (!settings().uncertainty) {
    throw std::invalid_argument("standard_error: requires uncertainty=True");
  }
  return parts_->stream.in_caller_order(parts_->surface->shape().error_bars().of_vertices());
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
  const std::size_t of_report = size_of_agreement + sizeof(std::uint8_t);
  const std::size_t of_memory = parts_->surface->memory_size() + parts_->recovery.memory_size();
  return size_of_state<TrackerSettings>(parts_->stream, of_report + of_memory);
}

template <class Real>
std::vector<std::byte> Tracker<Real>::state() const {
  Writer writer(state_size());
  write_stream(writer, kind, parts_->stream, parts_->settings, parts_->training_hash,
               parts_->report);
  write(writer, parts_->report.agreement);
  writer.write(static_cast<std::uint8_t>(parts_->report.recovered ? 1 : 0));
  parts_->surface->write_memory(writer);
  parts_->recovery.write_memory(writer, parts_->stream.numbering);
  return writer.take_sealed();
}

template <class Real>
void Tracker<Real>::restore(std::span<const std::byte> state) {
  Reader reader(state);
  auto stored = read_stream(reader, state, state_size(), kind, parts_->stream, parts_->settings,
                            parts_->training_hash);
  TrackingReport report;
  static_cast<FrameReport&>(report) = stored.report;
  report.agreement = read_agreement(reader);
  const auto recovered = reader.read<std::uint8_t>();
  report.recovered = recovered != 0;
  if (recovered > (parts_->settings.recover ? 1 : 0))
    refuse_state("reports what no tracker can report");
  auto prepared = parts_->stream.prepare(stored.first_frame);
  auto surface = parts_->surface_of(prepared.first_frame);
  surface->read_memory(reader, widened(stored.previous));
  Recovery<Real> recovery(prepared.first_frame, parts_->settings);
  recovery.read_memory(reader, parts_->stream.numbering);
  // Nothing below can throw.
  parts_->begin(std::move(prepared), std::move(surface));
  parts_->stream.recall(std::move(stored.previous), std::move(stored.age), std::move(stored.known),
                        stored.n_frames);
  parts_->recovery = std::move(recovery);
  parts_->report = report;
  parts_->stream.count(parts_->report);
  parts_->report.standard_error = parts_->mean_standard_error();
}

template class Tracker<float>;
template class Tracker<double>;

}  // namespace dynmesh
