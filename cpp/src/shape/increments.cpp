#include "shape/increments.hpp"

#include <Eigen/SVD>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/geometry.hpp"
#include "linear/conjugate_gradients.hpp"
#include "shape/constants.hpp"

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
Quaternion turn_about(const Vector3& vector) {
  const double angle = std::sqrt(squared_norm(vector));
  const double scale = angle > 1e-12 ? std::sin(angle / 2) / angle : 0.5;
  return {std::cos(angle / 2), scale * vector.x, scale * vector.y, scale * vector.z};
}

Quaternion quaternion_of(const RigidMotion& motion) {
  const Eigen::Quaterniond q(motion.rotation);
  return {q.w(), q.x(), q.y(), q.z()};
}

/// The matrix of beta sum |omega_c - omega_d|^2, plus a weight that holds what nothing else does.
SparseMatrix couplings_of(const Clusters& clusters) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  const auto couple = [&](Index c, Index d) {
    const double weight = increment_constants.coupling;
    for (const auto& [i, j] : {std::array{c, d}, std::array{d, c}}) {
      entries.emplace_back(i, i, weight);
      entries.emplace_back(i, j, -weight);
    }
  };
  const auto n = static_cast<Index>(clusters.size());
  for (Index c = 0; c < n; ++c) {
    entries.emplace_back(c, c, increment_constants.hold);
    for (const Index d : clusters.neighbours[c]) {
      if (c < d) couple(c, d);
    }
  }
  SparseMatrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

Increments::Increments(const ShapeModel& model, double noise, Leaders& leaders, Workers& workers)
    : topology_(model.topology),
      clusters_(model.clusters()),
      workers_(workers),
      mean_edge_(model.mean_edge),
      squared_noise_(3 * noise * noise),
      leaders_(leaders),
      couplings_(couplings_of(clusters_)),
      factor_(couplings_, workers),
      generation_(model.size(), Generations::disconnected),
      anchors_(clusters_.size()),
      cluster_pairs_(clusters_, model.first_frame),
      has_anchors_(clusters_.size()),
      has_none_(clusters_.size()),
      moments_(clusters_.size()),
      moments_of_components_(topology_.report.components),
      arms_(clusters_.size()),
      first_(moments_of_components_.size()),
      is_known_(first_.size()),
      is_seen_(first_.size()),
      turns_(first_.size()),
      predicted_(first_.size() > 1 ? model.size() : 0),
      equations_(clusters_.size()),
      increments_(clusters_.size()),
      of_components_(first_.size()) {
  for (const Index centre : clusters_.centres) component_of_.push_back(topology_.component[centre]);
  clusters_of_ = lists_by_key(first_.size(), [&](const auto& visit) {
    for (Index c = 0; c < std::ssize(component_of_); ++c) visit(component_of_[c], c);
  });
  for (auto* field : {&omega_, &step_, &residual_, &preconditioned_, &direction_, &product_}) {
    field->resize(clusters_.size());
  }
  factor_.reserve();
}

std::span<const Quaternion> Increments::find(Field previous, Field observed,
                                             const Generations& generations,
                                             std::span<const double> departures) {
  find_pairs(generations);
  find_moments(previous, observed);
  find_arms();
  find_first();
  std::ranges::fill(omega_, Vector3{});
  for (std::size_t c = 0; c < increments_.size(); ++c) {
    increments_[c] = first_[component_of_[c]].rotation;
  }
  turn_clusters();
  follow(previous, departures);
  for (std::size_t c = 0; c < increments_.size(); ++c) {
    of_components_[component_of_[c]] = increments_[c];
  }
  return increments_;
}

/// Finds what depends on the mask only, if it is not that of the last frame.
void Increments::find_pairs(const Generations& generations) {
  if (std::ranges::equal(generation_, generations.of_vertices())) return;
  std::ranges::copy(generations.of_vertices(), generation_.begin());
  std::ranges::fill(anchors_, 0.0);
  for (std::size_t v = 0; v < generation_.size(); ++v) {
    if (generation_[v] == Generations::anchor) ++anchors_[clusters_.of_vertex[v]];
  }
  for (std::size_t c = 0; c < anchors_.size(); ++c) {
    has_anchors_[c] = anchors_[c] > 0 ? 1 : 0;
    has_none_[c] = 1 - has_anchors_[c];
  }
  pairs_ = cluster_pairs_.find(has_anchors_);
  factor_.factorize(has_none_);
}

/// 1 for clusters that touch, less for those that are far from each other on the surface.
double Increments::nearness(const ClusterPair& pair) const {
  const double distance = pair.path / (increment_constants.reach * mean_edge_);
  return 1 / (1 + distance * distance);
}

void Increments::find_moments(Field previous, Field observed) {
  const auto find = [&](std::size_t c) {
    moments_[c] = {};
    if (anchors_[c] == 0) return;
    moments_[c] = moments_of([&](const auto& visit) {
      for (const Index v : clusters_.members[static_cast<Index>(c)]) {
        if (generation_[v] == Generations::anchor) {
          visit(to_eigen(previous[v]), to_eigen(observed[v]));
        }
      }
    });
  };
  workers_.for_each_in_chunks(moments_.size(), find, Clusters::typical_size);
  std::ranges::fill(moments_of_components_, Moments{});
  for (std::size_t c = 0; c < moments_.size(); ++c) {
    moments_of_components_[component_of_[c]].add(moments_[c]);
  }
}

