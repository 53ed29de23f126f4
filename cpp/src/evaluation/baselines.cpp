#include <algorithm>
#include <cmath>
#include <dynmesh/baselines.hpp>
#include <vector>

#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "linear/masked_factor.hpp"

namespace dynmesh {

struct Baseline::System {
  Topology topology;
  SparseMatrix energy;  // L, or L^2
  Workers workers{1};
  MaskedFactor factor{energy, workers};
};

namespace {

using Mask = std::vector<std::uint8_t>;
using Frame = std::vector<Vector3>;

/// L = D - R, eq. (2); with a frame, inverse distances in it take the place of the ones of R.
SparseMatrix laplacian(const Cells& cells, Field frame) {
  const double h = frame.empty() ? 1 : mean_edge_length(cells, frame);
  const double shortest = std::sqrt(squared_length_floor) * h;
  const auto weight = [&](Index i, Index j) {
    if (frame.empty()) return 1.0;
    return h / std::max(std::sqrt(squared_norm(frame[i] - frame[j])), shortest);
  };
  std::vector<Eigen::Triplet<double, Index>> entries;
  const auto k = static_cast<Index>(cells.size());
  for (Index i = 0; i < k; ++i) {
    double degree = 0;
    for (const Index j : cells[i]) {
      entries.emplace_back(i, j, -weight(i, j));
      degree += weight(i, j);
    }
    entries.emplace_back(i, i, degree);
  }
  SparseMatrix result(k, k);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

/// Sets `values` where `is_free` so that these rows of `energy` times the values are 0: the minimum
/// of a quadratic energy with the other values fixed. `factor` is that of the energy. Each
/// component must have a fixed value.
void interpolate(const SparseMatrix& energy, MaskedFactor& factor,
                 std::span<const std::uint8_t> is_free, std::span<Vector3> values) {
  factor.factorize(is_free);
  const auto order = factor.order();
  if (order.empty()) return;
  std::vector<Vector3> solution;
  for (const Index v : order) {
    Vector3 pull;  // of the fixed values
    for (SparseMatrix::InnerIterator e(energy, v); e; ++e) {
      if (is_free[e.row()] == 0) pull = pull - e.value() * values[e.row()];
    }
    solution.push_back(pull);
  }
  factor.solve(solution, 1);
  for (std::size_t r = 0; r < order.size(); ++r) values[order[r]] = solution[r];
}

void check_components(const Topology& topology, const Mask& known) {
  std::vector<std::size_t> size(topology.report.components), first(size), n_known(size);
  for (std::size_t v = known.size(); v-- > 0;) {
    const Index component = topology.component[v];
    ++size[component];
    first[component] = v;
    n_known[component] += known[v];
  }
  const auto bare = std::ranges::find(n_known, std::size_t{0}) - n_known.begin();
  if (bare == std::ssize(n_known)) return;
  refuse("known", "component ", bare, " (", size[bare], " vertices, the first is ", first[bare],
         ") has no known vertex, so its position is undetermined");
}

/// The known part of a frame, as positions or as motion vectors.
struct Given {
  Mask known;
  Frame values;  ///< positions, or motions from `origin`; 0 where unknown
  Frame origin;  ///< the previous frame; 0 for positions

  Given(const Topology& topology, Points<const double> points, KnownMask mask,
        Points<const double> previous)
      : known(topology.cells.size()), values(known.size()), origin(known.size()) {
    check_rows("points", points, known.size());
    check_rows("known", mask, known.size());
    if (previous.data != nullptr) origin = complete_frame("previous", previous, known.size());
    for (std::size_t v = 0; v < known.size(); ++v) {
      known[v] = mask[v] ? 1 : 0;
      if (known[v] != 0) values[v] = known_row(points, v) - origin[v];
    }
    check_components(topology, known);
  }
};

SparseMatrix energy_of(const Cells& cells, Objective objective, Weights weights,
                       Points<const double> reference) {
  const bool is_measured = weights == Weights::inverse_distance;
  if (is_measured != (reference.data != nullptr)) {
    refuse("reference", is_measured ? "is required for" : "requires",
           " weights 'inverse_distance'");
  }
  const Frame frame = is_measured ? complete_frame("reference", reference, cells.size()) : Frame();
  const SparseMatrix l = laplacian(cells, frame);
  return objective == Objective::harmonic ? l : SparseMatrix(l * l);  // L is symmetric
}

}  // namespace

Baseline::Baseline(const Topology& topology, Objective objective, Weights weights,
                   Points<const double> reference) {
  const DefaultArithmetic arithmetic;
  system_.reset(new System{topology, energy_of(topology.cells, objective, weights, reference)});
}
Baseline::~Baseline() = default;
Baseline::Baseline(Baseline&&) noexcept = default;
Baseline& Baseline::operator=(Baseline&&) noexcept = default;

void LeastSquaresMesh::complete(Points<const double> points, KnownMask known,
                                Points<const double> previous, Points<double> completed) {
  const DefaultArithmetic arithmetic;
  check_rows("completed", completed, system_->topology.cells.size());
  const Given given(system_->topology, points, known, previous);
  const std::vector<double> weights(given.known.begin(), given.known.end());
  system_->factor.factorize(Mask(weights.size(), 1), weights);
  const auto order = system_->factor.order();
  Frame solution;
  for (const Index v : order) solution.push_back(given.values[v]);
  system_->factor.solve(solution, 1);
  for (std::size_t r = 0; r < order.size(); ++r) {
    put_row(completed, at(order[r]), given.origin[order[r]] + solution[r]);
  }
}

Objective objective_from_name(std::string_view name) {
  if (name == "harmonic") return Objective::harmonic;
  if (name == "least_squares") return Objective::least_squares;
  refuse("objective", "must be 'harmonic' or 'least_squares', not '", name, "'");
}

Weights weights_from_name(std::string_view name) {
  if (name == "uniform") return Weights::uniform;
  if (name == "inverse_distance") return Weights::inverse_distance;
  refuse("weights", "must be 'uniform' or 'inverse_distance', not '", name, "'");
}

void LaplacianInterpolation::complete(Points<const double> points, KnownMask known,
                                      Points<const double> previous, Points<double> completed) {
  const DefaultArithmetic arithmetic;
  check_rows("completed", completed, system_->topology.cells.size());
  Given given(system_->topology, points, known, previous);
  Mask is_free(given.known);
  for (auto& free : is_free) free = free == 0 ? 1 : 0;
  interpolate(system_->energy, system_->factor, is_free, given.values);
  for (std::size_t v = 0; v < is_free.size(); ++v) {
    put_row(completed, v, is_free[v] == 0 ? row(points, v) : given.origin[v] + given.values[v]);
  }
}

}  // namespace dynmesh
