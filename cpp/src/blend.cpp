#include "blend.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dynmesh {
namespace {

/// Takes a thousandth off b: the shape of the last frame is the nearer guess. A thousandth of a
/// shape that is no shape at all would be too much, so less where the two are further apart than a
/// mean edge.
constexpr double caution = 1.001;

/// The sum of |r1|^2 below which r1 is rounding errors, in |Q (m_first - m_prev)|^2; likewise r2.
constexpr double rounding = 1e-18;

/// And a twentieth off c, so that a part that nobody sees does not change for ever, and b comes
/// first where both say the same.
constexpr double caution_of_change = 1.05;

/// Of the residual that b leaves, the share that c must explain to be believed at all; twice that,
/// and it is believed.
constexpr double least_explained = 0.1;

/// How often residuals are averaged with the neighbours', which is how far a local blend looks.
constexpr int averagings = 10;

/// The pull to the global blend, in mean |r1_i|^2.
constexpr double pull = 0.3;

constexpr double least_blend = -0.5;
constexpr double largest_blend = 1.5;

}  // namespace

void ResidualSums::drop_rounding_errors(double shape, double change) {
  if (s11 <= rounding * shape) s01 = s11 = s12 = 0;
  if (s22 <= rounding * change) s02 = s12 = s22 = 0;
}

Blend global_blend(const ResidualSums& sums, double mean_edges) {
  const auto finite = [](double value) { return std::isfinite(value) ? value : 0; };
  const double s11 = std::min(caution * sums.s11, sums.s11 + (caution - 1) * mean_edges);
  // Of r0 and of r2, what b cannot explain.
  const double b_of_r2 = finite(sums.s12 / s11);
  const double h = -(sums.s02 - b_of_r2 * sums.s01);
  const double q = caution_of_change * sums.s22 - b_of_r2 * sums.s12;
  const double left = sums.s00 - finite(sums.s01 / s11) * sums.s01;
  const double explained = finite(h / q * h / left);
  const double belief = std::clamp(explained / least_explained - 1, 0.0, 1.0);
  const double c = belief * std::clamp(finite(h / q), 0.0, 1.0);
  return {finite(-(sums.s01 + c * sums.s12) / s11), c};
}

LocalBlend::LocalBlend(const Cells& cells)
    : cells_(cells),
      shares_(cells.size()),
      fits_(cells.size()),
      averaged_(cells.size()),
      blend_(cells.size()) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t n = cells[static_cast<Index>(i)].size();
    shares_[i] = n == 0 ? 0 : 1 / static_cast<double>(n);
  }
}

std::span<const double> LocalBlend::find(std::span<const BlendFit> fits, double global) {
  double sum = 0;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    fits_[i] = fits[i];
    sum += fits[i].q;
  }
  const double eta = pull * sum / static_cast<double>(fits.size());
  for (int n = 0; n < averagings; ++n) {
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const auto cell = cells_[static_cast<Index>(i)];
      BlendFit mean;
      for (const Index j : cell) {
        mean.h += fits_[static_cast<std::size_t>(j)].h;
        mean.q += fits_[static_cast<std::size_t>(j)].q;
      }
      averaged_[i] = {shares_[i] * mean.h, shares_[i] * mean.q};
    }
    std::swap(fits_, averaged_);
  }
  for (std::size_t i = 0; i < fits_.size(); ++i) {
    const double blend = (fits_[i].h + eta * global) / (fits_[i].q + eta);
    blend_[i] = std::clamp(std::isfinite(blend) ? blend : global, least_blend, largest_blend);
  }
  return blend_;
}

}  // namespace dynmesh
