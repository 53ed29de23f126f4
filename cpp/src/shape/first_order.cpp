#include "shape/first_order.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/geometry.hpp"
#include "shape/constants.hpp"
#include "shape/random_signs.hpp"
#include "shape/rotations.hpp"

namespace dynmesh {
namespace {

/// L of the weights w_ij = -C_ij, with a lower bound, since an edge without weight keeps nothing.
DetailOperator laplacian_of(const DetailOperator& k) {
  using Row = DetailOperator::Rows::InnerIterator;
  const auto l = std::make_shared<DetailOperator::Rows>();
  *l = *k.c;
  double sum = 0;
  double n_edges = 0;
  for (Index i = 0; i < l->rows(); ++i) {
    for (Row e(*l, i); e; ++e) {
      if (e.col() == i) continue;
      sum -= e.value();
      ++n_edges;
    }
  }
  const double floor = n_edges > 0 ? first_order_constants.least_weight * sum / n_edges : 0;
  for (Index i = 0; i < l->rows(); ++i) {
    double weights = 0;
    for (Row e(*l, i); e; ++e) {
      if (e.col() != i) weights -= e.valueRef() = std::min(e.value(), -floor);
    }
    if (weights > 0) l->coeffRef(i, i) = weights;
  }
  return {l, std::vector<double>(k.size(), 1.0)};
}

constexpr std::size_t n_shares = Gains::n_shares;

void add(Gains& gains, const Gains& other, double kept = 1) {
  for (std::size_t q = 0; q < n_shares; ++q) {
    gains.sums[q] = kept * gains.sums[q] + other.sums[q];
  }
  gains.count = kept * gains.count + other.count;
}

}  // namespace

FirstOrder::FirstOrder(const ShapeModel& model, Workers& workers, bool is_noisy)
    : model_(model),
      topology_(model.topology),
      workers_(workers),
      laplacian_(laplacian_of(model.k)),
      // It has so few entries that threads would hardly share it.
      factor_(SparseMatrix(*laplacian_.c), workers),
      sizes_(topology_.report.components),
      kept_(model.size(), is_noisy),
      drawn_(sizes_.size()),
      is_left_out_(model.size()),
      is_free_(model.size()),
      of_detail_(model.size()),
      newest_(sizes_.size()),
      edges_(laplacian_.c->nonZeros()),
      quaternions_(model.size()),
      covariances_(model.size()) {
  factor_.reserve();
  nearby_.reserve(model.size());
  for (const Index c : topology_.component) ++sizes_[c];
}

double FirstOrder::improve(const Frame& frame, const Anchors& anchors,
                           const Generations& generations, ShapeSystem& system,
                           GainMemory& memory) {
  if (generations.reached() == 0) return 0;
  if (is_due(memory.frame) && draw(generations, memory.frame)) {
    test(frame, anchors, generations, system, memory.components);
  }
  return mix(frame, generations, system, memory.components);
}

/// Whether this frame is to be tested: every `gap`th, and before these frames 1, 2, 4 and so on,
/// since nothing is known yet.
bool FirstOrder::is_due(std::uint64_t frame) {
  const auto gap = static_cast<std::uint64_t>(first_order_constants.gap);
  return frame < gap ? std::has_single_bit(frame) : frame % gap == 0;
}

/// Draws the anchors to leave out. Returns false if there are none.
bool FirstOrder::draw(const Generations& generations, std::uint64_t frame) {
  const auto generation = generations.of_vertices();
  const auto drawn_of = [&](std::size_t v) -> Drawn& { return drawn_[topology_.component[v]]; };
  std::ranges::fill(drawn_, Drawn{});
  for (std::size_t v = 0; v < generation.size(); ++v) {
    drawn_of(v).anchors += generation[v] == Generations::anchor ? 1 : 0;
  }
  const std::uint64_t of_frame = mixed(frame);
  for (std::size_t v = 0; v < generation.size(); ++v) {
    const double probability = std::min(first_order_constants.left_out / drawn_of(v).anchors,
                                        first_order_constants.largest_left_out);
    const double random = 0x1p-64 * static_cast<double>(mixed(of_frame + v));
    is_left_out_[v] = generation[v] == Generations::anchor && random < probability ? 1 : 0;
    drawn_of(v).left_out += is_left_out_[v];
  }
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (drawn_of(v).left_out == drawn_of(v).anchors) is_left_out_[v] = 0;
  }
  return std::ranges::count(is_left_out_, 1) > 0;
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
    return static_cast<int>(std::ceil(first_order_constants.rings * distance));
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
    is_free_[v] = generation[v] > 0 || is_left_out_[v] != 0 ? kept_.is_solved[v] : 0;
  }
}

/// Predicts anchors that are left out, by detail with the shape of the frame and by the first-order
/// step from there.
void FirstOrder::test(const Frame& frame, const Anchors& anchors, const Generations& generations,
                      ShapeSystem& system, std::vector<Component>& components) {
  leave_out(anchors, generations);
  system.factorize(kept_);
  system.apply(frame.x, 1, of_detail_);
  const Field step = system.solve<1>(
      [&](std::size_t v, std::size_t) { return frame.shape[v] - of_detail_[v]; }, frame.x, kept_);
  const auto sum = [](const Vector3& a, const Vector3& b) { return a + b; };
  std::ranges::transform(frame.x, step, of_detail_.begin(), sum);
  const auto of_first_order = find_step(of_detail_, frame.last, system.scratch());
  std::ranges::transform(of_detail_, of_first_order, of_first_order.begin(), sum);
  learn(of_first_order, anchors.observed,
        std::sqrt(model_.rounding.mean_square_of_positions(frame.x)), components);
}

