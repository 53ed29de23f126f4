#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <dynmesh/baselines.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/checks.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;
using Cholesky = Eigen::SimplicialLLT<Matrix>;
using Mask = std::vector<std::uint8_t>;

/// Returns L = D - R, eq. (2), with `weight(i, j)` instead of the ones of R.
template <class Weight>
Matrix laplacian(const Cells& cells, const Weight& weight) {
  const auto k = static_cast<Eigen::Index>(cells.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(cells.neighbours.size() + cells.size());
  for (Index i = 0; i < k; ++i) {
    double degree = 0;
    for (const Index j : cells[i]) {
      const double w = weight(i, j);
      entries.emplace_back(i, j, -w);
      degree += w;
    }
    entries.emplace_back(i, i, degree);
  }
  Matrix result(k, k);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

double one(Index /*i*/, Index /*j*/) { return 1; }

std::vector<Vector3<double>> whole_frame(const char* argument, Points<const double> points,
                                         std::size_t k) {
  check_rows(argument, points, k);
  std::vector<Vector3<double>> frame(k);
  for (std::size_t v = 0; v < k; ++v) {
    frame[v] = row(points, v);
    if (!is_finite(frame[v])) {
      throw std::invalid_argument(std::string(argument) + ": vertex " + std::to_string(v) +
                                  " is at " + to_text(frame[v]) +
                                  ", but this frame must be complete and finite");
    }
  }
  return frame;
}

/// The known part of a frame, as positions or as motion vectors.
struct Given {
  Mask known;
  Columns positions;  ///< as given; zero where unknown
  Columns values;     ///< positions, or motions from `origin`; zero where unknown
  Columns origin;     ///< the previous frame; zero for positions

  Given(const Topology& topology, Points<const double> points, KnownMask mask,
        Points<const double> previous) {
    const std::size_t k = topology.cells.size();
    check_rows("points", points, k);
    check_rows("known", mask, k);
    positions.setZero(static_cast<Eigen::Index>(k), 3);
    values.setZero(static_cast<Eigen::Index>(k), 3);
    origin.setZero(static_cast<Eigen::Index>(k), 3);
    if (previous.data != nullptr) {
      const auto frame = whole_frame("previous", previous, k);
      for (std::size_t v = 0; v < k; ++v) {
        origin.row(static_cast<Eigen::Index>(v)) << frame[v].x, frame[v].y, frame[v].z;
      }
    }
    known.resize(k);
    for (std::size_t v = 0; v < k; ++v) {
      known[v] = mask[v] ? 1 : 0;
      if (known[v] == 0) continue;
      const Vector3<double> position = row(points, v);
      if (!is_finite(position)) {
        throw std::invalid_argument("points: row " + std::to_string(v) + " is at " +
                                    to_text(position) + ", but known positions must be finite");
      }
      const auto row = static_cast<Eigen::Index>(v);
      positions.row(row) << position.x, position.y, position.z;
      values.row(row) = positions.row(row) - origin.row(row);
    }
    check_components(topology);
  }

 private:
  void check_components(const Topology& topology) const {
    std::vector<std::size_t> size(topology.report.components, 0);
    std::vector<std::size_t> first(topology.report.components, 0);
    std::vector<std::size_t> n_known(topology.report.components, 0);
    for (std::size_t v = known.size(); v-- > 0;) {
      const auto component = static_cast<std::size_t>(topology.component[v]);
      ++size[component];
      first[component] = v;
      n_known[component] += known[v];
    }
    const auto bare = std::ranges::find(n_known, std::size_t{0});
    if (bare == n_known.end()) return;
    const auto component = static_cast<std::size_t>(bare - n_known.begin());
    throw std::invalid_argument("known: component " + std::to_string(component) + " (" +
                                std::to_string(size[component]) + " vertices, the first is " +
                                std::to_string(first[component]) +
                                ") has no known vertex, so its position is undetermined");
  }
};

void write(const Columns& values, Points<double> completed) {
  for (std::size_t v = 0; v < completed.count; ++v) {
    for (std::size_t c = 0; c < 3; ++c) {
      completed(v, c) = values(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(c));
    }
  }
}

void check_solved(const Cholesky& factor) {
  if (factor.info() != Eigen::Success) {
    throw std::runtime_error("the Laplacian system is singular in double precision");
  }
}

}  // namespace

struct LeastSquaresMesh::System {
  const Topology topology;
  const Matrix smoothness;  // L^T L
  Matrix normal;            // the same, plus 1 on the diagonal at known vertices
  Cholesky factor;

  explicit System(const Topology& mesh) : topology(mesh), smoothness(square(mesh.cells)) {
    normal = smoothness;
    factor.analyzePattern(normal);
  }
  static Matrix square(const Cells& cells) {
    const Matrix l = laplacian(cells, one);
    return l.transpose() * l;
  }
};

LeastSquaresMesh::LeastSquaresMesh(const Topology& topology)
    : system_(std::make_unique<System>(topology)) {}
LeastSquaresMesh::~LeastSquaresMesh() = default;
LeastSquaresMesh::LeastSquaresMesh(LeastSquaresMesh&&) noexcept = default;
LeastSquaresMesh& LeastSquaresMesh::operator=(LeastSquaresMesh&&) noexcept = default;

void LeastSquaresMesh::complete(Points<const double> points, KnownMask known,
                                Points<const double> previous, Points<double> completed) {
  System& system = *system_;
  check_rows("completed", completed, system.topology.cells.size());
  const Given given(system.topology, points, known, previous);
  for (Eigen::Index v = 0; v < system.normal.cols(); ++v) {
    system.normal.coeffRef(v, v) =
        system.smoothness.coeff(v, v) + given.known[static_cast<std::size_t>(v)];
  }
  system.factor.factorize(system.normal);
  check_solved(system.factor);
  const Columns solution = system.factor.solve(given.values);
  write(given.origin + solution, completed);
}

Objective objective_from_name(std::string_view name) {
  if (name == "harmonic") return Objective::harmonic;
  if (name == "least_squares") return Objective::least_squares;
  throw std::invalid_argument("objective: must be 'harmonic' or 'least_squares', not '" +
                              std::string(name) + "'");
}

Weights weights_from_name(std::string_view name) {
  if (name == "uniform") return Weights::uniform;
  if (name == "inverse_distance") return Weights::inverse_distance;
  throw std::invalid_argument("weights: must be 'uniform' or 'inverse_distance', not '" +
                              std::string(name) + "'");
}

struct LaplacianInterpolation::System {
  const Topology topology;
  const Matrix energy;  // L, or L^T L; its rows at unknown vertices are set to zero by the solution
  Mask known;           // the known mask of the factor below
  std::vector<Eigen::Index>
      unknown_index;  // the index among the unknown vertices; -1 for known ones
  Matrix unknown_block;
  Cholesky factor;

  System(const Topology& mesh, Objective objective, Weights weights, Points<const double> reference)
      : topology(mesh), energy(make_energy(mesh.cells, objective, weights, reference)) {}

  static Matrix make_energy(const Cells& cells, Objective objective, Weights weights,
                            Points<const double> reference) {
    if (weights == Weights::uniform && reference.data != nullptr) {
      throw std::invalid_argument("reference: requires weights 'inverse_distance'");
    }
    const Matrix l = weights == Weights::uniform ? laplacian(cells, one)
                                                 : inverse_distance_laplacian(cells, reference);
    return objective == Objective::harmonic ? l : Matrix(l.transpose() * l);
  }

  static Matrix inverse_distance_laplacian(const Cells& cells, Points<const double> reference) {
    if (reference.data == nullptr) {
      throw std::invalid_argument("reference: is required for weights 'inverse_distance'");
    }
    const auto frame = whole_frame("reference", reference, cells.size());
    const double h = mean_edge_length<double>(cells, frame);
    const double shortest = std::sqrt(squared_length_floor) * h;
    return laplacian(cells, [&](Index i, Index j) {
      const auto edge = frame[static_cast<std::size_t>(i)] - frame[static_cast<std::size_t>(j)];
      return h / std::max(std::sqrt(squared_norm(edge)), shortest);
    });
  }

  void factorize(const Mask& mask) {
    if (known == mask) return;  // reuse the factor of the last frame
    unknown_index.assign(mask.size(), -1);
    Eigen::Index n_unknown = 0;
    for (std::size_t v = 0; v < mask.size(); ++v) {
      if (mask[v] == 0) unknown_index[v] = n_unknown++;
    }
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index column = 0; column < energy.cols(); ++column) {
      const Eigen::Index j = unknown_index[static_cast<std::size_t>(column)];
      if (j < 0) continue;
      for (Matrix::InnerIterator entry(energy, column); entry; ++entry) {
        const Eigen::Index i = unknown_index[static_cast<std::size_t>(entry.row())];
        if (i >= 0) entries.emplace_back(i, j, entry.value());
      }
    }
    unknown_block.resize(n_unknown, n_unknown);
    unknown_block.setFromTriplets(entries.begin(), entries.end());
    known.clear();  // in case the next line fails
    factor.compute(unknown_block);
    check_solved(factor);
    known = mask;
  }
};

