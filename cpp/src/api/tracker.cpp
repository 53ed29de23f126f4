#include <algorithm>
#include <chrono>
#include <cmath>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <limits>
#include <optional>
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
#include "shape/memory.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/scan_arguments.hpp"
#include "surface_fit/template_tracking.hpp"

namespace dynmesh {

namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
constexpr StateFormat tracker_state = {'d', 'y', 'n', 't', 'r', 'a', 'c', 'H'};

/// Says of the whole frame what its measure says.
void tell_quality(TrackingReport& report) {
  report.quality = report.measure.quality;
  report.reason = {};
  report.measure.reason().copy(report.reason.data(), report.reason.size() - 1);
}

/// Refuses a first scan that lies elsewhere than the template. Later ones may show that
/// the subject has left.
void check_first_scan(const PointScan& scan, const TemplateTracking::Found& found, Field last,
                      const TemplateTracking& surface) {
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

}  // namespace

/// Finds frames in scans, and again where the template was lost.
struct TrackingSolver final : StreamSolver {
  TrackingSolver(StreamMesh& mesh, const TrackerSettings& settings, std::vector<Vector3> frame,
                 double epsilon)
      : StreamSolver(std::move(frame)),
        surface(mesh.faces, mesh.topology, mesh.workers, first_frame, mesh.training,
                {at(settings.resolution), settings.uncertainty, epsilon}),
        recovery(mesh, first_frame, settings.recover) {}

  TemplateTracking surface;
  Recovery recovery;
};

using TrackingMesh = StreamMeshOf<TrackerSettings, TrackingReport>;

/// One sequence of frames, tracked after the public functions have checked the arguments.
template <class Real>
struct Tracker<Real>::Parts final : FrameStream::Parts {
  Parts(const std::shared_ptr<TrackingMesh>& of_all, std::shared_ptr<TrackingSolver> solver)
      : FrameStream::Parts(of_all, solver, dynmesh::largest_coordinate<Real>),
        own(of_all),
        settings(of_all->settings),
        surface(solver->surface),
        recovery(solver->recovery) {
    surface.begin(memory);
    recovery.begin(memory);
    next = memory;
    standard_error.resize(memory.errors.standard_errors.size());
    tell_errors(report);
    count(memory.generations, report);
    report.measure.is_start = memory.is_start != 0;
  }
  Parts(const std::shared_ptr<TrackingMesh>& of_all, Frame frame)
      : Parts(of_all, std::make_shared<TrackingSolver>(
                          *of_all, of_all->settings, std::move(frame),
                          static_cast<double>(std::numeric_limits<Real>::epsilon()))) {}

  /// Finds the frame in what was measured. Only this can fail, and nothing that is kept between
  /// calls changes before `advance`.
  TrackingReport track(const PointScan& measurement, Points<Real> tracked,
                       Clock::time_point start) {
    TemplateTracking::Found found = surface.fit(memory, measurement, next);
    if (memory.n_frames == 0) check_first_scan(measurement, found, memory.last, surface);
    TrackingReport made;
    made.measure = recovery.measure(memory, found);
    const bool is_due = recovery.is_due(memory, made.measure);
    std::optional<Memory> again;
    if (is_due) {
      again = recovery.find_again(surface, memory, measurement, found, made.measure, next);
      if (!again) {
        found = surface.fit(memory, measurement, next);
        made.measure = recovery.measure(memory, found);
      }
    }
    made.recovered = again.has_value();
    tell_quality(made);
    std::ranges::copy(found.observed, next.known.begin());
    next.generations.classify(mesh->topology.cells, next.known);
    // Components that were not observed are where their ties hold them.
    const bool moves = next.generations.anchors() > 0;
    std::ranges::copy(moves ? found.x : Field(memory.last), next.last.begin());
    finish();
    const Memory& from = again ? *again : memory;
    const bool is_lost = made.quality == Quality::ruined;
    surface.measure_errors(from, is_lost, next);
    surface.remember(from, moves, is_lost, next);
    recovery.remember(memory, made.measure, is_due, next);
    advance();
    this->put(tracked);
    count(memory.generations, made);
    made.iterations = static_cast<std::size_t>(found.iterations);
    made.stages.prior_weight = memory.fit.prior_weight;
    made.stages.prior_share = memory.fit.prior_share;
    tell_errors(made);
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    report = made;
    of_sensors = std::move(found.agreements.of_sensors);
    publish();
    return report;
  }

  /// Tells the standard errors, and the root mean square of those that are finite; 0 without any.
  void tell_errors(FrameReport& of_frame) {
    const std::vector<double>& errors = memory.errors.standard_errors;
    std::ranges::transform(errors, standard_error.begin(), saturated_or_infinite<Real>);
    double sum = 0;
    std::size_t n = 0;
    for (const double value : errors) {
      if (!std::isfinite(value)) continue;
      sum += value * value;
      ++n;
    }
    of_frame.standard_error = n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
  }

