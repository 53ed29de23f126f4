#include "tracking/parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "completer/training_frames.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

template <class Real>
Tracker<Real>::Parts::Parts(Faces faces, const Frame& frame, Topology caller_topology,
                            const TrackerSettings& chosen,
                            std::span<const std::vector<Real>> training)
    : settings(chosen),
      topology(in_internal_order(std::move(caller_topology), numbering)),
      workers(chosen.threads),
      exchange(numbering, workers),
      generations(frame.size()),
      disconnected(*topology, DisconnectedRule::follow),
      surface(faces_in_internal_order(faces, numbering), *topology, workers, {},
              take_in_internal_order<double>(training, numbering), chosen.uncertainty,
              std::numeric_limits<Real>::epsilon()),
      previous(frame.size()),
      current(frame.size()),
      completed(frame.size()),
      known(frame.size()),
      age(frame.size()),
      training_hash(hash_of_frames(training)),
      observed_for_caller(frame.size()),
      generation_for_caller(frame.size()),
      age_for_caller(frame.size()),
      standard_error_for_caller(chosen.uncertainty ? frame.size() : 0) {
  begin(to_internal_order(numbering, frame));
}

template <class Real>
void Tracker<Real>::Parts::begin(Frame new_first_frame) {
  Disconnected<Real> new_disconnected = disconnected;
  new_disconnected.reset(new_first_frame);
  std::vector<Vector3<double>> positions(new_first_frame.size());
  std::ranges::transform(new_first_frame, positions.begin(), in_double<Real>);
  surface.reset(positions);
  // Nothing below can throw.
  disconnected = std::move(new_disconnected);
  std::ranges::copy(new_first_frame, previous.begin());
  first_frame = std::move(new_first_frame);
  std::ranges::fill(known, std::uint8_t{1});
  generations.classify(topology->cells, known);
  std::ranges::fill(age, 0);
  update_copies();
  n_frames = 0;
  report = {};
  report.known = n_vertices();
}

/// Only `find` can fail, and nothing that is kept between calls changes before it is done.
template <class Real>
TrackingReport Tracker<Real>::Parts::track(const Measurement& measurement, Points<Real> tracked,
                                           Clock::time_point start) {
  const SurfaceTracking::Found found = surface.find(measurement);
  std::ranges::copy(found.observed, known.begin());
  generations.classify(topology->cells, known);
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < current.size(); ++v) {
    const Vector3<double>& x = found.x[v];
    const bool is_found = generation[v] != Generations::disconnected;
    current[v] =
        is_found ? Vector3<Real>{saturated<Real>(x.x), saturated<Real>(x.y), saturated<Real>(x.z)}
                 : previous[v];
  }
  disconnected.complete(previous, current, generations);
  // Vertices whose estimate has diverged are first reset to the previous frame.
  exchange.write(current, previous, tracked);
  surface.measure_errors(generations);
  std::ranges::transform(current, completed.begin(), in_double<Real>);
  surface.remember(completed, generations.anchors() > 0);
  std::swap(previous, current);
  for (std::size_t v = 0; v < age.size(); ++v) {
    const Index older = age[v] + (age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
    age[v] = known[v] != 0 ? 0 : older;
  }
  update_copies();
  ++n_frames;
  report = {};
  report.known = generations.anchors();
  report.filled = generations.reached();
  report.disconnected = generations.disconnected_vertices();
  report.iterations = static_cast<std::size_t>(found.iterations);
  report.distance = found.distance;
  report.aligned = found.aligned;
  report.stages.prior_weight = surface.rest().prior_weight();
  report.stages.prior_share = surface.rest().prior_share();
  report.standard_error = mean_standard_error();
  report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return report;
}

template <class Real>
double Tracker<Real>::Parts::mean_standard_error() const {
  const auto values = surface.error_bars().of_vertices();
  double sum = 0;
  std::size_t n = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    sum += value * value;
    ++n;
  }
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
}

template <class Real>
void Tracker<Real>::Parts::update_copies() {
  const auto generation = generations.of_vertices();
  for (std::size_t i = 0; i < known.size(); ++i) {
    const std::size_t v = numbering.internal_index(i);
    observed_for_caller[i] = known[v];
    generation_for_caller[i] = generation[v];
    age_for_caller[i] = age[v];
    if (standard_error_for_caller.empty()) continue;
    const double error = surface.error_bars().of_vertices()[v];
    standard_error_for_caller[i] =
        std::isinf(error) ? std::numeric_limits<Real>::infinity() : saturated<Real>(error);
  }
}

#define DYNMESH_INSTANTIATE(Real)                                                             \
  template Tracker<Real>::Parts::Parts(Faces, const Frame&, Topology, const TrackerSettings&, \
                                       std::span<const std::vector<Real>>);                   \
  template void Tracker<Real>::Parts::begin(Frame);                                           \
  template TrackingReport Tracker<Real>::Parts::track(const Measurement&, Points<Real>,       \
                                                      Clock::time_point);                     \
  template double Tracker<Real>::Parts::mean_standard_error() const;                          \
  template void Tracker<Real>::Parts::update_copies();
DYNMESH_INSTANTIATE(float)
DYNMESH_INSTANTIATE(double)
#undef DYNMESH_INSTANTIATE

}  // namespace dynmesh
