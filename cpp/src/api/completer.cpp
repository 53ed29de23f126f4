#include <algorithm>
#include <dynmesh/completer.hpp>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "api/state.hpp"
#include "api/stream.hpp"
#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"
#include "base/training_frames.hpp"
#include "frame/outliers.hpp"
#include "mesh/leaders.hpp"
#include "motion/motion.hpp"
#include "quality/completion_quality.hpp"
#include "shape/detail.hpp"
#include "shape/disconnected.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/shape_library.hpp"

namespace dynmesh {
namespace {

/// A component whose vertices method motion completes moves without turning if it has fewer, and
/// does not lead others then.
constexpr Index fewest_anchors = 4;

/// Completes frames, by one of the methods, and judges them.
struct Completion {
  using Settings = dynmesh::Settings;
  using Report = FrameReport;

  /// What a state is of. The last character is the version of the format.
  static constexpr StateFormat format = {'d', 'y', 'n', 'm', 'e', 's', 'h', 'M'};
  static constexpr const char* name = "completer";

  Completion(Stream& shared, const Settings& settings, std::vector<Vector3> frame)
      : stream(shared),
        first_frame(std::move(frame)),
        leaders(stream.topology, first_frame, stream.training),
        disconnected(stream.topology, settings.disconnected, leaders,
                     settings.method == Method::detail ? 1 : fewest_anchors),
        quality(stream.topology, first_frame) {
    const Cells& cells = stream.topology.cells;
    Workers& workers = stream.workers;
    if (settings.reject_outliers) outliers = std::make_unique<Outliers>(cells, first_frame);
    if (settings.method == Method::detail) {
      model = std::make_unique<ShapeModel>(stream.topology, stream.faces, first_frame,
                                           stream.training, stream.coordinates.epsilon, workers);
      if (settings.learn) learned = std::make_unique<LearnedModes>(*model, workers);
      detail = std::make_unique<Detail>(*model, learned ? learned->modes() : model->modes, settings,
                                        leaders, workers);
    } else if (stream.coordinates.size == sizeof(float)) {
      motion.emplace<Motion<float>>(cells, first_frame, settings.extra_iterations, settings.revisit,
                                    workers);
    } else {
      motion.emplace<Motion<double>>(cells, first_frame, settings.extra_iterations,
                                     settings.revisit, workers);
    }
  }

  [[nodiscard]] bool is_reusable() const { return learned == nullptr; }

  [[nodiscard]] Memory first_memory() const {
    Memory memory(first_frame);
    memory.departures = leaders.departures();
    memory.completion.ruined = first_frame;
    if (detail) detail->begin(memory);
    return memory;
  }

  /// Completes the report of the last frame of a memory that is frame 0 or was stored.
  void begin(const Memory& memory, FrameReport& report) {
    if (learned) learned->make();
    describe(memory, report);
    if (memory.n_frames == 0) return;  // frame 0 is not judged
    quality.describe(memory, report);
  }

  /// Completes the frame whose anchors are in `next`. Only the estimate can fail, if memory is
  /// exhausted, and nothing that is kept between calls has changed then.
  FrameReport complete(const Memory& memory, Memory& next) {
    FrameReport report;
    if (outliers) report.rejected = outliers->drop(memory.last, next.last, next.known);
    if (detail) {
      next.generations.classify(stream.topology.cells, next.known);
      const auto rotations = detail->complete(memory, next, report);
      disconnected.complete(memory, next, rotations.of_components);
      stream.reset_diverged(memory.last, next.last);
      stream.count_frames(memory, next);
      detail->remember(memory, next, report.stages);
    } else {
      report.iterations = estimate_motion(memory, next);
      disconnected.complete(memory, next);
      const bool may_diverge = next.generations.disconnected_vertices() > 0;
      if (may_diverge) stream.reset_diverged(memory.last, next.last);
      stream.count_frames(memory, next);
    }
    disconnected.remember(memory, next);
    next.completion.first_frame = memory.completion.first_frame;
    next.completion.step = memory.completion.step;
    next.completion.n_ruined = 0;
    describe(next, report);
    quality.judge(memory, next, report);
    if (learned && next.completion.n_ruined == 0) learned->learn(next);
    return report;
  }

  /// What is remembered beside the memory.
  template <class Self, class Visit>
  static void each_number(Self& self, const Visit& visit) {
    if (self.learned) LearnedModes::each_number(*self.learned, visit);
  }

  static void describe(const Memory& memory, FrameReport& report) {
    const std::span<const Index> generation = memory.generations.of_vertices();
    dynmesh::describe(memory, report, [&](std::size_t v) { return generation[v] > 0; });
  }

