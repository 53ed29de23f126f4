#include <algorithm>
#include <chrono>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <utility>

#include "api/completion_quality.hpp"
#include "api/outliers.hpp"
#include "api/state.hpp"
#include "api/stream.hpp"
#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "base/training_frames.hpp"
#include "frame/estimator.hpp"
#include "motion/motion.hpp"
#include "shape/detail.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
constexpr StateFormat completer_state = {'d', 'y', 'n', 'm', 'e', 's', 'h', 'E'};

/// The method of the settings, for a sequence with this frame 0. `epsilon` is that of the type in
/// which positions are given.
std::unique_ptr<Estimator> estimator_of(StreamMesh& mesh, const Settings& settings,
                                        const Stream::Frame& first, double epsilon) {
  if (settings.method == Method::detail) {
    return std::make_unique<Detail>(first, mesh.faces, mesh.topology, mesh.training, mesh.workers,
                                    settings, epsilon);
  }
  return std::make_unique<Motion>(mesh.topology.cells, first, settings.extra_iterations,
                                  settings.revisit, mesh.workers);
}

}  // namespace

/// One sequence of frames, completed after the public functions have checked the arguments.
template <class Real>
struct Completer<Real>::Parts {
  Parts(std::shared_ptr<StreamMesh> of_all, const Settings& chosen, Stream::Frame first_frame)
      : mesh(std::move(of_all)),
        settings(chosen),
        stream(*mesh, std::move(first_frame), settings.disconnected, largest_coordinate<Real>),
        outliers(settings.reject_outliers
                     ? std::make_unique<Outliers>(mesh->topology.cells, stream.first_frame)
                     : nullptr),
        estimator(estimator_of(*mesh, settings, stream.first_frame,
                               std::numeric_limits<Real>::epsilon())),
        quality(mesh->topology.cells, stream.first_frame),
        standard_error(estimator->standard_error().size()) {
    tell_errors(report);
    stream.count(report);
    Writer writer;
    write(writer);
    state_size = writer.take_sealed().size();
  }

  /// Executes algorithm 1 of the paper for the frame whose anchors have been read. Only the
  /// estimate can fail, if memory is exhausted. Nothing that is kept between calls changes before
  /// it.
  FrameReport complete(Points<Real> completed, Clock::time_point start) {
    FrameReport made;
    if (outliers) {
      made.rejected = outliers->drop(stream.previous, stream.current, stream.current_known);
    }
    // Classify the vertices and estimate the satellites: eq. (3) and (4) of method motion.
    made.iterations = static_cast<std::size_t>(estimator->estimate(
        stream.previous, stream.current, stream.current_known, stream.generations));
    stream.finish(estimator->rotations_of_components());
    stream.count(made);
    quality.judge(stream.previous, stream.current, stream.generations.of_vertices(), made);
    estimator->remember(stream.current);
    stream.advance();
    stream.write(completed);
    tell_errors(made);
    made.stages = estimator->stages();
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    report = made;
    return report;
  }

  /// Tells the standard errors, and the root mean square of those of the satellites; 0 without any.
  void tell_errors(FrameReport& of_frame) {
    const std::span<const double> values = estimator->standard_error();
    std::ranges::transform(values, standard_error.begin(), saturated_or_infinite<Real>);
    const std::span<const Index> generation = stream.generations.of_vertices();
    double sum = 0;
    for (std::size_t v = 0; v < values.size(); ++v) {
      if (generation[v] > 0) sum += values[v] * values[v];
    }
    of_frame.standard_error =
        sum > 0 ? std::sqrt(sum / static_cast<double>(stream.generations.reached())) : 0;
  }

  /// What a state is of.
  static StateKind kind() { return {completer_state, "completer", sizeof(Real)}; }

  /// Writes everything that later frames depend on.
  void write(Writer& writer) const {
    begin_state(writer, kind(), *mesh, settings);
    writer.write(stream.first_frame);
    for_each_stored_field(report, [&](const auto& field) { writer.write(field); });
    write_fields(writer, stream);
    write_fields(writer, quality);
    estimator->write_memory(writer);
  }

  /// Reads what follows frame 0.
  void read(Reader& reader) {
    for_each_stored_field(report, [&](auto& field) { reader.read_finite(std::span(&field, 1)); });
    read_fields(reader, stream);
    stream.recall();
    stream.count(report);
    read_fields(reader, quality);
    quality.recall(stream.previous, stream.generations.of_vertices(), report);
    estimator->read_memory(reader, stream.previous);
    tell_errors(report);
  }

