#include "detail/modes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

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
      const auto [part, weight] = parts.entries[static_cast<std::size_t>(e)];
      Batch& filling = batches[static_cast<std::size_t>(part)];
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

}  // namespace

std::vector<double> weights_of(const SurfaceParts& parts) {
  std::vector<double> weights(static_cast<std::size_t>(parts.n_parts));
  for (const auto& [part, weight] : parts.entries)
    weights[static_cast<std::size_t>(part)] += weight;
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
      const Matrix modes =
          weight * share * (leading[static_cast<std::size_t>(part)].transpose() * z);
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
      return values_.begin() +
             std::ptrdiff_t{3} * modes_of_part * offsets_[static_cast<std::size_t>(v)];
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
      auto& x = combined[static_cast<std::size_t>(v)];
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

}  // namespace dynmesh