  std::size_t estimate_motion(const Memory& memory, Memory& next) {
    const auto estimate = [&](auto& method) {
      return method.estimate(memory.last, next.last, next.known, next.generations);
    };
    auto* const in_float = std::get_if<Motion<float>>(&motion);
    return in_float != nullptr ? estimate(*in_float) : estimate(std::get<Motion<double>>(motion));
  }

  Stream& stream;
  std::vector<Vector3> first_frame;
  Leaders leaders;
  Disconnected disconnected;
  CompletionQuality quality;
  std::unique_ptr<Outliers> outliers;       ///< null if outliers are not rejected
  std::unique_ptr<const ShapeModel> model;  ///< null without method detail, like what follows
  std::unique_ptr<LearnedModes> learned;    ///< null if it does not learn
  std::unique_ptr<Detail> detail;
  std::variant<std::monostate, Motion<float>, Motion<double>> motion;
};

using CompletionStream = StreamOf<Completion>;

/// `training` may be null.
template <class Real>
std::unique_ptr<Stream> stream_of(Faces faces, Points<const Real> first_frame,
                                  const Settings& settings, const Training<Real>* training) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  if (training != nullptr && settings.method != Method::detail) {
    throw SettingError("training", "requires method detail");
  }
  if (training != nullptr && settings.learn) {
    throw SettingError("learn",
                       "a completer learns either from its own frames or from a training sequence; "
                       "give one of the two");
  }
  auto frame = first_frame_of(first_frame);
  auto training_frames = training == nullptr ? TrainingFrames() : frames_of(*training, frame);
  return std::make_unique<CompletionStream>(settings, faces, std::move(frame),
                                            default_task_sharing(), coordinates_of<Real>,
                                            std::move(training_frames));
}

/// Completes the frame whose anchors have been read.
template <class Real>
FrameReport complete(CompletionStream& stream, Points<Real> completed,
                     Stream::Clock::time_point start) {
  return stream.finish(stream.solver->complete(stream.memory, stream.next), completed, start);
}

CompletionStream& completion_stream(Stream& stream) {
  return static_cast<CompletionStream&>(stream);
}

}  // namespace

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings)
    : FrameStream(stream_of<Real>(faces, first_frame, settings, nullptr)) {}

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings,
                           const Training<Real>& training)
    : FrameStream(stream_of(faces, first_frame, settings, &training)) {}

template <class Real>
void Completer<Real>::reset(Points<const Real> frame) {
  const DefaultArithmetic arithmetic;
  completion_stream(*stream_).reset(complete_frame("frame", frame, n_vertices()));
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, KnownMask known,
                                  Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Stream::Clock::now();
  check_rows("points", points, n_vertices());
  check_rows("known", known, n_vertices());
  check_output(completed, n_vertices(),
               {{"points", Extent::of(points)}, {"known", Extent::of(known)}});
  stream_->read(points, known);
  return complete(completion_stream(*stream_), completed, start);
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Stream::Clock::now();
  check_rows("points", points, n_vertices());
  check_output(completed, n_vertices(), {{"points", Extent::of(points)}});
  stream_->read(points, KnownMask());
  return complete(completion_stream(*stream_), completed, start);
}

template <class Real>
FrameReport Completer<Real>::push_sparse(std::span<const Index> indices, Points<const Real> points,
                                         Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Stream::Clock::now();
  if (indices.size() != points.count) {
    refuse("points", "has ", points.count, " rows for ", indices.size(), " indices");
  }
  check_view("points", points);
  check_output(completed, n_vertices(),
               {{"indices", Extent::of(indices)}, {"points", Extent::of(points)}});
  Memory& next = stream_->next;
  std::ranges::fill(next.known, std::uint8_t{0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Index v = indices[i];
    if (v < 0 || static_cast<std::size_t>(v) >= n_vertices()) {
      refuse("indices", "position ", i, " holds ", v, ", but the mesh has ", n_vertices(),
             " vertices, counted from 0");
    }
    if (next.known[v] != 0) {
      const auto first = std::ranges::find(indices, v) - indices.begin();
      refuse("indices", "vertex ", v, " is listed twice, at positions ", first, " and ", i);
    }
    next.known[v] = 1;
    next.last[v] = known_row(points, i);
  }
  return complete(completion_stream(*stream_), completed, start);
}

template <class Real>
FrameReport Completer<Real>::skip(Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Stream::Clock::now();
  check_output(completed, n_vertices(), {});
  std::ranges::fill(stream_->next.known, std::uint8_t{0});
  return complete(completion_stream(*stream_), completed, start);
}

template <class Real>
const Settings& Completer<Real>::settings() const {
  return completion_stream(*stream_).settings;
}
template <class Real>
std::span<const Real> Completer<Real>::standard_error() const {
  if (!settings().uncertainty) refuse("standard_error", "requires uncertainty");
  return stream_->standard_errors<Real>();
}
template <class Real>
FrameReport Completer<Real>::report() const {
  return completion_stream(*stream_).report.get();
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
