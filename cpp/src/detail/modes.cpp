#include "detail/modes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "detail/rotations.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"

namespace dynmesh {
namespace {

using Matrix = Eigen::MatrixXd;
using Deviations = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>>;
static_assert(sizeof(Vector3<double>) == 4 * sizeof(double));

/// Sums of float are short, so that they are as accurate as their terms. The chunks do not depend
/// on the number of threads, and neither do the sums.
constexpr Index chunk = 256;

/// The deviations of a vertex in all frames, (n_frames, 4); the last column is 0.
Deviations deviations(std::span<const Vector3<double>> shapes, std::size_t n_frames,
                      std::size_t v) {
  return {&shapes[v * n_frames].x, static_cast<Eigen::Index>(n_frames), 4};
}

/// G_lm = sum_i w_i z_li . z_mi of each part.
std::vector<Matrix> products_of_frames(const SurfaceParts& parts,
                                       std::span<const Vector3<double>> shapes,
                                       std::size_t n_frames) {
  const auto n = static_cast<Eigen::Index>(n_frames);
  constexpr Eigen::Index batch = 64;
  struct Batch {
    Matrix columns;
    Eigen::Index filled = 0;
  };
  std::vector<Matrix> products(static_cast<std::size_t>(parts.n_parts), Matrix::Zero(n, n));
  std::vector<Batch> batches(products.size(), {Matrix::Zero(n, 3 * batch)});
  const auto flush = [&](std::size_t part) {
    Batch& full = batches[part];
    if (full.filled == 0) return;  // Eigen would divide by zero
    products[part].selfadjointView<Eigen::Lower>().rankUpdate(full.columns.leftCols(full.filled));
    full.filled = 0;
  };
  for (std::size_t v = 0; v + 1 < parts.offsets.size(); ++v) {
    const Deviations z = deviations(shapes, n_frames, v);
    for (Index e = parts.offsets[v]; e < parts.offsets[v + 1]; ++e) {
      const auto [part, weight] = parts.entries[e];
      Batch& filling = batches[part];
      filling.columns.middleCols(filling.filled, 3) = std::sqrt(weight) * z.leftCols(3);
      filling.filled += 3;
      if (filling.filled == filling.columns.cols()) flush(static_cast<std::size_t>(part));
    }
  }
  for (std::size_t part = 0; part < products.size(); ++part) flush(part);
  return products;
}

/// The leading eigenvectors, (n_frames, up to 16).
Matrix leading_vectors(const Matrix& products, double least) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(products);  // reads the lower triangle
  const auto& values = solver.eigenvalues();                     // ascending
  const Eigen::Index n = values.size();
  Eigen::Index kept = 0;
  while (kept < std::min<Eigen::Index>(n, modes_of_part) && values[n - 1 - kept] > least) ++kept;
  return solver.eigenvectors().rightCols(kept).rowwise().reverse();
}

constexpr double unreached = std::numeric_limits<double>::infinity();

/// Farthest-point sampling. There are fewer seeds if all vertices coincide with one.
std::vector<std::size_t> seeds_of(std::span<const Vector3<double>> frame, Index n_seeds) {
  Vector3<double> mean{};
  for (const auto& x : frame) mean = mean + (1 / static_cast<double>(frame.size())) * x;
  std::vector<double> distance(frame.size());
  std::ranges::transform(frame, distance.begin(),
                         [&](const auto& x) { return squared_norm(x - mean); });
  std::vector<std::size_t> seeds;
  while (std::ssize(seeds) < n_seeds) {
    const auto farthest = std::ranges::max_element(distance);
    if (!(*farthest > 0)) break;
    seeds.push_back(static_cast<std::size_t>(farthest - distance.begin()));
    for (std::size_t v = 0; v < frame.size(); ++v) {
      const double to_seed = squared_norm(frame[v] - frame[seeds.back()]);
      distance[v] = seeds.size() == 1 ? to_seed : std::min(distance[v], to_seed);
    }
  }
  return seeds;
}

/// The lengths of the shortest paths along edges (Dijkstra).
std::vector<double> distances_from(std::size_t seed, const Cells& cells,
                                   std::span<const Vector3<double>> frame) {
  using Reached = std::pair<double, std::size_t>;
  std::vector<double> distance(frame.size(), unreached);
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  distance[seed] = 0;
  next.emplace(0.0, seed);
  while (!next.empty()) {
    const auto [length, v] = next.top();
    next.pop();
    if (length > distance[v]) continue;
    for (const Index n : cells[v]) {
      const double longer = length + std::sqrt(squared_norm(frame[n] - frame[v]));
      if (longer >= distance[n]) continue;
      distance[n] = longer;
      next.emplace(longer, n);
    }
  }
  return distance;
}

/// The median of the second smallest distance of each vertex, where there is one; else 0.
double typical_distance(const std::vector<std::vector<double>>& distances, std::size_t n_vertices) {
  std::vector<double> second;
  for (std::size_t v = 0; v < n_vertices; ++v) {
    double nearest = unreached;
    double next = unreached;
    for (const auto& of_seed : distances) {
      next = std::min(next, std::max(nearest, of_seed[v]));
      nearest = std::min(nearest, of_seed[v]);
    }
    if (next < unreached) second.push_back(next);
  }
  return second.empty() ? 0 : median(second);
}

constexpr int most_fits = 100;
constexpr double settled = 1e-9;  // of the components of a quaternion

/// The rotation that best maps one frame to another as a whole.
Quaternion whole_rotation(std::span<const Vector3<double>> from,
                          std::span<const Vector3<double>> to) {
  const RigidMotion motion = fit_rigid_motion<double>(from, to);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rows(
      motion.rotation.front().data());
  const Eigen::Quaterniond q(Eigen::Matrix3d{rows});
  return {q.w(), q.x(), q.y(), q.z()};
}

double largest_change(std::span<const Quaternion> before, std::span<const Quaternion> after) {
  double largest = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    const Quaternion& a = before[v];
    const Quaternion& b = after[v];
    largest = std::max({largest, std::abs(a.w - b.w), std::abs(a.x - b.x), std::abs(a.y - b.y),
                        std::abs(a.z - b.z)});
  }
  return largest;
}

