#include "blend.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dynmesh {
namespace {

/// Takes a thousandth off b, so that it stays 0 where the anchors say nothing.
constexpr double caution = 1.001;

/// The sum of |r1|^2 below which r1 is rounding errors, in |Q (m_first - m_prev)|^2.
constexpr double rounding = 1e-18;

/// How often residuals are averaged with the neighbours', which is how far a local blend looks.
constexpr int averagings = 10;

/// The pull to the global blend, in mean |r1_i|^2.
constexpr double pull = 0.3;

constexpr double least_blend = -0.5;
constexpr double largest_blend = 1.5;

}  // namespace

void drop_rounding_errors(std::span<BlendFit> fits, double change) {
  double sum = 0;
  for (const BlendFit& fit : fits) sum += fit.q;
  if (sum <= rounding * change) std::ranges::fill(fits, BlendFit{});
}

double global_blend(std::span<const BlendFit> fits) {
  BlendFit sum;
  for (const BlendFit& fit : fits) {
    sum.h += fit.h;
    sum.q += fit.q;
  }
  const double blend = sum.h / (caution * sum.q);
  return std::isfinite(blend) ? blend : 0;
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
