#include "shape/first_order.hpp"

#include <algorithm>
#include <cmath>

#include "base/geometry.hpp"
#include "mesh/clusters.hpp"
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
constexpr Index at_once = 4;  // rotations, as the kernel fits them

void add(Gains& gains, const Gains& other, double kept = 1) {
  for (std::size_t q = 0; q < gains.sums.size(); ++q) {
    gains.sums[q] = kept * gains.sums[q] + other.sums[q];
  }
  for (std::size_t q = 0; q < gains.squares.size(); ++q) {
    gains.squares[q] = kept * kept * gains.squares[q] + other.squares[q];
  }
  gains.count = kept * gains.count + other.count;
  gains.rings = kept * gains.rings + other.rings;
}

}  // namespace

FirstOrder::FirstOrder(const ShapeModel& model, Workers& workers)
    : model_(model),
      topology_(model.topology),
      workers_(workers),
      laplacian_(laplacian_of(model.k)),
      factor_(SparseMatrix(*laplacian_.c), workers),
      nearby_l_(factor_.plan(), workers),
      nearby_n_(model.plan, workers),
      order_(in_order(topology_.cells, model.first_frame)),
      fields_(std::vector<Vector3>(model.size()), 5),
      tests_(Test(model.size()), 1),
      improvements_(Improvement(model.size()), 1),
      drawn_(topology_.report.components),
      newest_(drawn_.size()),
      choices_(drawn_.size()),
      is_reached_(model.size()),
      is_free_(model.size()),
      is_beside_(model.size()),
      edges_(laplacian_.c->nonZeros()),
      quaternions_(model.size()),
      covariances_(model.size()) {
  Lent<Test> test = tests_.lend();
  for (auto* vertices : {&test.left_out, &test.nearby, &reached_}) vertices->reserve(model.size());
  test.rings.reserve(model.size());
  for (MaskedFactor* factor : {&factor_, &nearby_l_, &nearby_n_}) factor->reserve();
}

auto FirstOrder::improve(const Frame& frame, const Generations& generations, GainMemory& memory)
    -> Lent<Improvement> {
  Lent<Improvement> found = improvements_.lend();
  found.share = 0;
  if (generations.reached() == 0) return found;
  {
    const Lent<Test> test = leave_out(generations, memory.frame);
    choose(memory.components);
    if (!test.left_out.empty()) learn(frame, test, memory.components);
  }
  choose(memory.components);
  const auto generation = generations.of_vertices();
  const auto choice_of = [&](std::size_t v) -> const Choice& {
    return choices_[topology_.component[v]];
  };
  bool is_any_free = false;
  for (std::size_t v = 0; v < is_free_.size(); ++v) {
    is_free_[v] = generation[v] > 0 && choice_of(v).near_share > 0 ? 1 : 0;
    is_any_free = is_any_free || is_free_[v] != 0;
  }
  if (!is_any_free) return found;
  std::ranges::fill(found.move, Vector3{});
  LentField y = fields_.lend();
  double sum = 0;
  for (std::size_t n = 0; n < steps_.size(); ++n) {
    if (!is_needed(n)) continue;
    if (!steps_[n].goes_on) std::ranges::copy(frame.x, y.begin());
    take(steps_[n], factor_, is_free_, frame, y);
    for (std::size_t v = 0; v < y.size(); ++v) {
      if (is_free_[v] == 0) continue;
      const double share = share_of(n, generation[v], choice_of(v));
      found.move[v] = found.move[v] + share * (y[v] - frame.x[v]);
      sum += share;
    }
  }
  found.share = sum / static_cast<double>(generations.reached());
  return found;
}

/// The share of a step at a satellite.
double FirstOrder::share_of(std::size_t step, Index rings, const Choice& choice) {
  const double near = std::clamp(first_order_constants.tested + 1 - rings / choice.rings, 0.0, 1.0);
  return (choice.near_step == step ? near * choice.near_share : 0) +
         (step == 0 ? (1 - near) * choice.share : 0);
}