/// Returns z of all frames: for each vertex, those in all frames, (k, n_frames). Q is fitted to a
/// frame until it no longer changes, from the rotation that fits the whole frame best, since its
/// pose may be far from `first`.
std::vector<Vector3<double>> training_shapes(std::span<const std::vector<Vector3<double>>> training,
                                             const DetailOperator& k, const Cells& cells,
                                             std::span<const Vector3<double>> first,
                                             double mean_edge, Workers& workers) {
  const std::size_t n_vertices = first.size();
  std::vector<Vector3<double>> shapes(n_vertices * training.size());
  std::vector<Vector3<double>> first_shape(n_vertices);
  std::vector<Vector3<double>> x(n_vertices);
  std::vector<Vector3<double>> kx(n_vertices);
  std::vector<Quaternion> before(n_vertices);
  apply_operator(k, first, 1, first_shape, workers);
  Rotations rotations(cells, workers, first, mean_edge);
  for (std::size_t frame = 0; frame < training.size(); ++frame) {
    std::ranges::copy(training[frame], x.begin());
    std::ranges::fill(rotations.quaternions(), whole_rotation(first, x));
    for (int n = 0; n < most_fits; ++n) {
      std::ranges::copy(rotations.quaternions(), before.begin());
      rotations.fit(x);
      if (largest_change(before, rotations.quaternions()) <= settled) break;
    }
    apply_operator(k, x, 1, kx, workers);
    rotations.turn_back(kx, kx);
    for (std::size_t v = 0; v < n_vertices; ++v) {
      shapes[v * training.size() + frame] = kx[v] - first_shape[v];
    }
  }
  return shapes;
}

}  // namespace

