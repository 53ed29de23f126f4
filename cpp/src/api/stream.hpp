/// What completers and trackers share: one stream of frames of one mesh.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/frame_stream.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "api/published.hpp"
#include "api/state.hpp"
#include "base/geometry.hpp"
#include "base/stored_numbers.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "shape/memory.hpp"

namespace dynmesh {

/// The type in which positions are given.
struct Coordinates {
  std::size_t size;  ///< in bytes
  double largest;
  double epsilon;
};
template <class Real>
constexpr Coordinates coordinates_of = {sizeof(Real), largest_coordinate<Real>,
                                        std::numeric_limits<Real>::epsilon()};

/// A mesh, and the memory of one sequence of its frames. `reset` and `restore` begin another
/// sequence in place, so that any thread may read what is constant, and what is published, at any
/// time.
struct Stream {
  using Clock = std::chrono::steady_clock;

  Stream(Faces mesh_faces, std::size_t n_vertices, Index threads, const TaskSharing& sharing,
         const Coordinates& given, TrainingFrames training_frames);
  virtual ~Stream() = default;
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  Stream(Stream&&) = delete;
  Stream& operator=(Stream&&) = delete;

  /// Everything that later frames depend on.
  virtual void write(Writer& writer) const = 0;
  /// Continues from what was written. If it throws, nothing has changed.
  virtual void restore(std::span<const std::byte> state) = 0;

  /// Reads a row for each vertex into the next frame. Without a mask, finite rows are known.
  /// Refuses known rows that are out of range.
  template <class Real>
  void read(Points<const Real> rows, KnownMask mask);
  /// Resets vertices whose estimate has diverged to the frame before, since a NaN would spread to
  /// later frames.
  void reset_diverged(Field previous, std::span<Vector3> completed);
  /// Finds the ages, from the anchors of the next frame.
  void count_frames(const Memory& last, Memory& following);
  /// The next frame becomes the last one.
  void advance() noexcept;
  /// Copies the last frame to the caller's rows.
  template <class Real>
  void put(Points<Real> completed);
  /// (k,) of the last frame, or empty.
  template <class Real>
  [[nodiscard]] std::span<const Real> standard_errors() const {
    if constexpr (std::is_same_v<Real, double>) {
      return memory.errors.standard_errors;
    } else {
      return rounded_errors;
    }
  }

  [[nodiscard]] std::size_t n_vertices() const { return topology.cells.size(); }

  const Coordinates coordinates;
  const TrainingFrames training;  ///< empty without training
  const Topology topology;
  const std::vector<Triangle> faces;
  Workers workers;
  std::uint64_t training_hash = 0;        ///< of the training frames; 0 without training
  std::size_t state_size = 0;             ///< of all states
  std::atomic<std::size_t> n_frames = 0;  ///< of the sequence
  Memory memory, next;                    ///< of the last frame, and of the next one
  /// How well the last frame of a tracker explains what each sensor measured.
  std::vector<Agreement> sensor_agreements;

 protected:
  void round_errors() noexcept;

  std::vector<float> rounded_errors;  ///< of the last frame, if positions are float
};

/// Reports the numbers of vertices of a frame, and the root mean square of the standard errors of
/// those for which `is_counted(v)`; 0 without any.
template <class IsCounted>
void describe(const Memory& memory, FrameReport& report, const IsCounted& is_counted) {
  report.known = memory.generations.anchors();
  report.filled = memory.generations.reached();
  report.disconnected = memory.generations.disconnected_vertices();
  const std::span<const double> errors = memory.errors.standard_errors;
  double sum = 0;
  std::size_t n = 0;
  for (std::size_t v = 0; v < errors.size(); ++v) {
    if (!is_counted(v)) continue;
    sum += errors[v] * errors[v];
    ++n;
  }
  report.standard_error = n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
}

/// A stream with its settings and the report of its last frame. A `Solver` finds frames of the
/// sequences that begin with the same frame. Nothing is in it on which a later frame depends, but
/// for the modes of a completer that learns.
template <class Solver>
struct StreamOf final : Stream {
  using Settings = typename Solver::Settings;
  using Report = typename Solver::Report;

  StreamOf(const Settings& chosen, Faces mesh_faces, std::vector<Vector3> first_frame,
           const TaskSharing& sharing, const Coordinates& given, TrainingFrames training_frames)
      : Stream(mesh_faces, first_frame.size(), chosen.threads, sharing, given,
               std::move(training_frames)),
        settings(chosen) {
    reset(std::move(first_frame));
    Writer writer;
    StreamOf::write(writer);
    state_size = writer.take_sealed().size();
  }

  /// Begins a sequence with this frame.
  void reset(std::vector<Vector3> first_frame) {
    auto with = solver_for(std::move(first_frame));
    Memory begun = with->first_memory();
    begin(std::move(with), std::move(begun), {});
  }

  void write(Writer& writer) const override {
    write_head(writer, kind(), *this, settings);
    writer.write(solver->first_frame);
    each_number(*solver, memory, report.get(),
                [&](const auto& numbers, bool = true) { writer.write(numbers); });
  }

  void restore(std::span<const std::byte> state) override {
    Reader reader = read_head(state, kind(), *this, settings);
    std::vector<Vector3> first_frame(n_vertices());
    reader.read(first_frame, false);
    check_stored_frame(first_frame, coordinates.largest);
    auto with = solver_for(std::move(first_frame));
    Memory restored = with->first_memory();
    Report stored;
    each_number(*with, restored, stored,
                [&](auto& numbers, bool is_finite = true) { reader.read(numbers, is_finite); });
    check_memory(restored, coordinates.largest);
    restored.generations.classify(topology.cells, restored.known);
    begin(std::move(with), std::move(restored), stored);
  }

  /// Ends a frame whose memory is the next one.
  template <class Real>
  Report finish(Report made, Points<Real> completed, Clock::time_point start) {
    advance();
    put(completed);
    made.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    publish(made);
    return made;
  }

  Settings settings;
  Published<Report> report;  ///< of the last frame
  std::shared_ptr<Solver> solver;

 private:
  [[nodiscard]] StateKind kind() const { return {Solver::format, Solver::name, coordinates.size}; }

  template <class S, class M, class R, class Visit>
  static void each_number(S& solver, M& memory, R&& report, const Visit& visit) {
    for_each_stored_field(report, visit);
    dynmesh::each_number(memory, visit);
    Solver::each_number(solver, visit);
  }

  /// That of this frame 0, bit for bit, or a new one.
  [[nodiscard]] std::shared_ptr<Solver> solver_for(std::vector<Vector3> first_frame) {
    const auto bytes = [](Field frame) { return std::as_bytes(frame); };
    if (solver && solver->is_reusable() &&
        std::ranges::equal(bytes(first_frame), bytes(solver->first_frame))) {
      return solver;
    }
    return std::make_shared<Solver>(*this, settings, std::move(first_frame));
  }

  void begin(std::shared_ptr<Solver> with, Memory begun, Report last) {
    with->begin(begun, last);
    Memory spare = begun;
    const std::size_t n_errors = begun.errors.standard_errors.size();
    std::vector<float> errors(coordinates.size == sizeof(float) ? n_errors : 0);
    // Nothing can fail any more.
    static_assert(std::is_nothrow_swappable_v<Memory>);
    solver.swap(with);
    std::swap(memory, begun);
    std::swap(next, spare);
    rounded_errors.swap(errors);
    round_errors();
    sensor_agreements.clear();
    publish(last);
  }

  void publish(const Report& last) noexcept {
    report.set(last);
    n_frames.store(memory.n_frames);
  }
};

}  // namespace dynmesh
