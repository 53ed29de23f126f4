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
  for (std::size_t q = 0; q < n_shares; ++q) {
    gains.sums[q] = kept * gains.sums[q] + other.sums[q];
  }
  gains.count = kept * gains.count + other.count;
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
      fields_(std::vector<Vector3>(model.size()), 3),
      tests_(Test(model.size()), 1),
      improvements_(Improvement(model.size()), 1),
      drawn_(topology_.report.components),
      newest_(drawn_.size()),
      is_free_(model.size()),
      is_beside_(model.size()),
      edges_(laplacian_.c->nonZeros()),
      quaternions_(model.size()),
      covariances_(model.size()) {
  Lent<Test> test = tests_.lend();
  for (auto* vertices : {&test.left_out, &test.nearby}) vertices->reserve(model.size());
  for (MaskedFactor* factor : {&factor_, &nearby_l_, &nearby_n_}) factor->reserve();
}

auto FirstOrder::improve(const Frame& frame, const Generations& generations, GainMemory& memory)
    -> Lent<Improvement> {
  Lent<Improvement> found = improvements_.lend();
  found.share = 0;
  if (generations.reached() == 0) return found;
  {
    const Lent<Test> test = leave_out(generations, memory.frame);
    if (!test.left_out.empty()) {
      const LentField of_detail = predict(frame, test);
      const LentField step = find_step(nearby_l_, test.is_nearby, of_detail, frame.last);
      learn(frame, test, of_detail, step, memory.components);
    }
  }
  const auto& components = memory.components;
  if (std::ranges::max(components, {}, &Component::share).share == 0) return found;
  const auto share_of = [&](std::size_t v) { return components[topology_.component[v]].share; };
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < is_free_.size(); ++v) {
    is_free_[v] = generation[v] > 0 && share_of(v) > 0 ? 1 : 0;
  }
  const LentField step = find_step(factor_, is_free_, frame.x, frame.last);
  double sum = 0;
  for (std::size_t v = 0; v < step.size(); ++v) {
    found.move[v] = is_free_[v] != 0 ? share_of(v) * step[v] : Vector3{};
    sum += is_free_[v] != 0 ? share_of(v) : 0;
  }
  found.share = sum / static_cast<double>(generations.reached());
  return found;
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

/// Chooses the shares by the predictions of the anchors left out. Errors are in the unit of the
/// positions; those that can be of rounding count as 0.
void FirstOrder::learn(const Frame& frame, const Test& test, Field of_detail, Field step,
                       std::vector<Component>& components) {
  const double rounding = std::sqrt(model_.rounding.mean_square_of_positions(frame.x));
  const auto length = [&](const Vector3& x) {
    const double found = std::sqrt(squared_norm(x));
    return found > rounding ? found : 0;
  };
  bool is_finite = true;
  std::ranges::fill(newest_, Gains{});
  for (const Index v : test.left_out) {
    const Vector3 error = of_detail[v] - frame.observed[v];
    const Vector3 of_first_order = of_detail[v] + step[v] - frame.observed[v];
    Gains& gains = newest_[topology_.component[v]];
    const double size = length(error);
    ++gains.count;
    for (std::size_t q = 0; q < n_shares; ++q) {
      const double share = static_cast<double>(q + 1) / n_shares;
      gains.sums[q] += size - length((1 - share) * error + share * of_first_order);
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
  for (std::size_t q = 0; q < n_shares; ++q) {
    const double candidate = static_cast<double>(q + 1) / n_shares;
    if (candidate < first_order_constants.least_share || gains.sums[q] <= best) continue;
    best = gains.sums[q];
    share = candidate;
  }
  return share;
}

/// Returns the step (k,) from the positions X to the Y of (13), 0 where `is_free` is 0. Every
/// component with free vertices must have others, too.
LentField FirstOrder::find_step(MaskedFactor& factor, std::span<const std::uint8_t> is_free,
                                Field positions, Field last) {
  factor.factorize(is_free);
  const auto rows = factor.order();
  fit_rotations(rows, positions, last);
  LentField solution = fields_.lend();
  workers_.for_each_in_chunks(
      rows.size(), [&](std::size_t r) { solution[r] = residual(at(rows[r]), positions); });
  factor.solve(solution, 1);
  LentField step = fields_.lend();
  std::ranges::fill(step, Vector3{});
  for (std::size_t r = 0; r < rows.size(); ++r) step[rows[r]] = solution[r];
  return step;
}

/// Fits R of these vertices and of those beside them to the edges of L, which it weights as L does.
void FirstOrder::fit_rotations(std::span<const Index> rows, Field positions, Field last) {
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
          edges_[e] = -l.values[e] * (last[at(l.columns[e])] - last[at(i)]);
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