/// Draws the anchors to leave out, at equal distances among those of a component in an order that
/// does not depend on the numbers of the vertices, so that all frames have as many, and finds the
/// satellites around them: those farther away hardly move.
auto FirstOrder::leave_out(const Generations& generations, std::uint64_t frame) -> Lent<Test> {
  Lent<Test> test = tests_.lend();
  auto& nearby = test.nearby;
  auto& is_nearby = test.is_nearby;
  const auto generation = generations.of_vertices();
  const auto drawn_of = [&](std::size_t v) -> Drawn& { return drawn_[topology_.component[v]]; };
  std::ranges::fill(drawn_, Drawn{});
  for (std::size_t v = 0; v < generation.size(); ++v) {
    ++drawn_of(v).size;
    drawn_of(v).anchors += generation[v] == Generations::anchor ? 1 : 0;
  }
  for (Drawn& drawn : drawn_) {
    if (drawn.anchors < 2) continue;  // another one has to stay
    drawn.share = std::min(first_order_constants.left_out / drawn.anchors,
                           first_order_constants.largest_left_out);
    drawn.sum = 0x1p-64 * static_cast<double>(mixed(frame));
    drawn.rings = std::ceil(first_order_constants.rings * std::sqrt(drawn.size / drawn.anchors));
  }
  nearby.clear();
  std::ranges::fill(is_nearby, std::uint8_t{0});
  const auto add = [&](std::size_t v) {
    if (is_nearby[v] == 0) nearby.push_back(static_cast<Index>(v));
    is_nearby[v] = 1;
  };
  for (const Index v : order_) {
    if (generation[v] != Generations::anchor) continue;
    Drawn& drawn = drawn_of(at(v));
    drawn.sum += drawn.share;
    if (drawn.sum >= 1) add(at(v));
    drawn.sum -= is_nearby[v];
  }
  test.left_out.assign(nearby.begin(), nearby.end());
  test.rings.clear();
  for (const Index v : test.left_out) test.rings.push_back(rings_to_anchor(v, generations, test));
  std::size_t begin = 0;
  for (int ring = 0; begin < nearby.size(); ++ring) {
    for (const std::size_t end = nearby.size(); begin < end; ++begin) {
      if (ring >= drawn_of(at(nearby[begin])).rings) continue;
      for (const Index u : topology_.cells[nearby[begin]]) {
        if (generation[u] > 0) add(at(u));
      }
    }
  }
  return test;
}

/// The edges from an anchor that is left out to the nearest other one, or to where the search ends.
double FirstOrder::rings_to_anchor(Index v, const Generations& generations, const Test& test) {
  const auto generation = generations.of_vertices();
  const double most = drawn_[topology_.component[v]].rings;
  const auto is_other = [&](Index u) {
    return generation[u] == Generations::anchor && test.is_nearby[u] == 0;
  };
  reached_.assign({v});
  is_reached_[v] = 1;
  double rings = 1;
  bool is_found = false;
  for (std::size_t begin = 0; !is_found && rings < most; rings += is_found ? 0 : 1) {
    for (const std::size_t end = reached_.size(); begin < end; ++begin) {
      for (const Index u : topology_.cells[reached_[begin]]) {
        is_found = is_found || is_other(u);
        if (is_reached_[u] == 0) reached_.push_back(u);
        is_reached_[u] = 1;
      }
    }
  }
  for (const Index u : reached_) is_reached_[u] = 0;
  return rings;
}

/// The prediction of detail, with the shape of the frame, of anchors that are left out. Without
/// them, the energy of `frame.x` has a gradient at them alone.
LentField FirstOrder::predict(const Frame& frame, const Test& test) {
  nearby_n_.factorize(test.is_nearby);
  const auto rows = nearby_n_.order();
  LentField predicted = fields_.lend();
  LentField solution = fields_.lend();
  std::ranges::fill(predicted, Vector3{});
  for (const Index v : test.left_out) predicted[v] = pull(at(v), frame);
  for (std::size_t r = 0; r < rows.size(); ++r) solution[r] = predicted[rows[r]];
  nearby_n_.solve(solution, 1);
  std::ranges::copy(frame.x, predicted.begin());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    predicted[rows[r]] = predicted[rows[r]] + solution[r];
  }
  return predicted;
}