LaplacianInterpolation::LaplacianInterpolation(const Topology& topology, Objective objective,
                                               Weights weights, Points<const double> reference)
    : system_(std::make_unique<System>(topology, objective, weights, reference)) {}
LaplacianInterpolation::~LaplacianInterpolation() = default;
LaplacianInterpolation::LaplacianInterpolation(LaplacianInterpolation&&) noexcept = default;
LaplacianInterpolation& LaplacianInterpolation::operator=(LaplacianInterpolation&&) noexcept =
    default;

void LaplacianInterpolation::complete(Points<const double> points, KnownMask known,
                                      Points<const double> previous, Points<double> completed) {
  System& system = *system_;
  check_rows("completed", completed, system.topology.cells.size());
  const Given given(system.topology, points, known, previous);
  Columns solution = given.positions;
  if (std::ranges::count(given.known, 0) > 0) {
    system.factorize(given.known);
    const Columns pull =
        system.energy * given.values;  // the influence of the known vertices on all others
    Columns right_hand_side(system.unknown_block.rows(), 3);
    for (std::size_t v = 0; v < system.unknown_index.size(); ++v) {
      if (system.unknown_index[v] >= 0) {
        right_hand_side.row(system.unknown_index[v]) = -pull.row(static_cast<Eigen::Index>(v));
      }
    }
    const Columns unknown = system.factor.solve(right_hand_side);
    for (std::size_t v = 0; v < system.unknown_index.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      if (system.unknown_index[v] >= 0) {
        solution.row(row) = given.origin.row(row) + unknown.row(system.unknown_index[v]);
      }
    }
  }
  write(solution, completed);
}

}  // namespace dynmesh
