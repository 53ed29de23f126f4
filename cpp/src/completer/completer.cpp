#include <algorithm>
#include <chrono>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "completer/outliers.hpp"
#include "detail/detail.hpp"
#include "mesh/estimator.hpp"
#include "mesh/training_frames.hpp"
#include "motion/fast_motion.hpp"
#include "motion/motion.hpp"
#include "stream/arguments.hpp"
#include "stream/state.hpp"
#include "stream/stream.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
constexpr StateKind kind = {{'d', 'y', 'n', 'm', 'e', 's', 'h', 'B'}, "completer"};

/// Lets a method that computes in double precision estimate frames of single precision. Converts
/// frames on the way in and out. Allocates memory only in the constructor, beside what the
/// method allocates.
class InDoublePrecision final : public Estimator<float> {
 public:
  InDoublePrecision(std::unique_ptr<Estimator<double>> method, std::size_t n_vertices)
      : method_(std::move(method)), previous_(n_vertices), points_(n_vertices) {}

  Index estimate(Frame previous, std::span<Vector3<float>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override {
    widen(previous, previous_);
    widen(points, points_);
    const Index iterations = method_->estimate(previous_, points_, known, generations);
    const auto generation = generations.of_vertices();
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (generation[v] == Generations::disconnected) continue;
      const Vector3<double>& x = points_[v];
      points[v] = {saturated<float>(x.x), saturated<float>(x.y), saturated<float>(x.z)};
    }
    return iterations;
  }

  void remember(Frame completed) override { method_->remember(widen(completed, points_)); }

  void write_memory(Writer& writer) const override { method_->write_memory(writer); }
  [[nodiscard]] std::size_t memory_size() const override { return method_->memory_size(); }
  void read_memory(Reader& reader, Frame completed) override {
    method_->read_memory(reader, widen(completed, points_));
  }
  [[nodiscard]] std::span<const double> standard_error() const override {
    return method_->standard_error();
  }
  [[nodiscard]] StageReport stages() const override { return method_->stages(); }

 private:
  static std::span<const Vector3<double>> widen(Frame frame,
                                                std::vector<Vector3<double>>& converted) {
    std::ranges::transform(frame, converted.begin(), in_double<float>);
    return converted;
  }

  std::unique_ptr<Estimator<double>> method_;
  std::vector<Vector3<double>> previous_;
  std::vector<Vector3<double>> points_;
};

}  // namespace

/// Completes frames after the public functions have checked the arguments.
template <class Real>
struct Completer<Real>::Parts {
  using Frame = std::vector<Vector3<Real>>;

  /// `first_frame` and the training frames, x y z of each vertex, are in the caller's order.
  Parts(Faces faces, const Frame& first_frame, Topology topology, const Settings& chosen,
        std::span<const std::vector<Real>> training = {})
      : settings(chosen),
        stream(first_frame, std::move(topology), chosen.disconnected, chosen.threads,
               chosen.uncertainty),
        outliers(chosen.reject_outliers ? std::make_unique<Outliers<Real>>(stream.topology->cells)
                                        : nullptr),
        triangles(faces_in_internal_order(faces, stream.numbering)),
        training_frames(take_in_internal_order(training, stream.numbering)),
        training_hash(hash_of_frames(training)) {
    begin(first_frame);
  }

  void begin(const Frame& first_frame);
  void begin(typename Stream<Real>::Prepared prepared,
             std::unique_ptr<Estimator<Real>> begun) noexcept;
  std::unique_ptr<Estimator<Real>> estimator_of(const Frame& first);
  void read(Points<const Real> points, KnownMask mask);
  FrameReport complete(Points<Real> completed, Clock::time_point start);
  [[nodiscard]] double mean_standard_error() const;

  Settings settings;
  Stream<Real> stream;
  std::unique_ptr<Outliers<Real>> outliers;  // null if outliers are not rejected
  std::vector<Triangle> triangles;
  TrainingFrames training_frames;
  std::uint64_t training_hash = 0;             // of its frames; 0 without training
  std::unique_ptr<Estimator<Real>> estimator;  // of this sequence
  FrameReport report;
};

/// The method of the settings, for a sequence with this frame 0 in the internal order.
template <class Real>
std::unique_ptr<Estimator<Real>> Completer<Real>::Parts::estimator_of(const Frame& first) {
  const Topology& topology = *stream.topology;
  const std::size_t k = first.size();
  if (settings.method == Method::detail) {
    const DetailSettings chosen = {
        triangles,      settings.noise,       training_frames,
        settings.learn, settings.uncertainty, std::numeric_limits<Real>::epsilon()};
    auto detail = std::make_unique<Detail>(widened(first), topology, stream.workers, chosen);
    if constexpr (std::is_same_v<Real, double>) {
      return detail;
    } else {
      return std::make_unique<InDoublePrecision>(std::move(detail), k);
    }
  }
  if (settings.revisit && FastMotion<Real>::supports(k)) {
    return std::make_unique<FastMotion<Real>>(topology.cells, first, settings.extra_iterations,
                                              stream.workers);
  }
  return std::make_unique<Motion<Real>>(topology.cells, first, settings.revisit,
                                        settings.extra_iterations);
}

/// Begins a sequence. If memory is exhausted, nothing has changed.
template <class Real>
void Completer<Real>::Parts::begin(const Frame& first_frame) {
  auto prepared = stream.prepare(first_frame);
  auto begun = estimator_of(prepared.first_frame);
  begin(std::move(prepared), std::move(begun));
}

template <class Real>
void Completer<Real>::Parts::begin(typename Stream<Real>::Prepared prepared,
                                   std::unique_ptr<Estimator<Real>> begun) noexcept {
  estimator = std::move(begun);
  stream.begin(std::move(prepared));
  if (outliers) outliers->reset(stream.first_frame);
  report = {};
  stream.count(report);
}

