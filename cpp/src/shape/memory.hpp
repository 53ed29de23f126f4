/// What later frames of a sequence depend on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "frame/generations.hpp"
#include "kernels/rotation_kernels.hpp"
#include "shape/constants.hpp"

namespace dynmesh {

/// What earlier frames say about modes.
struct FitMemory {
  std::vector<double> coefficients;  ///< a, as if there were all parts; empty if it begins at 0
  double residual_variance = -1;     ///< sigma^2; negative before the first fit
  double size = 0;                   ///< N_v, the evidence: the squared coefficients,
  double determined = 0;             ///< D_v, and how many of them were determined
  double explained = 0;              ///< the share of |r|^2 that the modes explain, lately
  double prior_weight = 0;           ///< k of the last fit, 0 to 1
  double prior_share = 0;            ///< the share of |r|^2 that the modes explained in it
};

/// How much smaller errors were with each share of a first-order step than without it.
struct Gains {
  static constexpr std::size_t n_steps = 3;    // see FirstOrder
  static constexpr std::size_t n_shares = 10;  // 0.1, 0.2, ... 1; a share of 0 gains nothing
  template <std::size_t n>
  using OfSteps = std::array<double, n * n_shares>;  // one step after another

  OfSteps<n_steps> sums{};
  /// The squares of how much more each of the later steps gained than as much of the first one.
  OfSteps<n_steps - 1> squares{};
  double count = 0;  ///< the number of errors
  double rings = 0;  ///< the sum of the edges from where they were to the nearest other anchor
};
struct GainMemory {
  std::vector<Gains> components;  ///< of earlier tests, the less the older
  std::uint64_t frame = 0;        ///< since frame 0
};

/// Squares of residuals, or sums of them over earlier frames, each weighted less than the next: x
/// is that of the residuals found in the frames, y that of the residuals expected by the ensemble.
using Energy = Vector3;

/// What is known of how a component turns otherwise than what leads it; see turn_errors.hpp.
struct TurnMemory {
  Energy found;                    ///< squared angles, and the number of axes: sums
  std::array<Vector3, 3> error{};  ///< the expected error of its rotation, rows of a matrix
};

/// The ensemble of errors; all vectors are empty if standard errors are not wanted.
struct Ensemble {
  std::vector<Vector3> errors;    ///< (3 k,) e, of the shape in memory
  std::vector<Vector3> changes;   ///< (3 k,) eta, how the true shape changes, of unit size
  std::vector<Energy> energies;   ///< (k,) of earlier frames, around each vertex
  Energy energy;                  ///< of earlier frames, over the mesh
  Energy of_noise, of_shape;      ///< of recent frames, over the mesh, for noise of size 1
  std::uint64_t frame = 0;        ///< the number of frames since the ensemble was begun
  std::vector<TurnMemory> turns;  ///< (components,), if there are several
  Energy turns_of_all;            ///< squared angles and axes, as of one of them
};
/// What standard errors follow from, and themselves.
struct ErrorMemory : Ensemble {
  std::vector<double> standard_errors;  ///< (k,) of the last frame
};

/// Whether frame 0 fits the first frames; see quality/completion_quality.hpp.
struct FirstFrameCheck {
  static constexpr std::uint8_t fits = 0;
  static constexpr std::uint8_t is_other = 1;
  static constexpr std::uint8_t is_mirrored = 2;
  static constexpr std::uint8_t is_reordered = 3;

  Index n_judged = 0;       ///< frames, up to a limit
  double sum_of_steps = 0;  ///< changes between them
  std::uint8_t result = fits;
};

/// Whether a frame follows from the one before; see quality/completion_quality.hpp.
struct StepCheck {
  static constexpr std::uint8_t follows = 0;
  static constexpr std::uint8_t is_other = 1;
  static constexpr std::uint8_t is_mirrored = 2;

