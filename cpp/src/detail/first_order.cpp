#include "detail/first_order.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <new>

#include "detail/random_signs.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

void FirstOrder::Gains::add(const Gains& other, double kept) {
  for (std::size_t q = 0; q < n_shares; ++q) {
    sums[q] = kept * sums[q] + other.sums[q];
    squares[q] = kept * kept * squares[q] + other.squares[q];
  }
  count = kept * count + other.count;
}

FirstOrder::FirstOrder(const Topology& topology, const DetailOperator& k, const Rounding& rounding,
                       Workers& workers, const FirstOrderConstants& constants, bool is_noisy)
    : topology_(topology),
      constants_(constants),
      step_(k, constants, workers),
      rounding_(rounding),
      sizes_(topology.report.components),
      components_(sizes_.size()),
      kept_(k.size(), is_noisy),
      drawn_(sizes_.size()),
      is_left_out_(k.size()),
      is_free_(k.size()),
      of_detail_(k.size()),
      newest_(sizes_.size()),
      of_groups_(sizes_.size() + 1),
      newest_of_groups_(sizes_.size() + 1) {
  nearby_.reserve(k.size());
  for (const Index c : topology.component) ++sizes_[c];
}

double FirstOrder::improve(const Frame& frame, const Anchors& anchors,
                           const Generations& generations, ShapeSystem& system) {
  if (generations.reached() == 0) return 0;
  try {
    if (is_due() && draw(generations)) test(frame, anchors, generations, system);
    return mix(frame, generations, system);
  } catch (const std::bad_alloc&) {
    return 0;
  }
}

/// Whether this frame is to be tested: every `gap`th, and before these frames 1, 2, 4 and so on,
/// since nothing is known yet.
bool FirstOrder::is_due() const {
  const auto gap = static_cast<std::uint64_t>(constants_.gap);
  return frame_ < gap ? std::has_single_bit(frame_) : frame_ % gap == 0;
}

/// Draws the anchors to leave out. Returns false if there are none.
bool FirstOrder::draw(const Generations& generations) {
  const auto generation = generations.of_vertices();
  std::ranges::fill(drawn_, Drawn{});
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (generation[v] == Generations::anchor) ++drawn_[topology_.component[v]].anchors;
  }
  const std::uint64_t of_frame = mixed(frame_);
  for (std::size_t v = 0; v < generation.size(); ++v) {
    Drawn& drawn = drawn_[topology_.component[v]];
    const double probability =
        std::min(constants_.left_out / drawn.anchors, constants_.largest_left_out);
    const double random = 0x1p-64 * static_cast<double>(mixed(of_frame + v));
    const bool is_anchor = generation[v] == Generations::anchor;
    is_left_out_[v] = is_anchor && random < probability ? 1 : 0;
    drawn.left_out += is_left_out_[v];
  }
  bool is_any = false;
  for (std::size_t v = 0; v < generation.size(); ++v) {
    const Drawn& drawn = drawn_[topology_.component[v]];
    if (drawn.anchors - drawn.left_out < constants_.least_kept) is_left_out_[v] = 0;
    is_any |= is_left_out_[v] != 0;
  }
  return is_any;
}

/// Sets what is solved for without the anchors left out: the vertices around them, since those that
/// are farther away hardly move.
void FirstOrder::leave_out(const Anchors& anchors, const Generations& generations) {
  kept_ = anchors;
  std::ranges::fill(kept_.is_solved, std::uint8_t{0});
  nearby_.clear();
  const auto add = [&](std::size_t v) {
    if (kept_.is_solved[v] == 0) nearby_.push_back(static_cast<Index>(v));
    kept_.is_solved[v] = 1;
  };
  for (std::size_t v = 0; v < is_left_out_.size(); ++v) {
    if (is_left_out_[v] == 0) continue;
    add(v);
    if (kept_.are_noisy()) kept_.weights[v] = 0;
  }
  const auto rings_around = [&](Index v) {
    const Index c = topology_.component[v];
    const double distance = std::sqrt(sizes_[c] / drawn_[c].anchors);
    return static_cast<int>(std::ceil(constants_.rings * distance));
  };
  std::size_t begin = 0;
  for (int ring = 0; begin < nearby_.size(); ++ring) {
    for (const std::size_t end = nearby_.size(); begin < end; ++begin) {
      if (ring >= rings_around(nearby_[begin])) continue;
      for (const Index u : topology_.cells[nearby_[begin]]) {
        if (anchors.is_solved[u] != 0) add(at(u));
      }
    }
  }
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < is_free_.size(); ++v) {
    const bool is_free = generation[v] > 0 || is_left_out_[v] != 0;
    is_free_[v] = is_free ? kept_.is_solved[v] : 0;
  }
}