/// Chooses the shares by the predictions of the anchors left out and their `observed` positions.
/// Errors are in the unit of the positions; those below `rounding` count as 0.
void FirstOrder::learn(Field first_order, Field observed, double rounding,
                       std::vector<Component>& components) {
  const auto length = [&](const Vector3& x) {
    const double found = std::sqrt(squared_norm(x));
    return found > rounding ? found : 0;
  };
  bool is_finite = true;
  std::ranges::fill(newest_, Gains{});
  for (std::size_t v = 0; v < is_left_out_.size(); ++v) {
    if (is_left_out_[v] == 0) continue;
    const Vector3 of_detail = of_detail_[v] - observed[v];
    const Vector3 of_first_order = first_order[v] - observed[v];
    Gains& gains = newest_[topology_.component[v]];
    const double size = length(of_detail);
    ++gains.count;
    for (std::size_t q = 0; q < n_shares; ++q) {
      const double share = static_cast<double>(q + 1) / n_shares;
      gains.sums[q] += size - length((1 - share) * of_detail + share * of_first_order);
      is_finite = is_finite && std::isfinite(gains.sums[q]);
    }
  }
  if (!is_finite) return;

  const auto has_shown_enough = [](const Component& component) {
    return component.gains.count >= first_order_constants.least_count;
  };
  Gains common;
  for (std::size_t c = 0; c < components.size(); ++c) {
    // A component of which nothing was left out keeps what it has shown.
    if (newest_[c].count > 0) add(components[c].gains, newest_[c], first_order_constants.kept);
    if (!has_shown_enough(components[c])) add(common, components[c].gains);
  }
  for (Component& component : components) {
    component.share = best_share(has_shown_enough(component) ? component.gains : common);
  }
}

/// The share with the largest sum of gains.
double FirstOrder::best_share(const Gains& gains) {
  double best = 0;
  double share = 0;
  for (std::size_t q = 0; q < n_shares && gains.count >= first_order_constants.least_count; ++q) {
    const double candidate = static_cast<double>(q + 1) / n_shares;
    if (candidate < first_order_constants.least_share || gains.sums[q] <= best) continue;
    best = gains.sums[q];
    share = candidate;
  }
  return share;
}

/// Moves each satellite by the share of its component of the step.
double FirstOrder::mix(const Frame& frame, const Generations& generations, ShapeSystem& system,
                       std::span<const Component> components) {
  if (std::ranges::max(components, {}, &Component::share).share == 0) return 0;
  const auto share_of = [&](std::size_t v) { return components[topology_.component[v]].share; };
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < is_free_.size(); ++v) {
    is_free_[v] = generation[v] > 0 && share_of(v) > 0 ? 1 : 0;
  }
  const Field step = find_step(frame.x, frame.last, system.scratch());
  double sum = 0;
  for (std::size_t v = 0; v < step.size(); ++v) {
    if (is_free_[v] == 0) continue;
    frame.x[v] = frame.x[v] + share_of(v) * step[v];
    sum += share_of(v);
  }
  return sum / static_cast<double>(generations.reached());
}

/// Returns the step (k,) from the positions X, 0 where `is_free_` is 0. Every component with free
/// vertices must have others, too. The result is in `scratch`, (2 k,) or longer.
std::span<Vector3> FirstOrder::find_step(Field positions, Field last, std::span<Vector3> scratch) {
  factor_.factorize(is_free_);
  fit_rotations(positions, last);
  const auto rows = factor_.order();
  const auto solution = scratch.first(positions.size());
  const auto step = scratch.subspan(positions.size(), positions.size());
  workers_.for_each_in_chunks(
      rows.size(), [&](std::size_t r) { solution[r] = residual(at(rows[r]), positions); });
  factor_.solve(solution, 1);
  std::ranges::fill(step, Vector3{});
  for (std::size_t r = 0; r < rows.size(); ++r) step[rows[r]] = solution[r];
  return step;
}

/// Fits R to the edges of L, which it weights as L does.
void FirstOrder::fit_rotations(Field positions, Field last) {
  const OperatorData l = data_of(laplacian_);
  const RotationData data = {l.offsets, l.columns,        edges_.data(),
                             nullptr,   positions.data(), covariances_.data()};
  const RotationKernels& kernels = best_kernels().rotations;
  const auto fit = [&](Index first, Index end) {
    for (Index i = first; i < end; ++i) {
      for (Index e = l.offsets[i]; e < l.offsets[i + 1]; ++e) {
        edges_[e] = -l.values[e] * (last[at(l.columns[e])] - last[at(i)]);
      }
      quaternions_[i] = {1, 0, 0, 0};
    }
    kernels.measure(data, first, end);
    kernels.fit(covariances_.data(), quaternions_.data(), first, end);
  };
  workers_.for_each_short_chunk(static_cast<Index>(quaternions_.size()), fit);
}

/// The residual of the equation of vertex v: b_v - (L X)_v.
Vector3 FirstOrder::residual(std::size_t v, Field positions) const {
  const OperatorData l = data_of(laplacian_);
  Vector3 sum, edges;
  for (Index e = l.offsets[v]; e < l.offsets[v + 1]; ++e) {
    const std::size_t j = at(l.columns[e]);
    const Vector3& edge = edges_[e];  // w_vj (G_j - G_v)
    edges = edges + edge;
    sum = sum - 0.5 * rotated(quaternions_[j], edge) - l.values[e] * (positions[j] - positions[v]);
  }
  return sum - 0.5 * rotated(quaternions_[v], edges);
}

}  // namespace dynmesh
