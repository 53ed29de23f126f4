#include "detail/first_order_shares.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "detail/random_signs.hpp"
#include "support/geometry.hpp"
#include "support/indices.hpp"

namespace dynmesh {

void FirstOrderShares::Gains::add(const Gains& other, double kept) {
  for (std::size_t q = 0; q < n_shares; ++q) {
    sums[q] = kept * sums[q] + other.sums[q];
    squares[q] = kept * kept * squares[q] + other.squares[q];
  }
  size = kept * size + other.size;
  count = kept * count + other.count;
}

FirstOrderShares::FirstOrderShares(const Topology& topology, const FirstOrderConstants& constants)
    : topology_(topology),
      constants_(constants),
      sizes_(topology.report.components),
      drawn_(sizes_.size()),
      newest_(sizes_.size()),
      of_groups_(sizes_.size() + 1),
      newest_of_groups_(sizes_.size() + 1) {
  for (const Index c : topology.component) ++sizes_[at(c)];
  components_.resize(sizes_.size());
}

void FirstOrderShares::reset() {
  std::ranges::fill(components_, Component{});
  frame_ = 0;
}

std::size_t FirstOrderShares::group_of(std::size_t component) const {
  return components_[component].gains.count >= constants_.least_count ? component + 1 : 0;
}

double FirstOrderShares::of_vertex(std::size_t v) const {
  return components_[component_of(v)].share;
}

double FirstOrderShares::largest() const {
  return std::ranges::max(components_, {}, &Component::share).share;
}

bool FirstOrderShares::is_due() const {
  const auto gap = static_cast<std::uint64_t>(constants_.gap);
  return frame_ < gap ? std::has_single_bit(frame_) : frame_ % gap == 0;
}

double FirstOrderShares::probability_of(const Drawn& component) const {
  return std::min(constants_.left_out / component.anchors, constants_.largest_left_out);
}

bool FirstOrderShares::draw(const Generations& generations, std::span<std::uint8_t> is_left_out) {
  const auto generation = generations.of_vertices();
  std::ranges::fill(drawn_, Drawn{});
  for (std::size_t v = 0; v < generation.size(); ++v) {
    if (generation[v] == Generations::anchor) ++drawn_[component_of(v)].anchors;
  }
  const std::uint64_t of_frame = mixed(frame_);
  for (std::size_t v = 0; v < generation.size(); ++v) {
    Drawn& drawn = drawn_[component_of(v)];
    const double random = 0x1p-64 * static_cast<double>(mixed(of_frame + v));
    const bool is_anchor = generation[v] == Generations::anchor;
    is_left_out[v] = is_anchor && random < probability_of(drawn) ? 1 : 0;
    drawn.left_out += is_left_out[v];
  }
  bool is_any = false;
  for (std::size_t v = 0; v < generation.size(); ++v) {
    const Drawn& drawn = drawn_[component_of(v)];
    if (drawn.anchors - drawn.left_out < constants_.least_kept) is_left_out[v] = 0;
    is_any |= is_left_out[v] != 0;
  }
  return is_any;
}

int FirstOrderShares::rings_around(std::size_t v) const {
  const std::size_t c = component_of(v);
  const double distance = std::sqrt(sizes_[c] / drawn_[c].anchors);
  return static_cast<int>(std::ceil(constants_.rings * distance));
}

void FirstOrderShares::learn(Field detail, Field first_order, Field observed,
                             std::span<const std::uint8_t> is_left_out, double rounding) {
  const auto length = [&](const Vector3<double>& x) {
    const double found = std::sqrt(squared_norm(x));
    return found > rounding ? found : 0;
  };
  bool is_finite = true;
  std::ranges::fill(newest_, Gains{});
  for (std::size_t v = 0; v < is_left_out.size(); ++v) {
    if (is_left_out[v] == 0) continue;
    const Vector3<double> of_detail = detail[v] - observed[v];
    const Vector3<double> of_first_order = first_order[v] - observed[v];
    Gains& gains = newest_[component_of(v)];
    const double size = length(of_detail);
    gains.size += size;
    ++gains.count;
    for (std::size_t q = 0; q < n_shares; ++q) {
      const double share = static_cast<double>(q + 1) / n_shares;
      const double gain = size - length((1 - share) * of_detail + share * of_first_order);
      gains.sums[q] += gain;
      gains.squares[q] += gain * gain;
      is_finite = is_finite && std::isfinite(gains.squares[q]);
    }
  }
  if (!is_finite) return;

  std::ranges::fill(of_groups_, Gains{});
  std::ranges::fill(newest_of_groups_, Gains{});
  for (std::size_t c = 0; c < components_.size(); ++c) {
    // A component of which nothing was left out keeps what it has shown.
    if (newest_[c].count > 0) components_[c].gains.add(newest_[c], constants_.kept);
    of_groups_[group_of(c)].add(components_[c].gains);
    newest_of_groups_[group_of(c)].add(newest_[c]);
  }
  for (std::size_t c = 0; c < components_.size(); ++c) {
    const std::size_t group = group_of(c);
    if (newest_of_groups_[group].count == 0) continue;
    components_[c].share = best_share(of_groups_[group], newest_of_groups_[group]);
  }
}

/// The share with the largest sum of gains, reduced by what may be chance and by a handicap. One
/// that was clearly worse in the newest test is not taken.
double FirstOrderShares::best_share(const Gains& gains, const Gains& newest) const {
  double best = 0;
  double share = 0;
  for (std::size_t q = 0; q < n_shares && gains.count >= constants_.least_count; ++q) {
    const double candidate = static_cast<double>(q + 1) / n_shares;
    const bool is_worse = newest.sums[q] + std::sqrt(newest.squares[q]) < 0;
    if (is_worse || candidate < constants_.least_share) continue;
    const double found = gains.sums[q] - constants_.deviations * std::sqrt(gains.squares[q]) -
                         constants_.handicap * gains.size;
    if (found <= best) continue;
    best = found;
    share = candidate;
  }
  return share;
}

}  // namespace dynmesh
