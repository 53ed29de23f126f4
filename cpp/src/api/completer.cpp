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
#include "motion/motion.hpp"
#include "shape/detail.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/shape_library.hpp"

namespace dynmesh {
namespace {

using Clock = std::chrono::steady_clock;

/// The last character is the version of the format.
constexpr StateFormat completer_state = {'d', 'y', 'n', 'm', 'e', 's', 'h', 'F'};

}  // namespace

/// One sequence of frames, completed after the public functions have checked the arguments.
template <class Real>
struct Completer<Real>::Parts {
  /// Method detail of one sequence.
  struct OfDetail {
    OfDetail(const Stream& stream, StreamMesh& mesh, const Settings& settings, double epsilon)
        : model(mesh.topology, mesh.faces, stream.first_frame, mesh.training, epsilon,
                mesh.workers),
          learned(settings.learn ? std::make_unique<LearnedModes>(model, mesh.workers) : nullptr),
          detail(model, learned ? learned->modes() : model.modes, settings, mesh.workers) {}

    const ShapeModel model;
    std::unique_ptr<LearnedModes> learned;  // null if it does not learn
    Detail detail;
  };

  Parts(std::shared_ptr<StreamMesh> of_all, const Settings& chosen, Stream::Frame first_frame)
      : mesh(std::move(of_all)),
        settings(chosen),
        stream(*mesh, std::move(first_frame), settings.disconnected, largest_coordinate<Real>),
        outliers(settings.reject_outliers
                     ? std::make_unique<Outliers>(mesh->topology.cells, stream.first_frame)
                     : nullptr),
        quality(mesh->topology.cells, stream.first_frame) {
    if (settings.method == Method::detail) {
      of_detail =
          std::make_unique<OfDetail>(stream, *mesh, settings, std::numeric_limits<Real>::epsilon());
      of_detail->detail.begin(stream.memory);
      stream.next = stream.memory;
    } else {
      motion = std::make_unique<Motion>(mesh->topology.cells, stream.first_frame,
                                        settings.extra_iterations, settings.revisit, mesh->workers);
    }
    standard_error.resize(stream.memory.errors.standard_errors.size());
    tell_errors(report);
    count(stream.memory.generations, report);
    Writer writer;
    write(writer);
    state_size = writer.take_sealed().size();
  }

  /// Completes the frame whose anchors have been read. Only the estimate can fail, if memory is
  /// exhausted, and nothing that is kept between calls changes before `advance`.
  FrameReport complete(Points<Real> completed, Clock::time_point start) {
    Memory& memory = stream.memory;
    Memory& next = stream.next;
    FrameReport made;
    if (outliers) made.rejected = outliers->drop(memory.last, next.last, next.known);
    if (motion) {
      made.iterations = motion->estimate(memory.last, next.last, next.known, next.generations);
      stream.finish();
    } else {
      next.generations.classify(mesh->topology.cells, next.known);
      made.iterations = of_detail->detail.estimate(memory, next, made.stages);
      stream.finish(of_detail->detail.rotations_of_components());
      of_detail->detail.remember(memory, next, made.stages);
    }
    next.verdict = memory.verdict;
    count(next.generations, made);
    quality.judge(memory.last, next.last, next.generations.of_vertices(), next.verdict, made);
    stream.advance();
    if (of_detail && of_detail->learned) of_detail->learned->learn(memory);
    stream.write(completed);
    tell_errors(made);
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    report = made;
    return report;
  }

  /// Tells the standard errors, and the root mean square of those of the satellites; 0 without any.
  void tell_errors(FrameReport& of_frame) {
    const std::span<const double> values = stream.memory.errors.standard_errors;
    std::ranges::transform(values, standard_error.begin(), saturated_or_infinite<Real>);
    const std::span<const Index> generation = stream.memory.generations.of_vertices();
    double sum = 0;
    for (std::size_t v = 0; v < values.size(); ++v) {
      if (generation[v] > 0) sum += values[v] * values[v];
    }
    of_frame.standard_error =
        sum > 0 ? std::sqrt(sum / static_cast<double>(stream.memory.generations.reached())) : 0;
  }

  /// What a state is of.
  static StateKind kind() { return {completer_state, "completer", sizeof(Real)}; }

  /// Writes everything that later frames depend on.
  void write(Writer& writer) const {
    begin_state(writer, kind(), *mesh, settings);
    writer.write(stream.first_frame);
    for_each_number(*this, NumberWriter(writer));
  }

  /// Reads what follows frame 0.
  void read(Reader& reader) {
    for_each_number(*this, NumberReader(reader));
    stream.check();
    if (of_detail && of_detail->learned) of_detail->learned->make();
    count(stream.memory.generations, report);
    quality.tell(stream.memory.last, stream.memory.generations.of_vertices(), stream.memory.verdict,
                 report);
    tell_errors(report);
  }

  template <class Self, class Visit>
  static void for_each_number(Self& self, const Visit& visit) {
    for_each_stored_field(self.report, visit);
    each_number(self.stream.memory, visit);
    if (self.of_detail && self.of_detail->learned)
      LearnedModes::each_number(*self.of_detail->learned, visit);
  }

  std::shared_ptr<StreamMesh> mesh;  // of all sequences
  Settings settings;
  Stream stream;
  std::unique_ptr<Outliers> outliers;  // null if outliers are not rejected
  CompletionQuality quality;
  std::unique_ptr<OfDetail> of_detail;  // one of the two is null
  std::unique_ptr<Motion> motion;
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
  Memory& next = parts_->stream.next;
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
  return parts_->complete(completed, start);
}

template <class Real>
FrameReport Completer<Real>::skip(Points<Real> completed) {
  const DefaultArithmetic arithmetic;
  const auto start = Clock::now();
  check_output(completed, n_vertices(), {});
  std::ranges::fill(parts_->stream.next.known, std::uint8_t{0});
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
  return parts_->stream.memory.n_frames;
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
  return parts_->stream.memory.generations.of_vertices();
}
template <class Real>
std::span<const Index> Completer<Real>::age() const {
  return parts_->stream.memory.age;
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
