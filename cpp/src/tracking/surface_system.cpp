#include "tracking/surface_system.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "stream/disconnected.hpp"
#include "support/conjugate_gradients.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// Chooses at most `n` of the vertices, each the one that is farthest from those before it.
std::vector<std::uint32_t> spread(const std::vector<std::uint32_t>& vertices, std::size_t n,
                                  std::span<const Vector3<double>> x) {
  if (vertices.size() <= n) return vertices;
  std::vector<std::uint32_t> chosen;
  std::vector<double> nearest(vertices.size(), std::numeric_limits<double>::infinity());
  for (std::ptrdiff_t next = 0; chosen.size() < n;) {
    chosen.push_back(vertices[next]);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      nearest[i] = std::min(nearest[i], squared_norm(x[vertices[i]] - x[chosen.back()]));
    }
    next = std::ranges::max_element(nearest) - nearest.begin();
  }
  return chosen;
}

/// The matrix of the energies of a shape and of ties.
SparseMatrix tied(SparseMatrix normal, std::span<const Tie> ties) {
  for (const auto& [i, j, weight, kept] : ties) {
    const auto [a, b] = std::array{static_cast<Index>(i), static_cast<Index>(j)};
    normal.coeffRef(a, a) += weight;
    normal.coeffRef(b, b) += weight;
    normal.coeffRef(a, b) -= weight;
    normal.coeffRef(b, a) -= weight;
  }
  return normal;
}

}  // namespace

std::vector<Tie> find_ties(const Topology& topology, std::span<const Vector3<double>> first_frame,
                           double mean_edge, const TrackingConstants& constants) {
  if (topology.report.components < 2) return {};
  const std::vector<Index> nearest = find_donors(first_frame, topology.component);
  std::vector<double> distances;  // (k,) of each vertex from the nearest one, in mean edges
  std::vector<std::vector<std::uint32_t>> vertices(topology.report.components);
  for (std::uint32_t v = 0; v < first_frame.size(); ++v) {
    const double squared = squared_norm(first_frame[v] - first_frame[nearest[v]]);
    distances.push_back(std::sqrt(squared) / mean_edge);
    vertices[at(topology.component[v])].push_back(v);
  }
  const auto distance = [&](std::uint32_t v) { return distances[v]; };
  std::vector<Tie> ties;
  for (auto& of_component : vertices) {
    std::ranges::stable_sort(of_component, {}, distance);
    const double reach = distances[of_component[0]] + constants.tied_within;
    const auto beyond = std::ranges::upper_bound(of_component, reach, {}, distance);
    const auto near = static_cast<std::size_t>(beyond - of_component.begin());
    of_component.resize(std::min(of_component.size(), std::max(near, constants.ties)));
    for (const std::uint32_t v : spread(of_component, constants.ties, first_frame)) {
      const auto other = static_cast<std::uint32_t>(nearest[v]);
      const double weight = constants.tie_weight / (1 + distances[v] * distances[v]);
      ties.push_back({v, other, weight, first_frame[v] - first_frame[other]});
    }
  }
  return ties;
}

SurfaceSystem::SurfaceSystem(ShapeSystem& shape, const Cells& cells,
                             const TrackingConstants& constants, std::vector<Tie> ties,
                             Field first_frame, const Clusters& clusters, Workers& workers)
    : shape_(shape),
      constants_(constants),
      workers_(workers),
      ties_(std::move(ties)),
      coarse_(cells, first_frame, clusters, tied(shape.normal(), ties_)),
      anchors_(cells.size(), true) {
  std::ranges::fill(anchors_.is_solved, std::uint8_t{1});
  anchors_.n_solved = cells.size();
}

/// (k,) the weights that hold the vertices.
std::vector<double> SurfaceSystem::held(std::span<const Landmark> landmarks) const {
  std::vector<double> weights;
  for (const double mu : shape_.membrane()) weights.push_back(constants_.hold * mu);
  for (const Landmark& landmark : landmarks) weights[landmark.vertex] += landmark.weight;
  return weights;
}

void SurfaceSystem::factorize(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                              double factor) {
  const auto weights = held(landmarks);
  std::ranges::copy(weights, anchors_.weights.begin());
  for (const SurfaceRow& row : rows) {
    const double weight = constants_.preconditioned * factor * row.weight;
    for (std::size_t s = 0; s < 3; ++s) anchors_.weights[row.corners[s]] += weight * row.shares[s];
  }
  for (const Tie& tie : ties_) {
    anchors_.weights[tie.i] += tie.weight;
    anchors_.weights[tie.j] += tie.weight;
  }
  shape_.factorize(anchors_);
  coarse_.factorize(rows, factor, weights);
}

void SurfaceSystem::solve(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                          std::span<Vector3<double>> x, std::span<Vector3<double>> force) {
  const auto weights = held(landmarks);
  const RowMatrix matrix(rows, x.size());
  matrix.add_forces(rows, x, force);
  for (const Landmark& l : landmarks) {
    force[l.vertex] = force[l.vertex] + l.weight * (l.target - x[l.vertex]);
  }
  std::vector<Vector3<double>> steps(x.size()), direction(x.size()), product(x.size());
  const auto precondition = [&] {
    shape_.precondition(force, product);
    coarse_.add(force, product, workers_);
  };
  const auto multiply_direction = [&] {
    shape_.multiply(direction, product);
    for (const Tie& tie : ties_) {
      const auto tied = tie.weight * (direction[tie.i] - direction[tie.j]);
      product[tie.i] = product[tie.i] + tied;
      product[tie.j] = product[tie.j] - tied;
    }
    matrix.add_product(direction, product, workers_);
    workers_.for_each_in_chunks(product.size(), [&](std::size_t v) {
      product[v] = product[v] + weights[v] * direction[v];
    });
  };
  const auto advance = [&](const std::array<double, 1>& length) {
    workers_.for_each_in_chunks(
        steps.size(), [&](std::size_t v) { steps[v] = steps[v] + length[0] * direction[v]; });
  };
  const ConjugateVectors<Vector3<double>> vectors = {force, product, direction, product};
  conjugate_gradients<1>(vectors, constants_.steps, constants_.settled, precondition,
                         multiply_direction, advance, workers_);
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + steps[v];
}

}  // namespace dynmesh