/// Predicts anchors that are left out, by detail with the shape of the frame and by the first-order
/// step from there.
void FirstOrder::test(const Frame& frame, const Anchors& anchors, const Generations& generations,
                      ShapeSystem& system) {
  leave_out(anchors, generations);
  system.factorize(kept_);
  const Field step = system.solve<1>(
      [&](std::size_t v, std::size_t) { return frame.shape[v] - frame.kx[v]; }, frame.x, kept_);
  const auto sum = [](const Vector3<double>& a, const Vector3<double>& b) { return a + b; };
  std::ranges::transform(frame.x, step, of_detail_.begin(), sum);
  const auto of_first_order = step_.find(of_detail_, frame.last, is_free_, system.scratch());
  std::ranges::transform(of_detail_, of_first_order, of_first_order.begin(), sum);
  learn(of_first_order, anchors.observed, std::sqrt(rounding_.mean_square_of_positions(frame.x)));
}

/// Chooses the shares by the predictions of the anchors left out and their `observed` positions.
/// Errors are in the unit of the positions; those below `rounding` count as 0.
void FirstOrder::learn(Field first_order, Field observed, double rounding) {
  const auto length = [&](const Vector3<double>& x) {
    const double found = std::sqrt(squared_norm(x));
    return found > rounding ? found : 0;
  };
  bool is_finite = true;
  std::ranges::fill(newest_, Gains{});
  for (std::size_t v = 0; v < is_left_out_.size(); ++v) {
    if (is_left_out_[v] == 0) continue;
    const Vector3<double> of_detail = of_detail_[v] - observed[v];
    const Vector3<double> of_first_order = first_order[v] - observed[v];
    Gains& gains = newest_[topology_.component[v]];
    const double size = length(of_detail);
    ++gains.count;
    for (std::size_t q = 0; q < n_shares; ++q) {
      const double share = static_cast<double>(q + 1) / n_shares;
      const double gain = size - length((1 - share) * of_detail + share * of_first_order);
      gains.sums[q] += gain;
      gains.squares[q] += gain * gain;
      is_finite = is_finite && std::isfinite(gains.squares[q]);
    }
  }
  if (!is_finite) return;

  std::ranges::fill(of_groups_, Gains{});
  std::ranges::fill(newest_of_groups_, Gains{});
  for (std::size_t c = 0; c < components_.size(); ++c) {
    // A component of which nothing was left out keeps what it has shown.
    if (newest_[c].count > 0) components_[c].gains.add(newest_[c], constants_.kept);
    of_groups_[group_of(c)].add(components_[c].gains);
    newest_of_groups_[group_of(c)].add(newest_[c]);
  }
  for (std::size_t c = 0; c < components_.size(); ++c) {
    const std::size_t group = group_of(c);
    if (newest_of_groups_[group].count == 0) continue;
    components_[c].share = best_share(of_groups_[group], newest_of_groups_[group]);
  }
}

std::size_t FirstOrder::group_of(std::size_t component) const {
  return components_[component].gains.count >= constants_.least_count ? component + 1 : 0;
}

/// The share with the largest sum of gains, reduced by what may be chance. One that was clearly
/// worse in the newest test is not taken.
double FirstOrder::best_share(const Gains& gains, const Gains& newest) const {
  double best = 0;
  double share = 0;
  for (std::size_t q = 0; q < n_shares && gains.count >= constants_.least_count; ++q) {
    const double candidate = static_cast<double>(q + 1) / n_shares;
    const bool is_worse = newest.sums[q] + std::sqrt(newest.squares[q]) < 0;
    if (is_worse || candidate < constants_.least_share) continue;
    const double found = gains.sums[q] - constants_.deviations * std::sqrt(gains.squares[q]);
    if (found <= best) continue;
    best = found;
    share = candidate;
  }
  return share;
}

/// Moves each satellite by the share of its component of the step.
double FirstOrder::mix(const Frame& frame, const Generations& generations, ShapeSystem& system) {
  if (std::ranges::max(components_, {}, &Component::share).share == 0) return 0;
  const auto share_of = [&](std::size_t v) { return components_[topology_.component[v]].share; };
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < is_free_.size(); ++v) {
    is_free_[v] = generation[v] > 0 && share_of(v) > 0 ? 1 : 0;
  }
  const Field step = step_.find(frame.x, frame.last, is_free_, system.scratch());
  double sum = 0;
  for (std::size_t v = 0; v < step.size(); ++v) {
    if (is_free_[v] == 0) continue;
    frame.x[v] = frame.x[v] + share_of(v) * step[v];
    sum += share_of(v);
  }
  return sum / static_cast<double>(generations.reached());
}

}  // namespace dynmesh
