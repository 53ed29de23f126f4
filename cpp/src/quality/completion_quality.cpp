#include "quality/completion_quality.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <tuple>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/statistics.hpp"

namespace dynmesh {
namespace {

constexpr CompletionLimits limits;

// An edge is measured for each tenth vertex, within these bounds.
constexpr std::size_t vertices_per_edge = 10;
constexpr std::size_t fewest_measured = 512;
constexpr std::size_t most_measured = 5000;

// What the first frames are compared with frame 0 by, at most: edges at anchors, anchors, and
// anchors of which all distances are measured.
constexpr std::size_t most_edges = 256;
constexpr std::size_t most_anchors = 512;
constexpr std::size_t most_compared = 32;

constexpr double longest_measured = 1e100;  // in mean edges; the ratio of two is finite

/// Calls `visit` with the numbers below `n`, the first of them spread evenly, until it returns
/// false.
template <class Visit>
void visit_spread(std::size_t n, const Visit& visit) {
  constexpr std::size_t prime = 7919;  // n is seldom a multiple, so that each number has its turn
  std::size_t number = 0;
  for (std::size_t i = 0; i < n && visit(number); ++i) number = (number + prime % n) % n;
}

int in_percent(double share) { return static_cast<int>(std::lround(100 * share)); }

/// Writes a reason without allocating memory.
template <class... Values>
void give_reason(FrameReport& report, Quality quality, const char* format, Values... values) {
  report.quality = quality;
  if constexpr (sizeof...(values) == 0) {
    (void)std::snprintf(report.reason.data(), report.reason.size(), "%s", format);
  } else {
    (void)std::snprintf(report.reason.data(), report.reason.size(), format, values...);
  }
}

/// How many times as large the anchors' part of one frame is as the same part of another: the root
/// mean square distance from its centre, in any unit.
double size_ratio(Field from, Field to, std::span<const Index> generation, double unit) {
  const auto size = [&](Field frame) {
    Vector3 sum;
    double n = 0;
    const auto for_each_anchor = [&](const auto& visit) {
      for (std::size_t v = 0; v < frame.size(); ++v) {
        if (generation[v] == 0) visit(unit * frame[v]);
      }
    };
    for_each_anchor([&](const Vector3& x) { sum = sum + x, ++n; });
    const auto centre = (1 / n) * sum;
    double squares = 0;
    for_each_anchor([&](const Vector3& x) { squares += squared_norm(x - centre); });
    return std::sqrt(squares);
  };
  return size(to) / size(from);
}

}  // namespace

CompletionQuality::CompletionQuality(const Topology& topology, Field first_frame)
    : topology_(topology),
      first_frame_(first_frame),
      per_edge_(1 / mean_edge_length(topology.cells, first_frame)) {
  const Cells& cells = topology.cells;
  const std::size_t n_half_edges = cells.neighbours.size();
  const std::size_t n = std::min(n_half_edges, std::clamp(first_frame.size() / vertices_per_edge,
                                                          fewest_measured, most_measured));
  if (!std::isfinite(per_edge_)) return;
  double n_flat = 0;
  for (std::size_t i = 0; i < n; ++i) {
    // Evenly, but at changing places within a step: in a regular grid, half-edges at equal
    // distances may all have the same direction.
    const std::size_t first = i * n_half_edges / n;
    const std::size_t last = (i + 1) * n_half_edges / n;
    const std::size_t chosen = first + i * 7919 % (last - first);
    const auto after = std::ranges::upper_bound(cells.offsets, static_cast<Index>(chosen));
    Edge edge = {};
    edge.a = static_cast<Index>(after - cells.offsets.begin()) - 1;
    edge.b = cells.neighbours[chosen];
    const double usual = length_of(edge, first_frame);
    const auto squared_range = [&](double times) {
      const double shortest = std::max(0.0, (usual + limits.added) / times - limits.added);
      const double longest = (usual + limits.added) * times - limits.added;
      return std::pair(shortest * shortest, longest * longest);
    };
    std::tie(edge.shortest, edge.longest) = squared_range(limits.times);
    std::tie(edge.shortest_whole, edge.longest_whole) = squared_range(limits.torn_times);
    edges_.push_back(edge);
    n_flat += usual > 0 ? 0 : 1;
  }
  for (auto* of_edges : {&ratios_, &changes_}) {
    of_edges->reserve(std::max(most_edges, most_compared * most_compared / 2));
  }
  anchors_.reserve(most_anchors);
  if (n > 0) flat_share_ = n_flat / static_cast<double>(n);
}

void CompletionQuality::judge(const Memory& memory, Memory& next, FrameReport& report) {
  const bool has_anchors = !edges_.empty() && report.known >= limits.fewest_anchors;
  anchors_.clear();
  if (has_anchors) choose_anchors(next.generations.of_vertices());
  check_first_frame(memory, next, next.completion.first_frame);
  check_step(memory, next, next.completion.step);
  describe(next, report);
  if (report.quality == Quality::ruined) leave_out(memory, next);
}

/// Whether frame 0 fits the next one, if this is one of the first.
void CompletionQuality::check_first_frame(const Memory& memory, const Memory& next,
                                          FirstFrameCheck& check) {
  if (check.n_judged >= limits.judged_frames) return;
  const Generation generation = next.generations.of_vertices();
  const double change = change_at_anchors(generation, first_frame_, next.last);
  const bool has_edges = ratios_.size() >= limits.fewest;
  if (has_edges) {
    const bool is_first = check.n_judged == 0;
    if (!is_first) check.sum_of_steps += change_at_anchors(generation, memory.last, next.last);
    const double limit = is_first ? limits.clear_misfit : limits.misfit;
    if (change > limit && change > limits.steps * check.sum_of_steps) {
      check.result = FirstFrameCheck::is_other;
    }
  }
  const bool has_anchors = !anchors_.empty();
  if (has_anchors && is_scattered(next.last)) {
    check.result = FirstFrameCheck::is_reordered;
  } else if (has_anchors && is_mirrored(first_frame_, next.last, limits.reflected)) {
    check.result = FirstFrameCheck::is_mirrored;
  } else if (has_anchors && check.result == FirstFrameCheck::is_reordered) {
    check.result = FirstFrameCheck::fits;  // the frame before had the other order
  }
  if (has_edges || has_anchors) ++check.n_judged;
}

/// Whether the next frame follows from the last one, once it is known what is usual.
void CompletionQuality::check_step(const Memory& memory, const Memory& next, StepCheck& check) {
  check.result = StepCheck::follows;
  if (next.completion.first_frame.n_judged < 2) return;  // frame 0 may be of another subject
  const double change = change_between(memory, next);
  if (ratios_.size() >= limits.fewest) {
    const double scatter = scatter_of_ratios();
    if (check.n_changes >= limits.usual_steps && change > limits.misfit &&
        change > limits.dropped * check.change && scatter > limits.scatter &&
        scatter > limits.steps * check.scatter) {
      check.result = StepCheck::is_other;
      return;
    }
    check.n_changes = std::min(check.n_changes + 1, limits.recent_steps);
    check.change += (change - check.change) / static_cast<double>(check.n_changes);
    check.scatter += (scatter - check.scatter) / static_cast<double>(check.n_changes);
  }
  if (anchors_.empty()) return;
  const auto [turned, reflected] = residuals_of(memory.last, next.last);
  if (is_mirrored_step({turned, reflected}, check)) {
    check.result = StepCheck::is_mirrored;
    return;
  }
  check.n_turns = std::min(check.n_turns + 1, limits.recent_steps);
  check.turned += (turned - check.turned) / static_cast<double>(check.n_turns);
}

/// Lets the next memory keep what it was before a ruined frame, unless that agrees with the frame
/// before, or with some ruined ones: after a cut, the frames are of something else, but of the
/// same. Its standard errors are those of the frame. What is usual stays, also if it did not.
void CompletionQuality::leave_out(const Memory& memory, Memory& next) {
  const auto agrees_with = [&](Field before) {
    return change_at_anchors(next.generations.of_vertices(), before, next.last) < limits.misfit &&
           !is_mirrored_step(residuals_of(before, next.last), next.completion.step);
  };
  if (memory.completion.n_ruined == 0 && agrees_with(memory.last)) return;
  const bool agrees = memory.completion.n_ruined > 0 && agrees_with(memory.completion.ruined);
  next.completion.n_ruined = agrees ? memory.completion.n_ruined + 1 : 1;
  if (next.completion.n_ruined >= limits.agreeing_frames) {
    next.completion.n_ruined = 0;
    return;
  }
  std::swap(next.completion.ruined, next.last);
  next.last = memory.last;
  next.q = memory.q;
  next.m = memory.m;
  next.sizes = memory.sizes;
  next.fit = memory.fit;
  next.departures = memory.departures;
  next.completion.u = memory.completion.u;
  next.completion.lambda = memory.completion.lambda;
  next.completion.gains = memory.completion.gains;
  static_cast<Ensemble&>(next.errors) = memory.errors;
}

void CompletionQuality::describe(const Memory& memory, FrameReport& report) {
  const Field completed = completed_frame(memory);
  const Generation generation = memory.generations.of_vertices();
  const FirstFrameCheck& check = memory.completion.first_frame;
  report.quality = Quality::good;
  report.reason = {};
  if (report.known == 0) {
    give_reason(report, Quality::doubtful, "nothing is known: the frame follows from earlier ones");
    return;
  }
  if (edges_.empty()) return;
  if (flat_share_ > limits.ruined_share) {
    give_reason(report, Quality::ruined,
                "%d %% of the edges have no length where completion started",
                in_percent(flat_share_));
    return;
  }
  const auto [share, torn] = shares_of(memory);
  const bool is_ruined = share > limits.ruined_share;
  const bool is_torn = torn > limits.torn_share;
  const bool is_misfit = check.result == FirstFrameCheck::is_other &&
                         change_at_anchors(generation, first_frame_, completed) > limits.misfit;
  if (check.result == FirstFrameCheck::is_mirrored) {
    give_reason(
        report, Quality::doubtful,
        "what is known is mirrored where completion started, as if one of them had the axes "
        "of a left hand");
  }
  if (check.result == FirstFrameCheck::is_reordered) {
    give_reason(
        report, Quality::doubtful,
        "what is known is at other distances from each other than where completion started, "
        "as if one of them had its vertices in another order");
  }
  const std::uint8_t step = memory.completion.step.result;
  if (step == StepCheck::is_mirrored && !is_ruined) {
    give_reason(report, Quality::ruined,
                "what is known is mirrored since the frame before, as if one of them had the axes "
                "of a left hand");
    return;
  }
  if (step == StepCheck::is_other && !is_ruined) {
    give_reason(report, Quality::ruined,
                "most edges are over %d %% longer or shorter than in the frame before, and not all "
                "by the same factor, as if this were of another subject",
                in_percent(limits.misfit));
    return;
  }
  if (!is_ruined && !is_misfit && !is_torn) return;

  const Quality quality = is_ruined ? Quality::ruined : Quality::doubtful;
  const double ratio = size_ratio(first_frame_, completed, generation, per_edge_);
  if (std::max(ratio, 1 / ratio) > limits.other_size) {
    give_reason(report, quality,
                "what is known is %.4g times as large as where completion started, as if that were "
                "in another unit of length",
                ratio);
  } else if (is_ruined) {
    give_reason(report, quality,
                "%d %% of the edges are more than %g times as long or as short as where completion "
                "started",
                in_percent(share), limits.times);
  } else if (!is_misfit) {
    give_reason(report, quality,
                "%.2g %% of the edges are more than %g times as long or as short as where "
                "completion started, as if vertices had exchanged their places",
                100 * torn, limits.torn_times);
  } else {
    give_reason(report, quality,
                "most edges are over %d %% longer or shorter than where completion started, as if "
                "that were of another subject",
                in_percent(limits.misfit));
  }
}

double CompletionQuality::square_of(const Edge& edge, Field frame) const {
  return squared_norm(per_edge_ * (frame[edge.a] - frame[edge.b]));
}

double CompletionQuality::length_of(const Edge& edge, Field frame) const {
  return std::min(std::sqrt(square_of(edge, frame)), longest_measured);
}

/// Of edges in the sizes of frame 0: what grows is in range.
auto CompletionQuality::shares_of(const Memory& memory) const -> Shares {
  const Generation generation = memory.generations.of_vertices();
  const std::span<const double> sizes = memory.sizes;
  struct Counts {
    std::size_t all = 0;
    std::size_t outside = 0;
    std::size_t torn = 0;
  };
  Counts any;
  Counts at_anchors;
  for (const Edge& edge : edges_) {
    const double size = sizes.empty() ? 1 : sizes[at(topology_.component[at(edge.a)])];
    const double square = square_of(edge, completed_frame(memory)) / (size * size);
    const std::size_t is_outside = square < edge.shortest || square > edge.longest ? 1 : 0;
    const std::size_t is_torn = square < edge.shortest_whole || square > edge.longest_whole ? 1 : 0;
    const std::size_t has_anchor = generation[edge.a] == 0 || generation[edge.b] == 0 ? 1 : 0;
    any.outside += is_outside;
    any.torn += is_torn;
    at_anchors.all += has_anchor;
    at_anchors.outside += is_outside & has_anchor;
    at_anchors.torn += is_torn & has_anchor;
  }
  const auto share = [](std::size_t some, std::size_t all) {
    return static_cast<double>(some) / static_cast<double>(all);
  };
  const Shares shares = {share(any.outside, edges_.size()), share(any.torn, edges_.size())};
  if (at_anchors.all < limits.fewest) return shares;
  return {std::max(shares.out_of_range, share(at_anchors.outside, at_anchors.all)),
          std::max(shares.torn, share(at_anchors.torn, at_anchors.all))};
}

void CompletionQuality::choose_anchors(Generation generation) {
  anchors_.clear();
  visit_spread(generation.size(), [&](std::size_t v) {
    if (generation[v] == 0) anchors_.push_back(static_cast<Index>(v));
    return anchors_.size() < most_anchors;
  });
}

/// Which shares of the squared distances of the anchors from their centre the best rotation from
/// one frame to another leaves, and the best reflection. Lengths of edges do not tell them apart.
CompletionQuality::Residuals CompletionQuality::residuals_of(Field from, Field to) const {
  const auto for_each_anchor = [&](const auto& visit) {
    for (const Index v : anchors_) {
      visit(per_edge_ * to_eigen(from[v]), per_edge_ * to_eigen(to[v]));
    }
  };
  const Moments found = moments_of(for_each_anchor);
  const Eigen::Matrix3d& moments = found.arms.now;
  double squares = 0;
  for_each_anchor([&](const Eigen::Vector3d& before, const Eigen::Vector3d& now) {
    squares += (before - found.before).squaredNorm() + (now - found.now).squaredNorm();
  });
  if (!moments.allFinite() || !(squares > 0) || !std::isfinite(squares)) return {};
  const Eigen::Vector3d spread = Eigen::JacobiSVD<Eigen::Matrix3d>(moments).singularValues();
  const bool is_flat = !(spread[2] > limits.thickness * spread[0]);
  const double sign = moments.determinant() < 0 ? -1 : 1;
  const auto left = [&](double third) {
    return std::max(0.0, squares - 2 * (spread[0] + spread[1] + third * spread[2])) / squares;
  };
  return {left(sign), is_flat ? 1 : left(-sign)};
}

/// Whether only a reflection brings a frame as near to another one as is usual, and much nearer
/// than any rotation: half a step of a walking figure resembles a reflection.
bool CompletionQuality::is_mirrored_step(const Residuals& left, const StepCheck& check) {
  const double usual = limits.steps * check.turned;
  return check.n_turns >= limits.usual_steps && left.turned > usual && left.reflected < usual &&
         left.reflected < limits.reflected_step * left.turned;
}

/// Whether the anchors are a mirror image of themselves in another frame: a reflection brings them
/// much closer than any rotation does, and leaves less than a share of this.
bool CompletionQuality::is_mirrored(Field from, Field to, double share) const {
  const auto [turned, reflected] = residuals_of(from, to);
  return reflected < share * turned;
}

/// By which share of its length the median edge of those that count became longer or shorter.
template <class Counts>
double CompletionQuality::change_of(Field from, Field to, const Counts& counts) {
  ratios_.clear();
  visit_spread(edges_.size(), [&](std::size_t e) {
    const Edge& edge = edges_[e];
    if (counts(edge)) {
      ratios_.push_back((length_of(edge, to) + limits.added) /
                        (length_of(edge, from) + limits.added));
    }
    return ratios_.size() < most_edges;
  });
  return median_change_from(1);
}

/// The same of edges at an anchor.
double CompletionQuality::change_at_anchors(Generation generation, Field from, Field to) {
  return change_of(from, to, [&](const Edge& edge) {
    return generation[edge.a] == 0 || generation[edge.b] == 0;
  });
}

/// The same of edges of which both ends are known in two frames, so that nothing is a guess.
double CompletionQuality::change_between(const Memory& memory, const Memory& next) {
  const Generation before = memory.generations.of_vertices();
  const Generation now = next.generations.of_vertices();
  return change_of(memory.last, next.last, [&](const Edge& edge) {
    return before[edge.a] == 0 && before[edge.b] == 0 && now[edge.a] == 0 && now[edge.b] == 0;
  });
}

/// The median share by which ratios depart from one of them.
double CompletionQuality::median_change_from(double ratio) {
  changes_.clear();
  for (const double r : ratios_) changes_.push_back(std::max(r / ratio, ratio / r) - 1);
  return changes_.empty() ? 0 : median(changes_);
}

/// How unlike each other the ratios are: another unit changes all lengths by the same one.
double CompletionQuality::scatter_of_ratios() {
  return ratios_.empty() ? 0 : median_change_from(median(ratios_));
}

/// Whether the distances between some anchors have changed by factors so unlike each other that the
/// anchors are probably other vertices than in frame 0.
bool CompletionQuality::is_scattered(Field frame) {
  ratios_.clear();
  for (std::size_t i = 0; i < std::min(anchors_.size(), most_compared); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      Edge pair = {};
      pair.a = anchors_[i];
      pair.b = anchors_[j];
      ratios_.push_back((length_of(pair, frame) + limits.added) /
                        (length_of(pair, first_frame_) + limits.added));
    }
  }
  return scatter_of_ratios() > limits.scattered;
}

}  // namespace dynmesh
