#include "shape/cluster_rotations.hpp"

#include <Eigen/SVD>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

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

/// The rotation of anchors if they are farther from a line than this.
std::optional<Quaternion> rotation_of(const Moments& anchors, double least_across) {
  if (anchors.number < 3) return {};
  const RigidMotion motion = fit_rigid_motion(anchors);
  if (!(motion.squared_across > least_across * least_across)) return {};
  return quaternion_of(motion.rotation);
}

bool are_all(const std::vector<std::uint8_t>& flags) {
  return std::ranges::all_of(flags, [](std::uint8_t flag) { return flag != 0; });
}

/// The matrix of beta sum |omega_c - omega_d|^2 in (9), plus a weight that holds what nothing else
/// does.
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

AnchorRotations::AnchorRotations(const ShapeModel& model, double noise, Leaders& leaders,
                                 Workers& workers)
    : topology_(model.topology),
      clusters_(model.clusters()),
      workers_(workers),
      mean_edge_(model.mean_edge),
      squared_noise_(3 * noise * noise),
      leaders_(leaders),
      graph_(clusters_, model.first_frame),
      couplings_(couplings_of(clusters_)),
      factor_(couplings_, workers),
      rotations_(ClusterRotations(clusters_.size(), topology_.report.components), 1),
      turns_(std::vector<ComponentRotation>(topology_.report.components), 1),
      anchors_(ClusterAnchors(clusters_.size()), 1),
      arms_(std::vector<Arms>(clusters_.size()), 1),
      equations_(std::vector<Equation>(clusters_.size()), 1),
      of_clusters_(std::vector<Vector3>(clusters_.size()), 6),
      of_vertices_(std::vector<Vector3>(topology_.report.components > 1 ? model.size() : 0), 1) {
  for (const Index centre : clusters_.centres) component_of_.push_back(topology_.component[centre]);
  clusters_of_ = lists_by_key(topology_.report.components, [&](const auto& visit) {
    for (Index c = 0; c < std::ssize(component_of_); ++c) visit(component_of_[c], c);
  });
  factor_.reserve();
}

Lent<ClusterRotations> AnchorRotations::find(Field previous, Field observed,
                                             const Generations& generations,
                                             std::span<const double> departures) {
  const Lent<ClusterAnchors> anchors = anchors_of(previous, observed, generations);
  const Lent<ClusterPairs> pairs = graph_.pairs(anchors.are_any);
  const Lent<std::vector<Arms>> arms = arms_of(anchors, pairs.pairs);
  factor_.factorize(anchors.are_none);

  Lent<ClusterRotations> found = rotations_.lend();
  found.are_found = true;
  found.farthest = pairs.farthest;
  std::ranges::fill(found.anchors, Moments{});
  for (std::size_t c = 0; c < component_of_.size(); ++c) {
    found.anchors[component_of_[c]].add(anchors.moments[c]);
  }
  begin(found);
  LentField omega = of_clusters_.lend();
  std::ranges::fill(omega, Vector3{});
  turn_clusters(arms, omega, found);
  follow_leaders(previous, departures, arms, omega, found);
  for (std::size_t c = 0; c < component_of_.size(); ++c) {
    found.of_components[component_of_[c]] = found.of_clusters[c];
  }
  return found;
}

Lent<ClusterRotations> AnchorRotations::at_rest(bool is_known) {
  Lent<ClusterRotations> found = rotations_.lend();
  found.are_found = false;
  std::ranges::fill(found.of_components, Quaternion{1, 0, 0, 0});
  std::ranges::fill(found.anchors, Moments{});
  std::ranges::fill(found.is_known, std::uint8_t{is_known});
  return found;
}

auto AnchorRotations::anchors_of(Field previous, Field observed, const Generations& generations)
    -> Lent<ClusterAnchors> {
  const auto generation = generations.of_vertices();
  Lent<ClusterAnchors> found = anchors_.lend();
  const auto find = [&](std::size_t c) {
    const auto members = clusters_.members[static_cast<Index>(c)];
    const auto is_anchor = [&](Index v) { return generation[v] == Generations::anchor; };
    found.are_any[c] = std::ranges::any_of(members, is_anchor) ? 1 : 0;
    found.are_none[c] = 1 - found.are_any[c];
    found.moments[c] = {};
    if (found.are_any[c] == 0) return;
    found.moments[c] = moments_of([&](const auto& visit) {
      for (const Index v : members) {
        if (is_anchor(v)) visit(to_eigen(previous[v]), to_eigen(observed[v]));
      }
    });
  };
  workers_.for_each_in_chunks(clusters_.size(), find, Clusters::typical_size);
  return found;
}