  // What is usual from frame to frame, and of how many steps, up to a limit:
  double change = 0;   ///< of edges
  double scatter = 0;  ///< of it, beside what is common to all edges
  double turned = 0;   ///< what no rotation explains, as a share of the squared size
  Index n_changes = 0;
  Index n_turns = 0;
  std::uint8_t result = follows;
};

/// What completers alone remember.
struct CompletionMemory {
  std::vector<Vector3> u;                         ///< (k,) the recent change of m per frame
  double lambda = detail_constants.first_lambda;  ///< the weight of noisy anchors, in the unit of K
  GainMemory gains;
  FirstFrameCheck first_frame;
  StepCheck step;
  /// (k,) The last frame that was ruined. It is the one that was completed while `n_ruined` is not
  /// 0; what else is remembered is then of the last frame before that was not.
  std::vector<Vector3> ruined;
  Index n_ruined = 0;  ///< in a row, each of which agrees with the one before, up to a limit
};

/// What is usual of a number: its mean, and its mean deviation from that.
struct Usual {
  double mean = 0;
  double deviation = 0;
};

/// What the good frames of a tracker were like, the less the older: the numbers of their measures.
struct RecentFrames {
  double count = 0;
  Usual missing;  ///< 1 - explained
  Usual hole, stretch, change, parted;
  double growth = 1;  ///< of the last one
};

/// The colours of a surface, as they were where each vertex was first measured.
struct SurfaceColours {
  std::vector<Vector3> of_vertices;    ///< (k,) 0 where they are not known
  std::vector<std::uint8_t> is_known;  ///< (k,)
};

/// What trackers alone remember.
struct TrackingMemory {
  std::vector<Vector3> before;            ///< (k,) the frame before the last one
  FitMemory coarse_fit;                   ///< of the coarse mesh
  std::vector<double> coarse_departures;  ///< of the coarse mesh
  /// How many times more than usual points weigh since the subject rests or moves, at most 1.
  double times_weight = 1;
  /// The standard deviation of the points of the last frames, of which each counts half as much as
  /// the one after it, in mean edges; what is usual while the surface may be elsewhere.
  double noise = 0;
  /// (k,) How far the iterations on the template led it from where it followed the coarse mesh,
  /// turned back by Q, empty if there are none; and with which share of that the next ones begin.
  std::vector<Vector3> corrections;
  double correction_share = 0;
  SurfaceColours colours;
  std::vector<Vector3> good;  ///< (k,) the last good frame, at first frame 0
  RecentFrames recent;
  int good_in_a_row = 0;  ///< since the surface was lost, up to a limit, which is that of frame 0
  /// The number of frames in which it is not sought elsewhere, or none: until a frame is good.
  std::optional<int> frames_until_search = 0;
  std::uint8_t is_start = 1;  ///< whether no frame was good yet
};

/// A regular value: a frame is found from the memory of the last one and writes that of the next
/// one, and when nothing can fail any more, the two change places. What a method does not remember
/// is empty.
struct Memory {
  /// Of a sequence that begins with this frame, so far without a shape.
  explicit Memory(std::vector<Vector3> first_frame)
      : last(std::move(first_frame)),
        known(last.size(), 1),
        age(last.size()),
        generations(last.size()) {}

  std::vector<Vector3> last;        ///< (k,) the completed frame
  std::vector<std::uint8_t> known;  ///< (k,) its anchors
  std::vector<Index> age;           ///< (k,) the number of frames since each was known
  std::size_t n_frames = 0;         ///< since frame 0
  Generations generations;          ///< which follow from `known`

