#include <algorithm>
#include <chrono>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <utility>

#include "api/disconnected.hpp"
#include "api/state.hpp"
#include "api/stream.hpp"
#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "base/training_frames.hpp"
#include "frame/outliers.hpp"
#include "mesh/leaders.hpp"
#include "motion/motion.hpp"
#include "quality/completion_quality.hpp"
#include "shape/detail.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/shape_library.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
constexpr StateFormat completer_state = {'d', 'y', 'n', 'm', 'e', 's', 'h', 'I'};

/// A component whose vertices method motion completes moves without turning if it has fewer, and
/// does not lead others then.
constexpr Index fewest_anchors = 4;

}  // namespace

/// Completes frames, by one of the methods, and judges them.
template <class Real>
struct CompletionSolver final : StreamSolver {
  /// Method detail.
  struct OfDetail {
    OfDetail(Field first_frame, StreamMesh& mesh, const Settings& settings, double epsilon,
             Leaders& leaders)
        : model(mesh.topology, mesh.faces, first_frame, mesh.training, epsilon, mesh.workers),
          learned(settings.learn ? std::make_unique<LearnedModes>(model, mesh.workers) : nullptr),
          detail(model, learned ? learned->modes() : model.modes, settings, leaders, mesh.workers) {
    }

    const ShapeModel model;
    std::unique_ptr<LearnedModes> learned;  // null if it does not learn
    Detail detail;
  };

  CompletionSolver(StreamMesh& mesh, const Settings& settings, std::vector<Vector3> frame)
      : StreamSolver(std::move(frame)),
        leaders(mesh.topology, first_frame, mesh.training),
        disconnected(mesh.topology, settings.disconnected, leaders,
                     settings.method == Method::detail ? 1 : fewest_anchors),
        outliers(settings.reject_outliers
                     ? std::make_unique<Outliers>(mesh.topology.cells, first_frame)
                     : nullptr),
        quality(mesh.topology.cells, first_frame) {
    if (settings.method == Method::detail) {
      of_detail = std::make_unique<OfDetail>(first_frame, mesh, settings,
                                             std::numeric_limits<Real>::epsilon(), leaders);
    } else {
      motion =
          std::make_unique<Motion<Real>>(mesh.topology.cells, first_frame,
                                         settings.extra_iterations, settings.revisit, mesh.workers);
    }
  }

  /// Null if nothing is learned.
  [[nodiscard]] LearnedModes* learned() { return of_detail ? of_detail->learned.get() : nullptr; }

  Leaders leaders;
  Disconnected disconnected;
  std::unique_ptr<Outliers> outliers;  ///< null if outliers are not rejected
  CompletionQuality quality;
  std::unique_ptr<OfDetail> of_detail;  ///< one of the two is null
  std::unique_ptr<Motion<Real>> motion;
};

using CompletionMesh = StreamMeshOf<Settings, FrameReport>;

/// One sequence of frames, completed after the public functions have checked the arguments.
template <class Real>
struct Completer<Real>::Parts final : FrameStream::Parts {
  using Solver = CompletionSolver<Real>;

  Parts(const std::shared_ptr<CompletionMesh>& of_all, std::shared_ptr<Solver> of_frame)
      : FrameStream::Parts(of_all, of_frame, dynmesh::largest_coordinate<Real>),
        own(of_all),
        settings(of_all->settings),
        solver(*of_frame) {
    memory.departures = solver.leaders.departures();
    if (solver.of_detail) solver.of_detail->detail.begin(memory);
    next = memory;
    standard_error.resize(memory.errors.standard_errors.size());
    tell_errors(report);
    count(memory.generations, report);
  }
  Parts(const std::shared_ptr<CompletionMesh>& of_all, Frame frame)
      : Parts(of_all, std::make_shared<Solver>(*of_all, of_all->settings, std::move(frame))) {}

  /// Completes the frame whose anchors have been read. Only the estimate can fail, if memory is
  /// exhausted, and nothing that is kept between calls changes before `advance`.
  FrameReport complete(Points<Real> completed, Clock::time_point start) {
    FrameReport made;
    if (solver.outliers) {
      made.rejected = solver.outliers->drop(memory.last, next.last, next.known);
    }
    if (solver.motion) {
      made.iterations =
          solver.motion->estimate(memory.last, next.last, next.known, next.generations);
      solver.disconnected.complete(memory, next);
      if (next.generations.disconnected_vertices() > 0) reset_diverged();
      count_frames();
    } else {
      Detail& detail = solver.of_detail->detail;
      next.generations.classify(mesh->topology.cells, next.known);
      made.iterations = detail.estimate(memory, next, made.stages);
      solver.disconnected.complete(memory, next, detail.rotations_of_components());
      finish();
      detail.remember(memory, next, made.stages);
    }
    solver.disconnected.remember(memory, next);
    next.verdict = memory.verdict;
    count(next.generations, made);
    solver.quality.judge(memory.last, next.last, next.generations.of_vertices(), next.verdict,
                         made);
    advance();
    if (LearnedModes* learned = solver.learned()) learned->learn(memory);
    this->put(completed);
    tell_errors(made);
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    report = made;
    publish();
    return report;
  }