/// (clusters,) the arms of the anchors and from cluster to cluster, with the weights w (10).
Lent<std::vector<Arms>> AnchorRotations::arms_of(const ClusterAnchors& anchors,
                                                 std::span<const ClusterPair> pairs) {
  Lent<std::vector<Arms>> found = arms_.lend();
  const double floor = std::pow(increment_constants.least_length * mean_edge_, 2);
  for (std::size_t c = 0; c < found.size(); ++c) {
    const auto& [number, before, now, arms] = anchors.moments[c];
    const double square = number > 1 ? arms.before.trace() / number : 0;
    const double weight = 1 / (std::max(square, floor) + squared_noise_);
    found[c] = {weight * arms.before, weight * arms.now};
  }
  for (const ClusterPair& pair : pairs) {
    const Moments& a = anchors.moments[pair.a];
    const Moments& b = anchors.moments[pair.b];
    const Eigen::Vector3d p = b.before - a.before;
    const Eigen::Vector3d q = b.now - a.now;
    const double noise = squared_noise_ / a.number + squared_noise_ / b.number;
    const double distance = pair.path / (increment_constants.reach * mean_edge_);
    const double nearness = 1 / (1 + distance * distance);
    const double weight = nearness / (std::max(p.squaredNorm(), floor) + noise) / 2;
    Arms arms;
    arms.add(weight, p, q);
    for (const Index c : {pair.a, pair.b}) found[c].add(arms);
  }
  return found;
}

/// Sets R of each component, with which its clusters begin: that of its anchors if they are not
/// near a line, else that of all anchors of the frame.
void AnchorRotations::begin(ClusterRotations& found) const {
  constexpr Quaternion identity = {1, 0, 0, 0};
  Moments all;
  for (std::size_t i = 0; i < found.first.size(); ++i) {
    const Moments& anchors = found.anchors[i];
    const auto rotation = rotation_of(anchors, increment_constants.least_across * mean_edge_);
    found.first[i] = rotation.value_or(identity);
    found.is_known[i] = rotation ? 1 : 0;
    found.is_seen[i] = anchors.number > 0 ? 1 : 0;
    all.add(anchors);
  }
  if (!are_all(found.is_known)) {
    const Quaternion of_all = rotation_of(all, 0).value_or(identity);
    for (std::size_t i = 0; i < found.first.size(); ++i) {
      if (found.is_known[i] == 0) found.first[i] = of_all;
    }
  }
  for (std::size_t c = 0; c < component_of_.size(); ++c) {
    found.of_clusters[c] = found.first[component_of_[c]];
  }
}

void AnchorRotations::turn_clusters(std::span<const Arms> arms, std::span<Vector3> omega,
                                    ClusterRotations& found) {
  for (int n = 0; n < increment_constants.iterations; ++n) {
    const auto equations = equations_of(arms, omega, found);
    if (take_step(equations, omega, found) < increment_constants.settled) break;
  }
}

/// Lets components whose anchors do not determine R turn as their leaders do where they are near
/// them: those with anchors first, which turn further as these tell, and then the others, which
/// they may lead.
void AnchorRotations::follow_leaders(Field previous, std::span<const double> departures,
                                     std::span<const Arms> arms, std::span<Vector3> omega,
                                     ClusterRotations& found) {
  if (are_all(found.is_known) || found.first.size() < 2) return;
  LentField predicted = of_vertices_.lend();
  // Calls `after` with each component that was turned to the mean D of the clusters of its leaders.
  const auto follow = [&](const std::vector<std::uint8_t>& may_lead, const auto& after) {
    predict(previous, found, predicted);
    const Lent<Leaders::Leads> leads = leaders_.find(may_lead, departures, predicted);
    for (const Leaders::Lead& lead : leads.leads) {
      const Quaternion rotation = found.first[at(lead.follower)] = mean_rotation(
          found, [&](const auto& visit) { leaders_.for_each_place_around(lead, leads, visit); });
      for (const Index c : clusters_of_[at(lead.follower)]) {
        omega[c] = {};
        found.of_clusters[c] = rotation;
      }
      after(at(lead.follower));
    }
  };
  bool any_turns = false;
  follow(found.is_known, [&](std::size_t i) { any_turns |= found.anchors[i].number > 1; });
  if (any_turns) turn_clusters(arms, omega, found);
  if (!are_all(found.is_seen)) follow(found.is_seen, [](std::size_t) {});
}

/// (k,) where the components with anchors are if they have turned by D.
void AnchorRotations::predict(Field previous, const ClusterRotations& found,
                              std::span<Vector3> predicted) const {
  workers_.for_each_in_chunks(previous.size(), [&](std::size_t v) {
    const Moments& moments = found.anchors[at(topology_.component[v])];
    const auto arm = previous[v] - from_eigen(moments.before);
    predicted[v] =
        moments.number == 0
            ? previous[v]
            : rotated(found.of_clusters[at(clusters_.of_vertex[v])], arm) + from_eigen(moments.now);
  });
}

/// The mean D of the clusters of the vertices that `for_each(visit)` visits, with weights.
template <class ForEach>
Quaternion AnchorRotations::mean_rotation(const ClusterRotations& of,
                                          const ForEach& for_each) const {
  Quaternion sum{};
  for_each([&](Index v, double weight) {
    const Quaternion& q = of.of_clusters[at(clusters_.of_vertex[v])];
    // q and -q are the same rotation.
    sum = plus(sum, dot(sum, q) < 0 ? -weight : weight, q);
  });
  return normalized(sum);
}