  std::vector<Quaternion> q;  ///< (k,) Q, how the surface has turned since frame 0
  std::vector<Vector3> m;     ///< (k,) its detail, turned back by Q
  std::vector<double> sizes;  ///< (components,) how large they are, compared with frame 0
  FitMemory fit;
  /// (pairs,) by how much components that are near in frame 0 moved apart; see LearnedTies of a
  /// tracker and Leaders of a completer.
  std::vector<double> departures;
  ErrorMemory errors;
  CompletionMemory completion;
  TrackingMemory tracking;
};

/// The frame that was completed last.
inline Field completed_frame(const Memory& memory) {
  return memory.completion.n_ruined > 0 ? memory.completion.ruined : memory.last;
}

/// Calls `visit` with all numbers of a memory, some at a time: a number or a vector of numbers, of
/// Vector3 or of Quaternion. With `false` if they need not be finite.
template <class Visited, class Visit>
void each_number(Visited& memory, const Visit& visit) {
  auto& completion = memory.completion;
  auto& tracking = memory.tracking;
  visit(memory.n_frames);
  visit(memory.last);
  visit(tracking.before);
  visit(memory.age);
  visit(memory.known);
  visit(completion.first_frame.n_judged);
  visit(completion.first_frame.sum_of_steps);
  visit(completion.first_frame.result);
  visit(completion.step.change);
  visit(completion.step.scatter);
  visit(completion.step.turned);
  visit(completion.step.n_changes);
  visit(completion.step.n_turns);
  visit(completion.step.result);
  visit(completion.n_ruined);
  if constexpr (std::is_const_v<Visited>) {
    // Without a ruined frame, whatever it holds must not make a difference between states.
    const bool is_left = completion.n_ruined == 0 && !completion.ruined.empty();
    visit(is_left ? memory.last : completion.ruined);
  } else {
    visit(completion.ruined);
  }
  visit(memory.q);
  visit(memory.m);
  visit(completion.u);
  visit(memory.sizes);
  visit(completion.lambda);
  for (auto& [sums, squares, count, rings] : completion.gains.components) {
    visit(sums);
    visit(squares);
    visit(count);
    visit(rings);
  }
  visit(completion.gains.frame);
  for (auto* fit : {&memory.fit, &tracking.coarse_fit}) {
    visit(fit->coefficients);
    for (auto* number : {&fit->residual_variance, &fit->size, &fit->determined, &fit->explained,
                         &fit->prior_weight, &fit->prior_share}) {
      visit(*number);
    }
  }
  visit(memory.departures);
  visit(tracking.coarse_departures);
  visit(tracking.times_weight);
  visit(tracking.noise);
  visit(tracking.corrections);
  visit(tracking.correction_share);
  visit(tracking.colours.of_vertices);
  visit(tracking.colours.is_known);
  visit(memory.errors.errors);
  visit(memory.errors.changes);
  visit(memory.errors.energies);
  visit(memory.errors.energy);
  visit(memory.errors.of_noise);
  visit(memory.errors.of_shape);
  visit(memory.errors.frame);
  for (auto& [found, error] : memory.errors.turns) {
    visit(found);
    visit(error);
  }
  visit(memory.errors.turns_of_all);
  visit(memory.errors.standard_errors, false);  // infinite for disconnected vertices
  visit(tracking.good);
  visit(tracking.recent.count);
  for (auto* usual : {&tracking.recent.missing, &tracking.recent.hole, &tracking.recent.stretch,
                      &tracking.recent.change, &tracking.recent.parted}) {
    visit(usual->mean);
    visit(usual->deviation);
  }
  visit(tracking.recent.growth);
  visit(tracking.good_in_a_row);
  constexpr std::uint8_t until_good = 255;
  auto pause = static_cast<std::uint8_t>(tracking.frames_until_search.value_or(until_good));
  visit(pause);
  if constexpr (!std::is_const_v<Visited>) {
    tracking.frames_until_search = pause == until_good ? std::nullopt : std::optional<int>(pause);
  }
  visit(tracking.is_start);
}

/// Refuses numbers that no frame can have left. All are finite but those that need not be, and
/// `largest` is the largest coordinate of a position.
void check_memory(const Memory& memory, double largest);

}  // namespace dynmesh