  /// Tells the standard errors, and the root mean square of those of the satellites; 0 without any.
  void tell_errors(FrameReport& of_frame) {
    const std::span<const double> values = memory.errors.standard_errors;
    std::ranges::transform(values, standard_error.begin(), saturated_or_infinite<Real>);
    const std::span<const Index> generation = memory.generations.of_vertices();
    double sum = 0;
    for (std::size_t v = 0; v < values.size(); ++v) {
      if (generation[v] > 0) sum += values[v] * values[v];
    }
    of_frame.standard_error =
        sum > 0 ? std::sqrt(sum / static_cast<double>(memory.generations.reached())) : 0;
  }

  [[nodiscard]] std::unique_ptr<FrameStream::Parts> begun(Frame frame) const override {
    if (begins_with(frame) && !settings.learn) {
      return std::make_unique<Parts>(own, std::static_pointer_cast<Solver>(shared_solver));
    }
    return std::make_unique<Parts>(own, std::move(frame));
  }
  void publish_report() const noexcept override { own->report.set(report); }

  /// What a state is of.
  static StateKind kind() { return {completer_state, "completer", sizeof(Real)}; }

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
    if (LearnedModes* learned = solver.learned()) learned->make();
    count(memory.generations, report);
    if (memory.n_frames > 0) {  // frame 0 is not judged
      solver.quality.tell(memory.last, memory.generations.of_vertices(), memory.verdict, report);
    }
    tell_errors(report);
  }

  template <class Self, class Visit>
  static void for_each_number(Self& self, const Visit& visit) {
    for_each_stored_field(self.report, visit);
    each_number(self.memory, visit);
    if (auto* learned = self.solver.learned()) LearnedModes::each_number(*learned, visit);
  }

  std::shared_ptr<CompletionMesh> own;  // `mesh`
  const Settings& settings;
  Solver& solver;
  std::vector<Real> standard_error;  // (k,), or empty
  FrameReport report;
};

template <class Real>
Completer<Real>::Completer(Faces faces, Points<const Real> first_frame, const Settings& settings) {
  const DefaultArithmetic arithmetic;
  check_settings(settings);
  auto frame = first_frame_of(first_frame);
  const auto mesh =
      std::make_shared<CompletionMesh>(settings, faces, frame.size(), default_task_sharing());
  begin(std::make_unique<Parts>(mesh, std::move(frame)));
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
  const auto mesh = std::make_shared<CompletionMesh>(
      settings, faces, frame.size(), default_task_sharing(), frames_of(training, frame));
  begin(std::make_unique<Parts>(mesh, std::move(frame)));
}

template <class Real>
typename Completer<Real>::Parts& Completer<Real>::parts() const {
  return static_cast<Parts&>(*parts_);
}

template <class Real>
void Completer<Real>::reset(Points<const Real> frame) {
  const DefaultArithmetic arithmetic;
  check_rows("frame", frame, n_vertices());
  replace(parts().begun(complete_frame("frame", frame)));
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
  parts().read(points, known);
  return parts().complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::push(Points<const Real> points, Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_rows("points", points, n_vertices());
  check_output(completed, n_vertices(), {{"points", Extent::of(points)}});
  parts().read(points, KnownMask());
  return parts().complete(completed, start);
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
  Memory& next = parts().next;
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
  return parts().complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::skip(Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_output(completed, n_vertices(), {});
  std::ranges::fill(parts().next.known, std::uint8_t{0});
  return parts().complete(completed, start);
}

template <class Real>
const Settings& Completer<Real>::settings() const {
  return static_cast<const CompletionMesh&>(*mesh_).settings;
}
template <class Real>
std::span<const Real> Completer<Real>::standard_error() const {
  if (!settings().uncertainty) refuse("standard_error", "requires uncertainty");
  return parts().standard_error;
}
template <class Real>
FrameReport Completer<Real>::report() const {
  return static_cast<const CompletionMesh&>(*mesh_).report.get();
}

template class Completer<float>;
template class Completer<double>;

}  // namespace dynmesh