/// Weighs the arms by their mean square, and adds those from cluster to cluster.
void Increments::find_arms() {
  const double floor = std::pow(increment_constants.least_length * mean_edge_, 2);
  for (std::size_t c = 0; c < arms_.size(); ++c) {
    const Moments& moments = moments_[c];
    const double square = anchors_[c] > 1 ? moments.arms.before.trace() / anchors_[c] : 0;
    const double weight = 1 / (std::max(square, floor) + squared_noise_);
    arms_[c] = {weight * moments.arms.before, weight * moments.arms.now};
  }
  for (const ClusterPair& pair : pairs_) {
    const Moments& a = moments_[pair.a];
    const Moments& b = moments_[pair.b];
    const Eigen::Vector3d p = b.before - a.before;
    const Eigen::Vector3d q = b.now - a.now;
    const double noise = squared_noise_ / a.number + squared_noise_ / b.number;
    const double weight = nearness(pair) / (std::max(p.squaredNorm(), floor) + noise) / 2;
    Arms arms;
    arms.add(weight, p, q);
    for (const Index c : {pair.a, pair.b}) arms_[c].add(arms);
  }
}

/// Finds R of each component: that of its anchors if they are not near a line, else that of all
/// anchors of the frame.
void Increments::find_first() {
  Moments all;
  for (std::size_t i = 0; i < first_.size(); ++i) {
    const Moments& moments = moments_of_components_[i];
    first_[i] = first_of(moments, increment_constants.least_across * mean_edge_);
    is_known_[i] = first_[i].is_known ? 1 : 0;
    is_seen_[i] = moments.number > 0 ? 1 : 0;
    all.add(moments);
  }
  const auto is_missing = [](const First& first) { return !first.is_known; };
  if (std::ranges::none_of(first_, is_missing)) return;
  First of_all = first_of(all, 0);
  if (is_missing(of_all)) of_all = {{1, 0, 0, 0}, true};
  std::ranges::replace_if(first_, is_missing, of_all);
}

void Increments::turn_clusters() {
  for (int n = 0; n < increment_constants.iterations; ++n) {
    find_equations();
    if (take_step() < increment_constants.settled) break;
  }
}

/// Lets components whose anchors do not determine R turn as their leaders do where they are near
/// them: those with anchors first, which turn further as these tell, and then the others, which
/// they may lead.
void Increments::follow(Field previous, std::span<const double> departures) {
  const auto take = [&](const Leaders::Lead& lead) {
    const Quaternion rotation = first_[at(lead.follower)].rotation = rotation_around(lead);
    for (const Index c : clusters_of_[at(lead.follower)]) {
      omega_[c] = {};
      increments_[c] = rotation;
    }
  };
  const auto all = [](const std::vector<std::uint8_t>& flags) {
    return std::ranges::all_of(flags, [](auto flag) { return flag != 0; });
  };
  if (all(is_known_) || first_.size() < 2) return;
  bool any_turns = false;
  for (const Leaders::Lead& lead : leaders_.find(is_known_, departures, predicted(previous))) {
    take(lead);
    any_turns |= moments_of_components_[at(lead.follower)].number > 1;
  }
  if (any_turns) turn_clusters();
  if (all(is_seen_)) return;
  for (const Leaders::Lead& lead : leaders_.find(is_seen_, departures, predicted(previous)))
    take(lead);
}

/// (k,) where the components with anchors are if they have turned by D.
Field Increments::predicted(Field previous) {
  workers_.for_each_in_chunks(previous.size(), [&](std::size_t v) {
    const Moments& moments = moments_of_components_[at(topology_.component[v])];
    const auto arm = previous[v] - from_eigen(moments.before);
    predicted_[v] = moments.number == 0 ? previous[v]
                                        : rotated(increments_[at(clusters_.of_vertex[v])], arm) +
                                              from_eigen(moments.now);
  });
  return predicted_;
}

/// The mean D of the clusters of what leads a component that are near it.
Quaternion Increments::rotation_around(const Leaders::Lead& lead) const {
  Quaternion sum{};
  leaders_.for_each_place_around(lead,
                                 [&](Index v, double weight) { add_rotation(v, weight, sum); });
  return normalized(sum);
}
/// The same of its leader alone.
Quaternion Increments::rotation_at(const Leaders::Lead& lead) const {
  Quaternion sum{};
  leaders_.for_each_place(lead, [&](Index v, double weight) { add_rotation(v, weight, sum); });
  return normalized(sum);
}

void Increments::add_rotation(Index v, double weight, Quaternion& sum) const {
  const Quaternion& q = increments_[at(clusters_.of_vertex[v])];
  // q and -q are the same rotation.
  sum = plus(sum, dot(sum, q) < 0 ? -weight : weight, q);
}

