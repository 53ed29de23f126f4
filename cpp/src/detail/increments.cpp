#include "detail/increments.hpp"

#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "detail/constants.hpp"
#include "support/conjugate_gradients.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"

namespace dynmesh {
namespace {

double dot(const Quaternion& a, const Quaternion& b) {
  return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}

/// a + scale * b
Quaternion plus(const Quaternion& a, double scale, const Quaternion& b) {
  return {a.w + scale * b.w, a.x + scale * b.x, a.y + scale * b.y, a.z + scale * b.z};
}

Quaternion normalized(const Quaternion& q) { return plus({}, 1 / std::sqrt(dot(q, q)), q); }

/// The rotation about a vector by its length.
Quaternion turn_about(const Vector3<double>& vector) {
  const double angle = std::sqrt(squared_norm(vector));
  const double scale = angle > 1e-12 ? std::sin(angle / 2) / angle : 0.5;
  return {std::cos(angle / 2), scale * vector.x, scale * vector.y, scale * vector.z};
}

Quaternion quaternion_of(const RigidMotion& motion) {
  const Eigen::Quaterniond q(motion.rotation);
  return {q.w(), q.x(), q.y(), q.z()};
}

/// The matrix of beta sum g |omega_c - omega_d|^2, plus a weight that holds what nothing else does.
SparseMatrix couplings_of(const Clusters& clusters, std::span<const Tie> ties) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  const auto couple = [&](Index c, Index d, double g) {
    const double weight = increment_constants.coupling * g;
    for (const auto& [i, j] : {std::array{c, d}, std::array{d, c}}) {
      entries.emplace_back(i, i, weight);
      entries.emplace_back(i, j, -weight);
    }
  };
  const auto n = static_cast<Index>(clusters.size());
  for (Index c = 0; c < n; ++c) {
    entries.emplace_back(c, c, increment_constants.hold);
    for (const Index d : clusters.neighbours[c]) {
      if (c < d) couple(c, d, 1);
    }
  }
  for (const Tie& tie : ties) {
    couple(clusters.of_vertex[tie.i], clusters.of_vertex[tie.j], tie.weight);
  }
  SparseMatrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

Increments::Increments(const Topology& topology, const Clusters& clusters, Field first_frame,
                       double mean_edge, double noise, Workers& workers)
    : topology_(topology),
      clusters_(clusters),
      workers_(workers),
      mean_edge_(mean_edge),
      noise_(3 * noise * noise),
      ties_(find_ties(topology, first_frame, mean_edge, increment_constants.tie)),
      couplings_(couplings_of(clusters, ties_)),
      factor_(couplings_, workers),
      generation_(first_frame.size(), Generations::disconnected),
      cluster_pairs_(clusters, first_frame),
      has_anchors_(clusters.size()),
      all_(clusters.size(), 1),
      weights_(clusters.size()),
      first_(topology.report.components),
      next_first_(first_.size()),
      middles_(clusters.size()),
      equations_(clusters.size()),
      increments_(clusters.size()),
      of_components_(first_.size()) {
  for (const Index centre : clusters.centres) component_of_.push_back(topology.component[centre]);
  members_ = lists_by_key(first_.size(), [&](const auto& visit) {
    for (Index v = 0; v < static_cast<Index>(first_frame.size()); ++v) {
      visit(topology.component[v], v);
    }
  });
  for (auto* field : {&omega_, &step_, &residual_, &preconditioned_, &direction_, &product_}) {
    field->resize(clusters.size());
  }
  chosen_.reserve(first_frame.size());
  factor_.reserve();
}

std::span<const Quaternion> Increments::find(Field previous, Field observed,
                                             const Generations& generations) {
  find_pairs(generations);
  find_first(previous, observed);
  find_middles(previous, observed);
  std::ranges::fill(omega_, Vector3<double>{});
  for (std::size_t c = 0; c < increments_.size(); ++c) {
    increments_[c] = first_[component_of_[c]].rotation;
  }
  for (int n = 0; n < increment_constants.iterations; ++n) {
    find_equations(previous, observed);
    if (take_step() < increment_constants.settled) break;
  }
  for (std::size_t c = 0; c < increments_.size(); ++c) {
    of_components_[component_of_[c]] = increments_[c];
  }
  return increments_;
}

/// Finds what depends on the mask only, if it is not that of the last frame.
void Increments::find_pairs(const Generations& generations) {
  if (std::ranges::equal(generation_, generations.of_vertices())) return;
  std::ranges::copy(generations.of_vertices(), generation_.begin());
  for (Middle& middle : middles_) middle.anchors = 0;
  for (std::size_t v = 0; v < generation_.size(); ++v) {
    if (is_anchor(v)) ++middles_[clusters_.of_vertex[v]].anchors;
  }
  // In the mean over all directions of y, |y|^2 1 - y y^T is two thirds of |y|^2.
  for (std::size_t c = 0; c < middles_.size(); ++c) {
    has_anchors_[c] = middles_[c].anchors > 0 ? 1 : 0;
    weights_[c] = middles_[c].anchors > 1 ? 2 * middles_[c].anchors / 3 : 0;
  }
  pairs_ = cluster_pairs_.find(has_anchors_);
  for (const ClusterPair& pair : pairs_) {
    for (const Index c : {pair.a, pair.b}) weights_[c] += nearness(pair) / 3;
  }
  factor_.factorize(all_, weights_);
}

/// 1 for clusters that touch, less for those that are far from each other on the surface.
double Increments::nearness(const ClusterPair& pair) const {
  const double distance = pair.path / (increment_constants.reach * mean_edge_);
  return 1 / (1 + distance * distance);
}

/// Finds R of each component: that of its anchors if they are not near a line; else that of what it
/// is tied to; and if that has none, that of all anchors of the frame.
void Increments::find_first(Field previous, Field observed) {
  for (std::size_t i = 0; i < first_.size(); ++i) {
    first_[i] = first_of(members_[i], increment_constants.least_across, previous, observed);
  }
  const auto is_missing = [](const First& first) { return !first.is_known; };
  for (auto missing = std::ranges::count_if(first_, is_missing); missing > 0;) {
    follow_ties();
    const auto left = std::ranges::count_if(first_, is_missing);
    if (left == missing) break;
    missing = left;
  }
  if (std::ranges::none_of(first_, is_missing)) return;
  First of_all = first_of(members_.neighbours, 0, previous, observed);
  if (is_missing(of_all)) of_all = {{1, 0, 0, 0}, true};
  std::ranges::replace_if(first_, is_missing, of_all);
}

/// The rotation of the anchors among these vertices, known if they are farther from a line than so
/// many mean edges.
Increments::First Increments::first_of(std::span<const Index> vertices, double least_across,
                                       Field previous, Field observed) {
  chosen_.clear();
  std::ranges::copy_if(vertices, std::back_inserter(chosen_),
                       [&](Index v) { return is_anchor(at(v)); });
  if (chosen_.size() < 3) return {};
  const RigidMotion motion = fit_rigid_motion<double>(chosen_, previous, observed);
  const double least = least_across * mean_edge_;
  if (!(motion.squared_across > least * least)) return {};
  return {quaternion_of(motion), true};
}

/// Lets components without R take the mean of those that they are tied to.
void Increments::follow_ties() {
  std::ranges::copy(first_, next_first_.begin());
  for (const Tie& tie : ties_) {
    for (const auto& [v, other] : {std::array{tie.i, tie.j}, std::array{tie.j, tie.i}}) {
      const First& followed = first_[topology_.component[other]];
      if (first_[topology_.component[v]].is_known || !followed.is_known) continue;
      Quaternion& sum = next_first_[topology_.component[v]].rotation;
      // q and -q are the same rotation.
      sum = plus(sum, dot(sum, followed.rotation) < 0 ? -1 : 1, followed.rotation);
    }
  }
  for (First& first : next_first_) {
    if (first.is_known || dot(first.rotation, first.rotation) == 0) continue;
    first = {normalized(first.rotation), true};
  }
  std::swap(first_, next_first_);
}

void Increments::find_middles(Field previous, Field observed) {
  for (Middle& middle : middles_) middle.before = middle.now = {};
  for (std::size_t v = 0; v < previous.size(); ++v) {
    if (!is_anchor(v)) continue;
    Middle& middle = middles_[clusters_.of_vertex[v]];
    middle.before = middle.before + previous[v];
    middle.now = middle.now + observed[v];
  }
  for (Middle& middle : middles_) {
    if (middle.anchors == 0) continue;
    middle.before = (1 / middle.anchors) * middle.before;
    middle.now = (1 / middle.anchors) * middle.now;
  }
}

void Increments::find_equations(Field previous, Field observed) {
  std::ranges::fill(equations_, Equation{});
  const double floor = std::pow(increment_constants.least_length * mean_edge_, 2);
  const auto add = [&](Index c, double weight, const Vector3<double>& p, const Vector3<double>& q) {
    const auto y = rotated(increments_[c], p);
    Equation& e = equations_[c];
    e.xx += weight * (y.y * y.y + y.z * y.z);
    e.yy += weight * (y.x * y.x + y.z * y.z);
    e.zz += weight * (y.x * y.x + y.y * y.y);
    e.xy -= weight * y.x * y.y;
    e.xz -= weight * y.x * y.z;
    e.yz -= weight * y.y * y.z;
    e.s = e.s + weight * cross(y, q);
  };
  for (std::size_t v = 0; v < previous.size(); ++v) {
    const Index c = clusters_.of_vertex[v];
    if (!is_anchor(v) || middles_[c].anchors < 2) continue;
    const auto p = previous[v] - middles_[c].before;
    const double weight = 1 / (std::max(squared_norm(p), floor) + noise_);
    add(c, weight, p, observed[v] - middles_[c].now);
  }
  for (const ClusterPair& pair : pairs_) {
    const Middle& a = middles_[pair.a];
    const Middle& b = middles_[pair.b];
    const auto p = b.before - a.before;
    const double noise = noise_ / a.anchors + noise_ / b.anchors;
    const double weight = nearness(pair) / (std::max(squared_norm(p), floor) + noise) / 2;
    for (const Index c : {pair.a, pair.b}) add(c, weight, p, b.now - a.now);
  }
}

/// Adds the step to omega that solves (H + couplings) step = s - couplings omega, found by
/// conjugate gradients, and turns R by omega. Returns the length of the longest step.
double Increments::take_step() {
  const auto coupled = [&](std::size_t c, std::span<const Vector3<double>> of) {
    Vector3<double> sum;
    for (SparseMatrix::InnerIterator e(couplings_, static_cast<Index>(c)); e; ++e) {
      sum = sum + e.value() * of[e.row()];
    }
    return sum;
  };
  for (std::size_t c = 0; c < omega_.size(); ++c) {
    step_[c] = {};
    residual_[c] = equations_[c].s - coupled(c, omega_);
  }
  const auto order = factor_.order();
  const auto precondition = [&] {
    for (std::size_t r = 0; r < order.size(); ++r) product_[r] = residual_[order[r]];
    factor_.solve(product_, 1);
    for (std::size_t r = 0; r < order.size(); ++r) preconditioned_[order[r]] = product_[r];
  };
  const auto multiply = [&] {
    workers_.for_each_in_chunks(omega_.size(), [&](std::size_t c) {
      const auto& [xx, xy, xz, yy, yz, zz, s] = equations_[c];
      const auto& [x, y, z, unused] = direction_[c];
      const Vector3<double> of_pairs = {xx * x + xy * y + xz * z, xy * x + yy * y + yz * z,
                                        xz * x + yz * y + zz * z};
      product_[c] = of_pairs + coupled(c, direction_);
    });
  };
  const auto advance = [&](const std::array<double, 1>& length) {
    for (std::size_t c = 0; c < step_.size(); ++c) step_[c] = step_[c] + length[0] * direction_[c];
  };
  const ConjugateVectors<Vector3<double>> vectors = {residual_, preconditioned_, direction_,
                                                     product_};
  conjugate_gradients<1>(vectors, increment_constants.steps, increment_constants.reduced,
                         precondition, multiply, advance, workers_);
  double longest = 0;
  for (std::size_t c = 0; c < omega_.size(); ++c) {
    omega_[c] = omega_[c] + step_[c];
    increments_[c] = product(turn_about(omega_[c]), first_[component_of_[c]].rotation);
    longest = std::max(longest, squared_norm(step_[c]));
  }
  return std::sqrt(longest);
}

}  // namespace dynmesh