/// K^T (shape - K x) at vertex v.
Vector3 FirstOrder::pull(std::size_t v, const Frame& frame) const {
  const OperatorData k = data_of(model_.k);
  Vector3 sum;
  for (Index e = k.offsets[v]; e < k.offsets[v + 1]; ++e) {
    const std::size_t j = at(k.columns[e]);
    Vector3 cx;
    for (Index f = k.offsets[j]; f < k.offsets[j + 1]; ++f) {
      cx = cx + k.values[f] * frame.x[k.columns[f]];
    }
    sum = sum + k.values[e] * k.scale[j] * (frame.shape[j] - k.scale[j] * cx);
  }
  return sum;
}

/// Whether a component takes this step, or one that goes on from it.
bool FirstOrder::is_needed(std::size_t step) const {
  const auto takes = [step](const Choice& choice) {
    return (choice.near_step == step && choice.near_share > 0) || (step == 0 && choice.share > 0);
  };
  if (std::ranges::any_of(choices_, takes)) return true;
  return step + 1 < steps_.size() && steps_[step + 1].goes_on && is_needed(step + 1);
}

/// Adds what the steps would have gained at the anchors left out; the later ones only if some
/// component takes a step already, as few surfaces do. Errors are in the unit of the
/// positions; those that can be of rounding count as 0.
void FirstOrder::learn(const Frame& frame, const Test& test, std::vector<Gains>& components) {
  const double rounding = std::sqrt(model_.rounding.mean_square_of_positions(frame.x));
  const auto length = [&](const Vector3& x) {
    const double found = std::sqrt(squared_norm(x));
    return found > rounding ? found : 0;
  };
  const bool is_any_taken =
      std::ranges::any_of(choices_, [](const Choice& choice) { return choice.near_share > 0; });
  const LentField of_detail = predict(frame, test);
  LentField first = fields_.lend();
  LentField y = fields_.lend();
  bool is_finite = true;
  std::ranges::fill(newest_, Gains{});
  for (std::size_t n = 0; n < steps_.size(); ++n) {
    if (n > 0 && !is_any_taken) break;
    if (!steps_[n].goes_on) std::ranges::copy(of_detail, y.begin());
    take(steps_[n], nearby_l_, test.is_nearby, frame, y);
    if (n == 0) std::ranges::copy(y, first.begin());
    for (const Index v : test.left_out) {
      Gains& gains = newest_[topology_.component[v]];
      const Vector3 error = of_detail[v] - frame.observed[v];
      for (std::size_t q = 0; q < n_shares; ++q) {
        const double share = static_cast<double>(q + 1) / n_shares;
        const auto error_with = [&](Field step) {
          return length(error + share * (step[v] - of_detail[v]));
        };
        const double of_first = error_with(first);
        double of_step = error_with(y);
        if (std::abs(of_step - of_first) <= rounding) of_step = of_first;
        double& sum = gains.sums[n * n_shares + q];
        sum += length(error) - of_step;
        is_finite = is_finite && std::isfinite(sum);
        if (n > 0) gains.squares[(n - 1) * n_shares + q] += std::pow(of_first - of_step, 2);
      }
    }
  }
  if (!is_finite) return;
  for (std::size_t i = 0; i < test.left_out.size(); ++i) {
    Gains& gains = newest_[topology_.component[test.left_out[i]]];
    ++gains.count;
    gains.rings += test.rings[i];
  }
  for (std::size_t c = 0; c < components.size(); ++c) {
    // A component of which nothing was left out keeps what it has shown.
    if (newest_[c].count > 0) add(components[c], newest_[c], first_order_constants.kept);
  }
}

