#include <algorithm>
#include <chrono>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <type_traits>
#include <utility>

#include "completer/completion_quality.hpp"
#include "completer/outliers.hpp"
#include "detail/detail.hpp"
#include "mesh/estimator.hpp"
#include "motion/motion.hpp"
#include "stream/arguments.hpp"
#include "stream/state.hpp"
#include "stream/stream.hpp"
#include "support/default_arithmetic.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
template <class Real>
constexpr StateKind kind = {{'d', 'y', 'n', 'm', 'e', 's', 'h', 'D'}, "completer", sizeof(Real)};

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
      points[v] = saturated<float>(points_[v]);
    }
    return iterations;
  }

  void remember(Frame completed) override { method_->remember(widen(completed, points_)); }

  void write_memory(Writer& writer) const override { method_->write_memory(writer); }
  void read_memory(Reader& reader, Frame completed) override {
    method_->read_memory(reader, widen(completed, points_));
  }
  [[nodiscard]] std::span<const Quaternion> rotations_of_components() const override {
    return method_->rotations_of_components();
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

/// The method of the settings, for a sequence with this frame 0.
template <class Real>
std::unique_ptr<Estimator<Real>> estimator_of(StreamMesh& mesh, const Settings& settings,
                                              const std::vector<Vector3<Real>>& first) {
  if (settings.method == Method::detail) {
    auto detail =
        std::make_unique<Detail>(widened(first), mesh.faces, mesh.topology, mesh.training,
                                 mesh.workers, settings, std::numeric_limits<Real>::epsilon());
    if constexpr (std::is_same_v<Real, double>) {
      return detail;
    } else {
      return std::make_unique<InDoublePrecision>(std::move(detail), first.size());
    }
  }
  const Cells& cells = mesh.topology.cells;
  if (!settings.revisit) {
    return std::make_unique<MotionOnce<Real>>(cells, first, settings.extra_iterations);
  }
  return std::make_unique<Motion<Real>>(cells, first, settings.extra_iterations, mesh.workers);
}

}  // namespace

/// One sequence of frames, completed after the public functions have checked the arguments.
template <class Real>
struct Completer<Real>::Parts {
  using Frame = std::vector<Vector3<Real>>;

  Parts(std::shared_ptr<StreamMesh> of_all, const Settings& chosen, Frame first_frame)
      : mesh(std::move(of_all)),
        settings(chosen),
        stream(*mesh, std::move(first_frame), settings.disconnected),
        outliers(settings.reject_outliers
                     ? std::make_unique<Outliers<Real>>(mesh->topology.cells, stream.first_frame)
                     : nullptr),
        estimator(estimator_of(*mesh, settings, stream.first_frame)),
        quality(mesh->topology.cells, stream.first_frame) {
    stream.keep(estimator->standard_error());
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
    stream.write(completed, estimator->rotations_of_components());
    stream.count(made);
    quality.judge(stream.previous, stream.current, stream.generations.of_vertices(), made);
    estimator->remember(stream.current);
    stream.advance();
    stream.keep(estimator->standard_error());
    made.standard_error = mean_standard_error();
    made.stages = estimator->stages();
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    report = made;
    return report;
  }

  /// The root mean square of the standard errors of the satellites; 0 without any.
  [[nodiscard]] double mean_standard_error() const {
    const std::span<const double> values = estimator->standard_error();
    const std::span<const Index> generation = stream.generations.of_vertices();
    double sum = 0;
    for (std::size_t v = 0; v < values.size(); ++v) {
      if (generation[v] > 0) sum += values[v] * values[v];
    }
    return sum > 0 ? std::sqrt(sum / static_cast<double>(stream.generations.reached())) : 0;
  }

  /// Writes everything that later frames depend on.
  void write(Writer& writer) const {
    begin_state(writer, kind<Real>, *mesh, settings);
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
    stream.keep(estimator->standard_error());
    report.standard_error = mean_standard_error();
  }

  std::shared_ptr<StreamMesh> mesh;  // of all sequences
  Settings settings;
  Stream<Real> stream;
  std::unique_ptr<Outliers<Real>> outliers;  // null if outliers are not rejected
  std::unique_ptr<Estimator<Real>> estimator;
  CompletionQuality<Real> quality;
  FrameReport report;
  std::size_t state_size = 0;
};

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  auto mesh =
      std::make_shared<StreamMesh>(faces, first_frame, settings.threads, default_task_sharing());
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
  auto mesh = std::make_shared<StreamMesh>(faces, first_frame, settings.threads,
                                           default_task_sharing(), &training);
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
  parts_->stream.read(points, {});
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
  Stream<Real>& stream = parts_->stream;
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
    stream.current[v] = row(points, i);
    check_known_position(i, stream.current[v]);
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
  return parts_->stream.standard_error;
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
  Reader reader = open_state(state, state_size(), kind<Real>, *parts_->mesh, settings());
  auto restored = std::make_unique<Parts>(parts_->mesh, parts_->settings,
                                          stored_frame<Real>(reader, n_vertices()));
  restored->read(reader);
  parts_ = std::move(restored);
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