std::span<const Turn> Increments::turns(std::span<const double> departures) {
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const Moments& moments = moments_of_components_[i];
    const Quaternion& first = first_[i].rotation;
    Turn& turn = turns_[i] = {};
    turn.centre = moments.now;
    turn.rotation = of_components_[i];
    if (is_known_[i] != 0) {
      turn.axes = 3;
      const Leaders::Lead lead = leaders_.best(static_cast<Index>(i), is_known_, departures);
      if (!(lead.trust > 0)) continue;
      const auto [w, x, y, z] = rotation_at(lead);
      const Quaternion beyond = product({w, -x, -y, -z}, first);
      const double sine = std::hypot(beyond.x, beyond.y, beyond.z);
      turn.squared_angle = std::pow(2 * std::atan2(sine, std::abs(beyond.w)), 2);
      turn.compared_axes = 3;
    } else if (moments.number > 1) {
      const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moments.arms.now,
                                                  Eigen::ComputeFullU | Eigen::ComputeFullV);
      if (!(svd.singularValues()[0] > std::pow(increment_constants.least_across * mean_edge_, 2))) {
        continue;
      }
      turn.axes = turn.compared_axes = 2;
      turn.line = svd.matrixU().col(0);
      const Vector3 expected = rotated(first, from_eigen(svd.matrixV().col(0)));
      const Eigen::Vector3d sine = to_eigen(expected).cross(turn.line);
      turn.squared_angle = std::pow(std::atan2(sine.norm(), to_eigen(expected).dot(turn.line)), 2);
    }
  }
  return turns_;
}

/// The rotation of anchors, known if they are farther from a line than this.
Increments::First Increments::first_of(const Moments& moments, double least_across) {
  if (moments.number < 3) return {};
  const RigidMotion motion = fit_rigid_motion(moments);
  if (!(motion.squared_across > least_across * least_across)) return {};
  return {quaternion_of(motion), true};
}

/// H = sum w (|y|^2 1 - y y^T) and s = sum w y x q, where y = D p, and what holds components that
/// others lead in the directions of which their anchors tell nothing.
void Increments::find_equations() {
  for (std::size_t c = 0; c < equations_.size(); ++c) {
    const auto& [w, x, y, z] = increments_[c];
    const Eigen::Matrix3d turn = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
    const Eigen::Matrix3d y_y = turn * arms_[c].before * turn.transpose();
    const Eigen::Matrix3d q_y = arms_[c].now * turn.transpose();
    Eigen::Matrix3d h = y_y.trace() * Eigen::Matrix3d::Identity() - y_y;
    Vector3 s = {q_y(2, 1) - q_y(1, 2), q_y(0, 2) - q_y(2, 0), q_y(1, 0) - q_y(0, 1)};
    if (is_known_[at(component_of_[c])] == 0 && first_.size() > 1) {
      h += increment_constants.hold_of_led * Eigen::Matrix3d::Identity();
      s = s - increment_constants.hold_of_led * omega_[c];
    }
    const auto i = static_cast<Index>(c);
    equations_[c] = {h, (h + couplings_.coeff(i, i) * Eigen::Matrix3d::Identity()).inverse(), s};
  }
}

/// Adds the step to omega that solves (H + couplings) step = s - couplings omega, found by
/// conjugate gradients, and turns R by omega. Returns the length of the longest step.
double Increments::take_step() {
  const OperatorData couplings = {couplings_.outerIndexPtr(), couplings_.innerIndexPtr(),
                                  couplings_.valuePtr(), nullptr};
  const auto couple = [&](Field x) {  // sets the product
    best_kernels().rotations.multiply(couplings, x.data(), 1, nullptr, product_.data(), 0,
                                      static_cast<Index>(x.size()));
  };
  couple(omega_);
  for (std::size_t c = 0; c < omega_.size(); ++c) {
    step_[c] = {};
    residual_[c] = equations_[c].s - product_[c];
  }
  const auto without = factor_.order();
  const auto precondition = [&] {
    for (std::size_t c = 0; c < omega_.size(); ++c) {
      preconditioned_[c] = from_eigen(equations_[c].inverse * to_eigen(residual_[c]));
    }
    if (without.empty()) return;
    for (std::size_t r = 0; r < without.size(); ++r) product_[r] = residual_[without[r]];
    factor_.solve(std::span(product_).first(without.size()), 1);
    for (std::size_t r = 0; r < without.size(); ++r) preconditioned_[without[r]] = product_[r];
  };
  const auto multiply = [&] {
    couple(direction_);
    for (std::size_t c = 0; c < product_.size(); ++c) {
      const Eigen::Vector3d of_arms = equations_[c].h * to_eigen(direction_[c]);
      product_[c] = product_[c] + from_eigen(of_arms);
    }
  };
  const auto advance = [&](const std::array<double, 1>& length) {
    for (std::size_t c = 0; c < step_.size(); ++c) step_[c] = step_[c] + length[0] * direction_[c];
  };
  const ConjugateVectors<Vector3> vectors = {residual_, preconditioned_, direction_, product_};
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