/// Chooses what each component takes. Those that have shown little take the same.
void FirstOrder::choose(std::span<const Gains> components) {
  const auto has_shown_enough = [](const Gains& gains) {
    return gains.count >= first_order_constants.least_count;
  };
  Gains common;
  for (const Gains& gains : components) {
    if (!has_shown_enough(gains)) add(common, gains);
  }
  for (std::size_t c = 0; c < components.size(); ++c) {
    choices_[c] = best_of(has_shown_enough(components[c]) ? components[c] : common);
  }
}

/// The shares with the largest sums of gains. Those of later steps count less what can be chance.
auto FirstOrder::best_of(const Gains& gains) -> Choice {
  Choice best;
  if (gains.count > 0) best.rings = gains.rings / gains.count;
  double most = 0;
  for (std::size_t n = 0; n < steps_.size(); ++n) {
    for (std::size_t q = 0; q < n_shares; ++q) {
      const double share = static_cast<double>(q + 1) / n_shares;
      const double chance = n == 0 ? 0
                                   : first_order_constants.chances[n - 1] *
                                         std::sqrt(gains.squares[(n - 1) * n_shares + q]);
      const double gain = gains.sums[n * n_shares + q] - chance;
      if (share < first_order_constants.least_share || gain <= most) continue;
      most = gain;
      best.near_step = n;
      best.near_share = share;
      if (n == 0) best.share = share;
    }
  }
  return best;
}

/// Moves positions by a step, with the edges of the frame that it keeps: to the Y of (13), and from
/// there on. They stay where `is_free` is 0. Every component with free vertices must have others,
/// too.
void FirstOrder::take(const Step& step, MaskedFactor& factor, std::span<const std::uint8_t> is_free,
                      const Frame& frame, std::span<Vector3> positions) {
  const Field kept = step.is_of_last ? frame.last : Field(model_.first_frame);
  factor.factorize(is_free);
  const auto rows = factor.order();
  LentField solution = fields_.lend();
  for (int n = 0; n < step.rounds; ++n) {
    fit_rotations(rows, positions, kept);
    workers_.for_each_in_chunks(
        rows.size(), [&](std::size_t r) { solution[r] = residual(at(rows[r]), positions); });
    factor.solve(solution, 1);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      positions[rows[r]] = positions[rows[r]] + solution[r];
    }
  }
}

/// Fits R of these vertices and of those beside them to the edges of L, which it weights as L does.
void FirstOrder::fit_rotations(std::span<const Index> rows, Field positions, Field kept) {
  const OperatorData l = data_of(laplacian_);
  std::ranges::fill(is_beside_, std::uint8_t{0});
  for (const Index v : rows) {
    for (Index e = l.offsets[v]; e < l.offsets[v + 1]; ++e) is_beside_[l.columns[e]] = 1;
  }
  const RotationData data = {l.offsets, l.columns,        edges_.data(),
                             nullptr,   positions.data(), covariances_.data()};
  const RotationKernels& kernels = best_kernels().rotations;
  const auto fit = [&](Index begin, Index end) {
    for (Index first = begin; first < end; first += at_once) {
      const Index after = std::min(first + at_once, end);
      if (std::count(&is_beside_[first], is_beside_.data() + after, 1) == 0) continue;
      for (Index i = first; i < after; ++i) {
        for (Index e = l.offsets[i]; e < l.offsets[i + 1]; ++e) {
          edges_[e] = -l.values[e] * (kept[at(l.columns[e])] - kept[at(i)]);
        }
        quaternions_[i] = {1, 0, 0, 0};
      }
      kernels.measure(data, first, after);
      kernels.fit(covariances_.data(), quaternions_.data(), first, after);
    }
  };
  workers_.for_each_short_chunk(static_cast<Index>(quaternions_.size()), fit);
}

/// The residual of the equation of vertex v in (13): b_v - (L X)_v.
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