SurfaceParts divide_surface(const Cells& cells, std::span<const Vector3<double>> frame,
                            const TrainingConstants& constants) {
  std::vector<std::vector<double>> distances;
  for (const std::size_t seed : seeds_of(frame, constants.local_parts)) {
    distances.push_back(distances_from(seed, cells, frame));
  }
  const double reach = constants.reach * typical_distance(distances, frame.size());
  if (!(reach > 0)) distances.clear();

  SurfaceParts parts;
  parts.n_parts = static_cast<Index>(distances.size()) + 1;
  parts.offsets.assign(frame.size() + 1, 0);
  std::vector<double> weights(distances.size());
  for (std::size_t v = 0; v < frame.size(); ++v) {
    parts.entries.push_back({0, 1.0});
    double sum = 0;
    for (std::size_t c = 0; c < distances.size(); ++c) {
      const double ratio = distances[c][v] / reach;
      weights[c] = std::exp(-ratio * ratio / 2);
      sum += weights[c];
    }
    double kept = 0;
    for (double& weight : weights) {
      weight = sum > 0 && weight >= constants.least_weight * sum ? weight : 0;
      kept += weight;
    }
    for (std::size_t c = 0; c < weights.size(); ++c) {
      if (weights[c] > 0) parts.entries.push_back({static_cast<Index>(c) + 1, weights[c] / kept});
    }
    parts.offsets[v + 1] = static_cast<Index>(parts.entries.size());
  }
  return parts;
}

std::vector<double> weights_of(const SurfaceParts& parts) {
  std::vector<double> weights(static_cast<std::size_t>(parts.n_parts));
  for (const auto& [part, weight] : parts.entries) weights[part] += weight;
  return weights;
}

Modes::Modes(const SurfaceParts& parts, double mean_edge)
    : n_coefficients_(static_cast<std::size_t>(modes_of_part * parts.n_parts)),
      offsets_(parts.offsets),
      unit_(std::exp2(std::ilogb(mean_edge))),
      values_(3 * modes_of_part * parts.entries.size()),
      coefficients_(n_coefficients_) {
  parts_.reserve(parts.entries.size());
  for (const auto& entry : parts.entries) parts_.push_back(entry.part);
  const std::size_t k = offsets_.size() - 1;
  partial_sums_.resize((k + chunk - 1) / chunk * 2 * n_coefficients_);
}