  [[nodiscard]] std::unique_ptr<FrameStream::Parts> begun(Frame frame) const override {
    if (begins_with(frame)) {
      return std::make_unique<Parts>(own, std::static_pointer_cast<TrackingSolver>(shared_solver));
    }
    return std::make_unique<Parts>(own, std::move(frame));
  }
  void publish_report() const noexcept override { own->report.set(report); }

  /// What a state is of.
  static StateKind kind() { return {tracker_state, "tracker", sizeof(Real)}; }

  void write(Writer& writer) const override {
    write_head(writer, kind(), *mesh, settings);
    writer.write(first_frame());
    for_each_number(*this, NumberWriter(writer));
  }

  [[nodiscard]] Reader open(std::span<const std::byte> state) const override {
    return read_head(state, kind(), *mesh, settings);
  }
  void read_memory(Reader& reader) override {
    for_each_number(*this, NumberReader(reader));
    check();
    Recovery::check(memory);
    report.measure.quality = judged(report.measure);
    tell_quality(report);
    count(memory.generations, report);
    tell_errors(report);
  }

  template <class Self, class Visit>
  static void for_each_number(Self& self, const Visit& visit) {
    for_each_stored_field(self.report, visit);
    // Without points, there are numbers that are NaN.
    const auto any = [&](auto, auto& number, auto) { visit(number, false); };
    for_each_field(self.report.measure.agreement, any);
    dynmesh::for_each_number(self.report.measure, any);
    visit(self.report.measure.is_start);
    visit(self.report.recovered);
    each_number(self.memory, visit);
  }

  std::shared_ptr<TrackingMesh> own;  // `mesh`
  const TrackerSettings& settings;
  TemplateTracking& surface;
  const Recovery& recovery;
  std::vector<Real> standard_error;  // (k,), or empty
  TrackingReport report;
  std::vector<Agreement> of_sensors;
};

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame,
                       const TrackerSettings& settings) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  const auto mesh =
      std::make_shared<TrackingMesh>(settings, faces, frame.size(), task_sharing_of_tracking());
  begin(std::make_unique<Parts>(mesh, std::move(frame)));
}

template <class Real>
Tracker<Real>::Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings,
                       const Training<Real>& training) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  const auto mesh = std::make_shared<TrackingMesh>(
      settings, faces, frame.size(), task_sharing_of_tracking(), frames_of(training, frame));
  begin(std::make_unique<Parts>(mesh, std::move(frame)));
}

template <class Real>
typename Tracker<Real>::Parts& Tracker<Real>::parts() const {
  return static_cast<Parts&>(*parts_);
}

template <class Real>
void Tracker<Real>::reset(Points<const Real> frame) {
  const DefaultArithmetic arithmetic;
  check_rows("frame", frame, n_vertices());
  replace(parts().begun(complete_frame("frame", frame)));
}

template <class Real>
TrackingReport Tracker<Real>::push(const Scan<Real>& scan, Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  const PointScan measured =
      point_scan_of(scan, parts().surface.mean_edge(), parts().mesh->workers);
  check_output(tracked, n_vertices(),
               {{"points", Extent::of(scan.points)},
                {"normals", Extent::of(scan.normals)},
                {"viewpoints", Extent::of(scan.viewpoints)}});
  return parts().track(measured, tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::push_depth(std::span<const DepthImage> images, Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  const TrackingConstants& constants = parts().surface.constants();
  return parts().track(point_scan_of(images, constants.jump * parts().surface.mean_edge(),
                                     constants.pixels_per_vertex * n_vertices()),
                       tracked, start);
}

template <class Real>
TrackingReport Tracker<Real>::skip(Points<Real> tracked) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_output(tracked, n_vertices(), {});
  return parts().track({}, tracked, start);
}

template <class Real>
const TrackerSettings& Tracker<Real>::settings() const {
  return static_cast<const TrackingMesh&>(*mesh_).settings;
}
template <class Real>
std::span<const std::uint8_t> Tracker<Real>::observed() const {
  return parts().memory.known;
}
template <class Real>
std::span<const Real> Tracker<Real>::standard_error() const {
  if (!settings().uncertainty) {
    refuse("standard_error", "requires uncertainty");
  }
  return parts().standard_error;
}
template <class Real>
TrackingReport Tracker<Real>::report() const {
  return static_cast<const TrackingMesh&>(*mesh_).report.get();
}

template <class Real>
std::span<const Agreement> Tracker<Real>::agreement_of_sensors() const {
  return parts().of_sensors;
}

template class Tracker<float>;
template class Tracker<double>;

}  // namespace dynmesh