/// Reads a row for each vertex. Without a mask, finite rows are anchors. Refuses anchors that are
/// out of range.
template <class Real>
void Completer<Real>::Parts::read(Points<const Real> points, KnownMask mask) {
  if (stream.exchange.read(points, mask, stream.current, stream.known)) return;
  for (std::size_t i = 0; i < points.count; ++i) {  // find the one that is out of range
    const std::size_t v = stream.numbering.internal_index(i);
    if (stream.known[v] != 0) check_known_position(i, row(points, i));
  }
}

/// Executes algorithm 1 of the paper for the frame whose anchors have been read. Only the estimate
/// can fail, if memory is exhausted. Nothing that is kept between calls changes before it.
template <class Real>
FrameReport Completer<Real>::Parts::complete(Points<Real> completed, Clock::time_point start) {
  FrameReport made;
  if (outliers) made.rejected = outliers->drop(stream.previous, stream.current, stream.known);
  // Classify the vertices and estimate the satellites: eq. (3) and (4) of method motion.
  made.iterations = static_cast<std::size_t>(
      estimator->estimate(stream.previous, stream.current, stream.known, stream.generations));
  stream.write(completed);
  estimator->remember(stream.current);
  stream.advance();
  stream.count(made);
  made.standard_error = mean_standard_error();
  made.stages = estimator->stages();
  made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  report = made;
  return report;
}

/// The root mean square of the standard errors of the satellites; 0 without any.
template <class Real>
double Completer<Real>::Parts::mean_standard_error() const {
  const std::span<const double> values = estimator->standard_error();
  const std::span<const Index> generation = stream.generations.of_vertices();
  double sum = 0;
  for (std::size_t v = 0; v < values.size(); ++v) {
    if (generation[v] > 0) sum += values[v] * values[v];
  }
  return sum > 0 ? std::sqrt(sum / static_cast<double>(stream.generations.reached())) : 0;
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
  parts_->begin(complete_frame("frame", frame));
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
  Stream<Real>& stream = parts_->stream;
  std::ranges::fill(stream.known, std::uint8_t{0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Index index = indices[i];
    if (index < 0 || static_cast<std::size_t>(index) >= n_vertices()) {
      throw std::invalid_argument("indices: position " + std::to_string(i) + " holds " +
                                  std::to_string(index) + ", but the mesh has " +
                                  std::to_string(n_vertices()) + " vertices, counted from 0");
    }
    const std::size_t v = stream.numbering.internal_index(static_cast<std::size_t>(index));
    if (stream.known[v] != 0) {
      const auto first = std::ranges::find(indices, index) - indices.begin();
      throw std::invalid_argument("indices: vertex " + std::to_string(index) +
                                  " is listed twice, at positions " + std::to_string(first) +
                                  " and " + std::to_string(i));
    }
    stream.known[v] = 1;
    stream.current[v] = row(points, i);
    check_known_position(i, stream.current[v]);
  }
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::skip(Points<Real> completed) {
  const auto start = Clock::now();
  check_output(completed, n_vertices(), {});
  std::ranges::fill(parts_->stream.known, std::uint8_t{0});
  return parts_->complete(completed, start);
}

template <class Real>
std::size_t Completer<Real>::n_vertices() const {
  return parts_->stream.n_vertices();
}
template <class Real>
std::size_t Completer<Real>::n_edges() const {
  return parts_->stream.topology->cells.neighbours.size() / 2;
}
template <class Real>
std::size_t Completer<Real>::n_frames() const {
  return parts_->stream.n_frames;
}
template <class Real>
const Settings& Completer<Real>::settings() const {
  return parts_->settings;
}
template <class Real>
const TopologyReport& Completer<Real>::topology() const {
  return parts_->stream.topology->report;
}
template <class Real>
std::span<const Index> Completer<Real>::generation() const {
  return parts_->stream.generation_of_caller();
}
template <class Real>
std::span<const Index> Completer<Real>::age() const {
  return parts_->stream.age_of_caller();
}
template <class Real>
std::span<const Real> Completer<Real>::standard_error() const {
  if (!settings().uncertainty) {
    throw std::invalid_argument("standard_error: requires uncertainty=True");
  }
  return parts_->stream.in_caller_order(parts_->estimator->standard_error());
}
template <class Real>
const FrameReport& Completer<Real>::report() const {
  return parts_->report;
}

template <class Real>
std::size_t Completer<Real>::state_size() const {
  return size_of_state<Settings>(parts_->stream, parts_->estimator->memory_size());
}

template <class Real>
std::vector<std::byte> Completer<Real>::state() const {
  Writer writer(state_size());
  write_stream(writer, kind, parts_->stream, parts_->settings, parts_->training_hash,
               parts_->report);
  parts_->estimator->write_memory(writer);
  return writer.take_sealed();
}

template <class Real>
void Completer<Real>::restore(std::span<const std::byte> state) {
  Reader reader(state);
  auto stored = read_stream(reader, state, state_size(), kind, parts_->stream, parts_->settings,
                            parts_->training_hash);
  auto prepared = parts_->stream.prepare(stored.first_frame);
  auto estimator = parts_->estimator_of(prepared.first_frame);
  estimator->read_memory(reader, stored.previous);
  // Nothing below can throw.
  parts_->begin(std::move(prepared), std::move(estimator));
  parts_->stream.recall(std::move(stored.previous), std::move(stored.age), std::move(stored.known),
                        stored.n_frames);
  parts_->report = stored.report;
  parts_->stream.count(parts_->report);
  parts_->report.standard_error = parts_->mean_standard_error();
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
