#include "detail/first_order.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "support/geometry.hpp"
#include "support/indices.hpp"

namespace dynmesh {

FirstOrder::FirstOrder(const Topology& topology, Workers& workers,
                       const FirstOrderConstants& constants, bool is_noisy)
    : cells_(topology.cells),
      constants_(constants),
      step_(workers),
      shares_(topology, constants),
      kept_(topology.cells.size(), is_noisy),
      is_left_out_(topology.cells.size()),
      is_free_(topology.cells.size()),
      of_detail_(topology.cells.size()) {
  nearby_.reserve(topology.cells.size());
}

void FirstOrder::reset(const DetailOperator& k, const Rounding& rounding) {
  step_.reset(k, constants_);
  shares_.reset();
  rounding_ = rounding;
}

double FirstOrder::improve(const Frame& frame, const Anchors& anchors,
                           const Generations& generations, ShapeSystem& system) {
  if (generations.reached() == 0) return 0;
  try {
    if (shares_.is_due()) test(frame, anchors, generations, system);
    return mix(frame, generations, system);
  } catch (const std::bad_alloc&) {
    return 0;
  }
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
  std::size_t begin = 0;
  for (int ring = 0; begin < nearby_.size(); ++ring) {
    for (const std::size_t end = nearby_.size(); begin < end; ++begin) {
      if (ring >= shares_.rings_around(at(nearby_[begin]))) continue;
      for (const Index u : cells_[nearby_[begin]]) {
        if (anchors.is_solved[at(u)] != 0) add(at(u));
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
  if (!shares_.draw(generations, is_left_out_)) return;
  leave_out(anchors, generations);
  system.factorize(kept_);
  const Field step = system.solve<1>(
      [&](std::size_t v, std::size_t) { return frame.shape[v] - frame.kx[v]; }, frame.x, kept_);
  const auto sum = [](const Vector3<double>& a, const Vector3<double>& b) { return a + b; };
  std::ranges::transform(frame.x, step, of_detail_.begin(), sum);
  const auto of_first_order = step_.find(of_detail_, frame.last, is_free_, system.scratch());
  std::ranges::transform(of_detail_, of_first_order, of_first_order.begin(), sum);
  const double rounding = std::sqrt(rounding_.mean_square_of_positions(frame.x));
  shares_.learn(of_detail_, of_first_order, anchors.observed, is_left_out_, rounding);
}

/// Moves each satellite by the share of its component of the step.
double FirstOrder::mix(const Frame& frame, const Generations& generations, ShapeSystem& system) {
  if (shares_.largest() == 0) return 0;
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < is_free_.size(); ++v) {
    is_free_[v] = generation[v] > 0 && shares_.of_vertex(v) > 0 ? 1 : 0;
  }
  const Field step = step_.find(frame.x, frame.last, is_free_, system.scratch());
  double sum = 0;
  for (std::size_t v = 0; v < step.size(); ++v) {
    if (is_free_[v] == 0) continue;
    const double share = shares_.of_vertex(v);
    frame.x[v] = frame.x[v] + share * step[v];
    sum += share;
  }
  return sum / static_cast<double>(generations.reached());
}

}  // namespace dynmesh