Lent<std::vector<ComponentRotation>> AnchorRotations::turns(const ClusterRotations& of,
                                                            std::span<const double> departures) {
  Lent<std::vector<ComponentRotation>> turns = turns_.lend();
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Moments& moments = of.anchors[i];
    const Quaternion& first = of.first[i];
    ComponentRotation& turn = turns[i] = {};
    turn.centre = moments.now;
    turn.rotation = of.of_components[i];
    if (of.is_known[i] != 0) {
      turn.axes = 3;
      if (!of.are_found) continue;
      const Leaders::Lead lead = leaders_.best(static_cast<Index>(i), of.is_known, departures);
      if (!(lead.trust > 0)) continue;
      const auto [w, x, y, z] =
          mean_rotation(of, [&](const auto& visit) { leaders_.for_each_place(lead, visit); });
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
  return turns;
}

/// (11) but for beta: H = sum w (|y|^2 1 - y y^T) and s = sum w y x q, where y = D p, and what
/// holds components that others lead in the directions of which their anchors tell nothing.
auto AnchorRotations::equations_of(std::span<const Arms> arms, Field omega,
                                   const ClusterRotations& found) -> Lent<std::vector<Equation>> {
  Lent<std::vector<Equation>> equations = equations_.lend();
  for (std::size_t c = 0; c < equations.size(); ++c) {
    const Eigen::Matrix3d turn = rotation_matrix(found.of_clusters[c]);
    const Eigen::Matrix3d y_y = turn * arms[c].before * turn.transpose();
    const Eigen::Matrix3d q_y = arms[c].now * turn.transpose();
    Eigen::Matrix3d h = y_y.trace() * Eigen::Matrix3d::Identity() - y_y;
    Vector3 s = {q_y(2, 1) - q_y(1, 2), q_y(0, 2) - q_y(2, 0), q_y(1, 0) - q_y(0, 1)};
    if (found.is_known[at(component_of_[c])] == 0 && found.first.size() > 1) {
      h += increment_constants.hold_of_led * Eigen::Matrix3d::Identity();
      s = s - increment_constants.hold_of_led * omega[c];
    }
    const auto i = static_cast<Index>(c);
    equations[c] = {h, (h + couplings_.coeff(i, i) * Eigen::Matrix3d::Identity()).inverse(), s};
  }
  return equations;
}

/// Adds the step to omega that solves (11), (H + couplings) step = s - couplings omega, found by
/// conjugate gradients, and turns R by omega. Returns the length of the longest step.
double AnchorRotations::take_step(std::span<const Equation> equations, std::span<Vector3> omega,
                                  ClusterRotations& found) {
  LentField step = of_clusters_.lend();
  LentField residual = of_clusters_.lend();
  LentField preconditioned = of_clusters_.lend();
  LentField direction = of_clusters_.lend();
  LentField product = of_clusters_.lend();
  const OperatorData couplings = {couplings_.outerIndexPtr(), couplings_.innerIndexPtr(),
                                  couplings_.valuePtr(), nullptr};
  const auto couple = [&](Field x) {  // sets the product
    best_kernels().rotations.multiply(couplings, x.data(), 1, nullptr, product.data(), 0,
                                      static_cast<Index>(x.size()));
  };
  couple(omega);
  for (std::size_t c = 0; c < omega.size(); ++c) {
    step[c] = {};
    residual[c] = equations[c].s - product[c];
  }
  const auto without = factor_.order();
  const auto precondition = [&] {
    for (std::size_t c = 0; c < omega.size(); ++c) {
      preconditioned[c] = from_eigen(equations[c].inverse * to_eigen(residual[c]));
    }
    if (without.empty()) return;
    for (std::size_t r = 0; r < without.size(); ++r) product[r] = residual[without[r]];
    factor_.solve(std::span(product).first(without.size()), 1);
    for (std::size_t r = 0; r < without.size(); ++r) preconditioned[without[r]] = product[r];
  };
  const auto multiply = [&] {
    couple(direction);
    for (std::size_t c = 0; c < product.size(); ++c) {
      const Eigen::Vector3d of_arms = equations[c].h * to_eigen(direction[c]);
      product[c] = product[c] + from_eigen(of_arms);
    }
  };
  const auto advance = [&](const std::array<double, 1>& length) {
    for (std::size_t c = 0; c < step.size(); ++c) step[c] = step[c] + length[0] * direction[c];
  };
  const ConjugateVectors<Vector3> vectors = {residual, preconditioned, direction, product};
  conjugate_gradients<1>(vectors, increment_constants.steps, increment_constants.reduced,
                         precondition, multiply, advance, workers_);
  double longest = 0;
  for (std::size_t c = 0; c < omega.size(); ++c) {
    omega[c] = omega[c] + step[c];
    found.of_clusters[c] = dynmesh::product(turn_about(omega[c]), found.first[component_of_[c]]);
    longest = std::max(longest, squared_norm(step[c]));
  }
  return std::sqrt(longest);
}

}  // namespace dynmesh
