#include "detail/first_order_shares.hpp"

#include <algorithm>
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
      residuals_(sizes_.size() + 1),
      drawn_(sizes_.size()),
      newest_(sizes_.size()),
      of_groups_(sizes_.size() + 1),
      newest_of_groups_(sizes_.size() + 1) {
  for (const Index c : topology.component) ++sizes_[at(c)];
  memory_.components.resize(sizes_.size());
}

void FirstOrderShares::reset() {
  std::ranges::fill(memory_.components, Component{});
  memory_.frame = 0;
  memory_.next = 1;
  memory_.gap = 0;
}

std::size_t FirstOrderShares::group_of(std::size_t component) const {
  return memory_.components[component].gains.count >= constants_.least_count ? component + 1 : 0;
}

double FirstOrderShares::of_vertex(std::size_t v) const {
  return memory_.components[component_of(v)].share;
}

double FirstOrderShares::least() const {
  return std::ranges::min(memory_.components, {}, &Component::share).share;
}

double FirstOrderShares::largest() const {
  return std::ranges::max(memory_.components, {}, &Component::share).share;
}

bool FirstOrderShares::is_due(Field kx, Field shape, double rounding,
                              const Generations& generations) {
  const auto generation = generations.of_vertices();
  std::ranges::fill(residuals_, Residuals{});
  for (std::size_t v = 0; v < kx.size(); ++v) {
    if (generation[v] == Generations::disconnected) continue;
    const std::size_t component = component_of(v);
    Residuals& group = residuals_[group_of(component)];
    group.energy += squared_norm(kx[v] - shape[v]);
    group.rows += 1;
    group.anchors += generation[v] == Generations::anchor ? 1 : 0;
    group.last = std::max(group.last, memory_.components[component].residual);
  }
  const double since_last = memory_.frame - (memory_.next - memory_.gap);
  const bool may_grow = largest() > 0 || since_last >= constants_.least_gap_without;
  bool is_due = memory_.frame >= memory_.next;
  for (Residuals& group : residuals_) {
    if (group.energy > group.rows * rounding) group.now = std::sqrt(group.energy / group.anchors);
    const bool has_grown = may_grow && group.now > constants_.growth * group.last;
    if (has_grown && group.anchors >= constants_.least_count) is_due = true;
  }
  return is_due;
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
  for (std::size_t c = 0; c < drawn_.size(); ++c) {
    if (drawn_[c].anchors > 0) memory_.components[c].residual = residuals_[group_of(c)].now;
  }
  const std::uint64_t of_frame = mixed(static_cast<std::uint64_t>(memory_.frame));
  for (std::size_t v = 0; v < generation.size(); ++v) {
    Drawn& drawn = drawn_[component_of(v)];
    const double random = 0x1p-64 * static_cast<double>(mixed(of_frame + v));
    const bool is_anchor = generation[v] == Generations::anchor;
    is_left_out[v] = is_anchor && random < probability_of(drawn) ? 1 : 0;
    drawn.left_out += is_left_out[v];
  }
  int sum = 0;
  for (std::size_t v = 0; v < generation.size(); ++v) {
    const Drawn& drawn = drawn_[component_of(v)];
    if (drawn.anchors - drawn.left_out < constants_.least_kept) is_left_out[v] = 0;
    sum += is_left_out[v];
  }
  return sum >= constants_.fewest_left_out;
}

int FirstOrderShares::rings_around(std::size_t v) const {
  const std::size_t c = component_of(v);
  const double distance = std::sqrt(sizes_[c] / drawn_[c].anchors);
  return std::max(constants_.least_rings, static_cast<int>(std::ceil(constants_.rings * distance)));
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
  if (!is_finite) return postpone();

  std::ranges::fill(of_groups_, Gains{});
  std::ranges::fill(newest_of_groups_, Gains{});
  auto& components = memory_.components;
  for (std::size_t c = 0; c < components.size(); ++c) {
    // A component of which nothing was left out keeps what it has shown.
    if (newest_[c].count > 0) components[c].gains.add(newest_[c], constants_.kept);
    of_groups_[group_of(c)].add(components[c].gains);
    newest_of_groups_[group_of(c)].add(newest_[c]);
  }
  double moved = 0;
  for (std::size_t c = 0; c < components.size(); ++c) {
    const std::size_t group = group_of(c);
    if (newest_of_groups_[group].count == 0) continue;
    const double share = best_share(of_groups_[group], newest_of_groups_[group]);
    moved += sizes_[c] * std::abs(share - components[c].share);
    components[c].share = share;
  }
  const bool has_moved = moved > constants_.moved * static_cast<double>(is_left_out.size());
  const double longer = largest() > 0
                            ? std::min<double>(2 * memory_.gap, constants_.largest_gap)
                            : std::min<double>(4 * memory_.gap, constants_.largest_gap_without);
  memory_.gap = memory_.gap == 0 || has_moved ? 1 : longer;
  memory_.next = memory_.frame + memory_.gap;
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

std::size_t FirstOrderShares::memory_size() const {
  return memory_.components.size() * sizeof(Component) + 3 * sizeof(double);
}

void FirstOrderShares::write_memory(Writer& writer) const {
  for (const auto& [gains, share, residual] : memory_.components) {
    writer.write(std::span<const double>(gains.sums));
    writer.write(std::span<const double>(gains.squares));
    for (const double number : {gains.size, gains.count, share, residual}) writer.write(number);
  }
  for (const double number : {memory_.frame, memory_.next, memory_.gap}) writer.write(number);
}

FirstOrderShares::Memory FirstOrderShares::read_memory(Reader& reader) const {
  Memory memory;
  memory.components.resize(memory_.components.size());
  for (auto& [gains, share, residual] : memory.components) {
    reader.read(std::span<double>(gains.sums));
    reader.read(std::span<double>(gains.squares));
    for (double* number : {&gains.size, &gains.count, &share, &residual}) {
      *number = reader.read<double>();
    }
  }
  for (double* number : {&memory.frame, &memory.next, &memory.gap}) {
    *number = reader.read<double>();
  }
  return memory;
}

bool FirstOrderShares::accepts(const Memory& memory) {
  const auto is_sum = [](double x) { return std::isfinite(x); };
  const auto is_size = [](double x) { return x >= 0 && std::isfinite(x); };
  const auto is_number = [](double x) { return x >= 0 && x == std::floor(x) && x < 9e15; };
  return std::ranges::all_of(memory.components,
                             [&](const Component& component) {
                               const auto& [gains, share, residual] = component;
                               return std::ranges::all_of(gains.sums, is_sum) &&
                                      std::ranges::all_of(gains.squares, is_size) &&
                                      is_size(gains.size) && is_size(gains.count) &&
                                      is_size(share) && share <= 1 && is_size(residual);
                             }) &&
         is_number(memory.frame) && is_number(memory.next) && is_number(memory.gap);
}

}  // namespace dynmesh