Modes::Modes(const SurfaceParts& parts, std::span<const Vector3<double>> shapes,
             std::size_t n_frames, const TrainingConstants& constants, const ModeScale& scale)
    : Modes(parts, scale.mean_edge) {
  std::vector<Matrix> leading;
  const std::vector<double> weights = weights_of(parts);
  for (const Matrix& products : products_of_frames(parts, shapes, n_frames)) {
    const double least = scale.least_eigenvalue(n_frames, weights[leading.size()], constants);
    leading.push_back(leading_vectors(products, least));
    size_ += static_cast<std::size_t>(leading.back().cols());
  }
  n_frames_ = n_frames;
  const std::size_t k = offsets_.size() - 1;
  const double share = 1 / std::sqrt(static_cast<double>(n_frames)) / unit_;
  for (std::size_t v = 0; v < k; ++v) {
    const Deviations z = deviations(shapes, n_frames, v);
    for (Index e = offsets_[v]; e < offsets_[v + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      const auto [part, weight] = parts.entries[entry];
      // B_j(i) = w_i sum_l U_lj z_li / sqrt(n)
      const Matrix modes = weight * share * (leading[part].transpose() * z);
      for (Eigen::Index j = 0; j < modes.rows(); ++j) {
        for (Eigen::Index c = 0; c < 3; ++c) {
          values_[(3 * entry + static_cast<std::size_t>(c)) * modes_of_part +
                  static_cast<std::size_t>(j)] = static_cast<float>(modes(j, c));
        }
      }
    }
  }
}

void Modes::form(const ShapeData& shapes, const CombinationData& combinations, Index first,
                 Index last, Workers& workers) {
  workers.for_each((last - first + chunk - 1) / chunk, [&](Index i) {
    const Index begin = first + i * chunk;
    const Index end = std::min(last, begin + chunk);
    best_kernels().modes.form(data(), shapes, combinations, values_.data(), begin, end);
    const auto value = [&](Index v) {
      return values_.begin() + std::ptrdiff_t{3} * modes_of_part * offsets_[v];
    };
    std::transform(value(begin), value(end), value(begin),
                   [&](float x) { return static_cast<float>(static_cast<double>(x) / unit_); });
  });
}

void Modes::combine(std::span<const double> coefficients, std::span<Vector3<double>> combined,
                    Workers& workers) {
  std::ranges::transform(coefficients, coefficients_.begin(),
                         [](double a) { return static_cast<float>(a); });
  const auto k = static_cast<Index>(combined.size());
  workers.for_each((k + chunk - 1) / chunk, [&](Index i) {
    const Index first = i * chunk;
    const Index last = std::min(k, first + chunk);
    best_kernels().modes.combine(data(), coefficients_.data(), combined.data(), first, last);
    for (Index v = first; v < last; ++v) {
      auto& x = combined[v];
      x = unit_ * x;
    }
  });
}

/// Computes `n_sums` partial sums of each chunk of vertices.
template <class Kernel>
void Modes::add_up(std::size_t n_sums, Workers& workers, const Kernel& kernel) {
  const auto k = static_cast<Index>(offsets_.size() - 1);
  workers.for_each((k + chunk - 1) / chunk, [&](Index i) {
    float* sums = &partial_sums_[static_cast<std::size_t>(i) * n_sums];
    std::fill_n(sums, n_sums, 0.0F);
    kernel(sums, i * chunk, std::min(k, (i + 1) * chunk));
  });
}

/// Adds up the partial sums from the `first` of `n_sums` on, in this unit.
void Modes::reduce(std::size_t first, std::size_t n_sums, double unit,
                   std::span<double> sums) const {
  std::ranges::fill(sums, 0.0);
  const std::size_t n_chunks = (offsets_.size() - 1 + chunk - 1) / chunk;
  for (std::size_t i = 0; i < n_chunks; ++i) {
    for (std::size_t j = 0; j < sums.size(); ++j) {
      sums[j] += static_cast<double>(partial_sums_[i * n_sums + first + j]);
    }
  }
  for (double& sum : sums) sum *= unit;
}

void Modes::project(Field field, std::span<double> projected, Workers& workers) {
  const std::size_t n = n_coefficients_;
  add_up(n, workers, [&](float* sums, Index first, Index last) {
    best_kernels().modes.project(data(), field.data(), sums, first, last);
  });
  reduce(0, n, unit_, projected);
}

void Modes::project_and_weigh(Field field, std::span<const double> weights,
                              std::span<double> projected, std::span<double> squares,
                              Workers& workers) {
  const std::size_t n = n_coefficients_;
  add_up(2 * n, workers, [&](float* sums, Index first, Index last) {
    best_kernels().modes.project_and_weigh(data(), field.data(), weights.data(), sums, sums + n,
                                           first, last);
  });
  reduce(0, 2 * n, unit_, projected);
  reduce(n, 2 * n, unit_ * unit_, squares);
}

Modes training_modes(std::span<const std::vector<Vector3<double>>> training,
                     const DetailOperator& k, const Cells& cells,
                     std::span<const Vector3<double>> first, double mean_edge,
                     const Rounding& rounding, const DetailConstants& constants, Workers& workers) {
  if (training.empty()) return {};
  const auto shapes = training_shapes(training, k, cells, first, mean_edge, workers);
  ModeScale scale = {mean_edge, 0};
  for (const auto& frame : training) {
    scale.rounding = std::max(scale.rounding, rounding.mean_square(frame));
  }
  return Modes(divide_surface(cells, first, constants.training), shapes, training.size(),
               constants.training, scale);
}

}  // namespace dynmesh
