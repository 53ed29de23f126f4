#include <algorithm>
#include <chrono>
#include <dynmesh/completer.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "completer/arguments.hpp"
#include "completer/parts.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

using Clock = std::chrono::steady_clock;

/// Executes algorithm 1 of the paper for one frame. The public functions below have checked all
/// arguments, so only the estimate can fail, if memory is exhausted. Nothing that is kept between
/// calls changes before it.
template <class Real>
FrameReport Completer<Real>::Parts::complete(Points<Real> completed, Clock::time_point start) {
  const std::size_t rejected = outliers ? outliers->drop(previous, current, known) : 0;
  // Classify the vertices and estimate the satellites: eq. (3) and (4) of method motion.
  const Index iterations = estimator->estimate(previous, current, known, generations);
  disconnected.complete(previous, current, generations);
  // Vertices whose estimate has diverged are first reset to the previous frame, since a NaN would
  // spread to later frames.
  exchange.write(current, previous, completed);
  estimator->remember(current);
  std::swap(previous, current);
  update_ages();
  ++n_frames;
  report = report_of(iterations, rejected, start);
  return report;
}

template <class Real>
void Completer<Real>::Parts::update_ages() {
  for (std::size_t v = 0; v < n_vertices(); ++v) {
    const Index older = age[v] + (age[v] < std::numeric_limits<Index>::max() ? 1 : 0);
    age[v] = known[v] != 0 ? 0 : older;
  }
  generation_for_caller_.clear();
  age_for_caller_.clear();
  standard_error_for_caller_.clear();
}

template <class Real>
FrameReport Completer<Real>::Parts::report_of(Index iterations, std::size_t rejected,
                                              Clock::time_point start) const {
  FrameReport made;
  made.rejected = rejected;
  made.known = generations.anchors();
  made.filled = generations.reached();
  made.disconnected = generations.disconnected_vertices();
  made.iterations = static_cast<std::size_t>(iterations);
  made.standard_error = mean_standard_error();
  made.stages = estimator->stages();
  made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return made;
}

template <class Real>
void Completer<Real>::Parts::read(Points<const Real> points, KnownMask mask) {
  if (exchange.read(points, mask, current, known)) return;
  for (std::size_t i = 0; i < points.count; ++i) {  // find the one that is out of range
    if (known[numbering.internal_index(i)] != 0) check_known_position(i, row(points, i));
  }
}

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings) {
  check_settings(settings);
  const auto frame = first_frame_of(first_frame);
  parts_ = std::make_unique<Parts>(faces, frame, topology_of(faces, frame.size()), settings);
}

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings,
                           const Training<Real>& training) {
  check_settings(settings);
  if (settings.method != Method::detail) {
    throw SettingError("training", "requires method='detail'");
  }
  if (settings.learn) {
    throw SettingError("learn",
                       "a completer learns either from its own frames or from a training sequence; "
                       "give one of the two");
  }
  const auto frame = first_frame_of(first_frame);
  check_training(training, frame.size());
  check_size(training, first_frame);
  parts_ = std::make_unique<Parts>(faces, frame, topology_of(faces, frame.size()), settings,
                                   training.frames());
}

template <class Real>
Completer<Real>::~Completer() = default;
template <class Real>
Completer<Real>::Completer(Completer&&) noexcept = default;
template <class Real>
Completer<Real>& Completer<Real>::operator=(Completer&&) noexcept = default;

template <class Real>
void Completer<Real>::reset(Points<const Real> frame) {
  check_rows("frame", frame, n_vertices());
  parts_->begin(to_internal_order(parts_->numbering, complete_frame("frame", frame)));
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, KnownMask known,
                                  Points<Real> completed) {
  const auto start = Clock::now();
  check_rows("points", points, n_vertices());
  check_rows("known", known, n_vertices());
  check_output(completed, n_vertices(),
               {{"points", Extent::of(points)}, {"known", Extent::of(known)}});
  parts_->read(points, known);
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, Points<Real> completed) {
  const auto start = Clock::now();
  check_rows("points", points, n_vertices());
  check_output(completed, n_vertices(), {{"points", Extent::of(points)}});
  parts_->read(points, {});
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push_sparse(std::span<const Index> indices, Points<const Real> points,
                                         Points<Real> completed) {
  const auto start = Clock::now();
  if (indices.size() != points.count) {
    throw std::invalid_argument("points: has " + std::to_string(points.count) + " rows for " +
                                std::to_string(indices.size()) + " indices");
  }
  check_view("points", points);
  check_output(completed, n_vertices(),
               {{"indices", Extent::of(indices)}, {"points", Extent::of(points)}});
  std::ranges::fill(parts_->known, std::uint8_t{0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Index index = indices[i];
    if (index < 0 || static_cast<std::size_t>(index) >= n_vertices()) {
      throw std::invalid_argument("indices: position " + std::to_string(i) + " holds " +
                                  std::to_string(index) + ", but the mesh has " +
                                  std::to_string(n_vertices()) + " vertices, counted from 0");
    }
    const std::size_t v = parts_->numbering.internal_index(static_cast<std::size_t>(index));
    if (parts_->known[v] != 0) {
      const auto first = std::ranges::find(indices, index) - indices.begin();
      throw std::invalid_argument("indices: vertex " + std::to_string(index) +
                                  " is listed twice, at positions " + std::to_string(first) +
                                  " and " + std::to_string(i));
    }
    parts_->known[v] = 1;
    parts_->current[v] = row(points, i);
    check_known_position(i, parts_->current[v]);
  }
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::skip(Points<Real> completed) {
  const auto start = Clock::now();
  check_output(completed, n_vertices(), {});
  std::ranges::fill(parts_->known, std::uint8_t{0});
  return parts_->complete(completed, start);
}

template <class Real>
std::size_t Completer<Real>::n_vertices() const {
  return parts_->n_vertices();
}
template <class Real>
std::size_t Completer<Real>::n_edges() const {
  return parts_->topology->cells.neighbours.size() / 2;
}
template <class Real>
std::size_t Completer<Real>::n_frames() const {
  return parts_->n_frames;
}
template <class Real>
const Settings& Completer<Real>::settings() const {
  return parts_->settings;
}
template <class Real>
const TopologyReport& Completer<Real>::topology() const {
  return parts_->topology->report;
}
template <class Real>
std::span<const Index> Completer<Real>::generation() const {
  return parts_->generation();
}
template <class Real>
std::span<const Index> Completer<Real>::age() const {
  return parts_->age_of_vertices();
}
template <class Real>
std::span<const Real> Completer<Real>::standard_error() const {
  if (!settings().uncertainty) {
    throw std::invalid_argument("standard_error: requires uncertainty=True");
  }
  return parts_->standard_error();
}
template <class Real>
const FrameReport& Completer<Real>::report() const {
  return parts_->report;
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