  std::shared_ptr<StreamMesh> mesh;  // of all sequences
  Settings settings;
  Stream stream;
  std::unique_ptr<Outliers> outliers;  // null if outliers are not rejected
  std::unique_ptr<Estimator> estimator;
  CompletionQuality<double> quality;
  std::vector<Real> standard_error;  // (k,), or empty
  FrameReport report;
  std::size_t state_size = 0;
};

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  auto mesh =
      std::make_shared<StreamMesh>(faces, frame.size(), settings.threads, default_task_sharing());
  parts_ = std::make_unique<Parts>(std::move(mesh), settings, std::move(frame));
}

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings,
                           const Training<Real>& training) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  if (settings.method != Method::detail) {
    throw SettingError("training", "requires method detail");
  }
  if (settings.learn) {
    throw SettingError("learn",
                       "a completer learns either from its own frames or from a training sequence; "
                       "give one of the two");
  }
  auto frame = first_frame_of(first_frame);
  auto mesh = std::make_shared<StreamMesh>(faces, frame.size(), settings.threads,
                                           default_task_sharing(), frames_of(training, frame));
  parts_ = std::make_unique<Parts>(std::move(mesh), settings, std::move(frame));
}

template <class Real>
Completer<Real>::~Completer() = default;
template <class Real>
Completer<Real>::Completer(Completer&&) noexcept = default;
template <class Real>
Completer<Real>& Completer<Real>::operator=(Completer&&) noexcept = default;

template <class Real>
void Completer<Real>::reset(Points<const Real> frame) {
  const DefaultArithmetic arithmetic;
  check_rows("frame", frame, n_vertices());
  parts_ = std::make_unique<Parts>(parts_->mesh, parts_->settings, complete_frame("frame", frame));
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, KnownMask known,
                                  Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_rows("points", points, n_vertices());
  check_rows("known", known, n_vertices());
  check_output(completed, n_vertices(),
               {{"points", Extent::of(points)}, {"known", Extent::of(known)}});
  parts_->stream.read(points, known);
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_rows("points", points, n_vertices());
  check_output(completed, n_vertices(), {{"points", Extent::of(points)}});
  parts_->stream.read(points, KnownMask());
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push_sparse(std::span<const Index> indices, Points<const Real> points,
                                         Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  if (indices.size() != points.count) {
    refuse("points", "has ", points.count, " rows for ", indices.size(), " indices");
  }
  check_view("points", points);
  check_output(completed, n_vertices(),
               {{"indices", Extent::of(indices)}, {"points", Extent::of(points)}});
  Stream& stream = parts_->stream;
  std::ranges::fill(stream.current_known, std::uint8_t{0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Index v = indices[i];
    if (v < 0 || static_cast<std::size_t>(v) >= n_vertices()) {
      refuse("indices", "position ", i, " holds ", v, ", but the mesh has ", n_vertices(),
             " vertices, counted from 0");
    }
    if (stream.current_known[v] != 0) {
      const auto first = std::ranges::find(indices, v) - indices.begin();
      refuse("indices", "vertex ", v, " is listed twice, at positions ", first, " and ", i);
    }
    stream.current_known[v] = 1;
    stream.current[v] = known_row(points, i);
  }
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::skip(Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_output(completed, n_vertices(), {});
  std::ranges::fill(parts_->stream.current_known, std::uint8_t{0});
  return parts_->complete(completed, start);
}

template <class Real>
std::size_t Completer<Real>::n_vertices() const {
  return parts_->stream.n_vertices();
}
template <class Real>
std::size_t Completer<Real>::n_edges() const {
  return parts_->mesh->topology.cells.neighbours.size() / 2;
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
  return parts_->mesh->topology.report;
}
template <class Real>
std::span<const Index> Completer<Real>::generation() const {
  return parts_->stream.generations.of_vertices();
}
template <class Real>
std::span<const Index> Completer<Real>::age() const {
  return parts_->stream.age;
}
template <class Real>
std::span<const Real> Completer<Real>::standard_error() const {
  if (!settings().uncertainty) refuse("standard_error", "requires uncertainty");
  return parts_->standard_error;
}
template <class Real>
const FrameReport& Completer<Real>::report() const {
  return parts_->report;
}

template <class Real>
std::size_t Completer<Real>::state_size() const {
  return parts_->state_size;
}

template <class Real>
std::vector<std::byte> Completer<Real>::state() const {
  Writer writer(state_size());
  parts_->write(writer);
  return writer.take_sealed();
}

template <class Real>
void Completer<Real>::restore(std::span<const std::byte> state) {
  const DefaultArithmetic arithmetic;
  Reader reader = open_state(state, state_size(), Parts::kind(), *parts_->mesh, settings());
  auto restored = std::make_unique<Parts>(
      parts_->mesh, parts_->settings, stored_frame(reader, n_vertices(), largest_coordinate<Real>));
  restored->read(reader);
  parts_ = std::move(restored);
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
