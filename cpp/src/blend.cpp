#include "blend.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dynmesh {
namespace {

/// Takes a thousandth off b, so that it stays 0 where the anchors say nothing.
constexpr double caution = 1.001;

/// How often residuals are averaged with the neighbours', which is how far a local blend looks.
constexpr int averagings = 10;

/// The pull to the global blend, in mean |r1_i|^2.
constexpr double pull = 0.3;

constexpr double least_blend = -0.5;
constexpr double largest_blend = 1.5;

double dot(const Vector3<double>& a, const Vector3<double>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

}  // namespace

double global_blend(Residuals residuals) {
  double h = 0;
  double q = 0;
  for (std::size_t i = 0; i < residuals.size(); i += 2) {
    h -= dot(residuals[i + 1], residuals[i]);
    q += dot(residuals[i + 1], residuals[i + 1]);
  }
  const double blend = h / (caution * q);
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

std::span<const double> LocalBlend::find(Residuals residuals, double global) {
  double sum = 0;
  for (std::size_t i = 0; i < fits_.size(); ++i) {
    const Vector3<double>& r1 = residuals[2 * i + 1];
    fits_[i] = {-dot(r1, residuals[2 * i]), dot(r1, r1)};
    sum += fits_[i].q;
  }
  const double eta = pull * sum / static_cast<double>(fits_.size());
  for (int n = 0; n < averagings; ++n) {
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const auto cell = cells_[static_cast<Index>(i)];
      Fit mean{};
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
