#include "detail/error_bars.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
/// Members are numbers around 1 that grow slowly; only a made-up state has larger ones.
constexpr double largest_member = 1e50;
/// The numbers of frames are stored as double.
constexpr double largest_frame = 9e15;

/// The output function of SplitMix64 (Steele, Lea and Flood 2014): a different, seemingly random
/// number for every x.
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Random signs, which have variance 1 as normal numbers have, and cost a bit each.
class Signs {
 public:
  explicit Signs(std::uint64_t bits) : bits_(bits) {}
  Vector3<double> next() {
    const double x = one(), y = one(), z = one();
    return {x, y, z};
  }

 private:
  /// Sets the sign bit of 1, since a branch would be taken at random.
  double one() {
    constexpr std::uint64_t sign_bit = std::uint64_t{1} << 63;
    const std::uint64_t sign = bits_ & sign_bit;
    bits_ <<= 1;
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(1.0) | sign);
  }
  std::uint64_t bits_;
};

DetailOperator smoother_of(const Cells& cells) {
  DetailOperator smoother;
  const std::size_t n_values = cells.size() + cells.neighbours.size();
  smoother.offsets.reserve(cells.size() + 1);
  smoother.columns.reserve(n_values);
  smoother.values.reserve(n_values);
  smoother.scale.assign(cells.size(), 1.0);
  smoother.offsets.push_back(0);
  for (Index v = 0; static_cast<std::size_t>(v) < cells.size(); ++v) {
    const auto cell = cells[v];
    smoother.columns.push_back(v);
    smoother.values.push_back(cell.empty() ? 1 : 0.5);
    for (const Index n : cell) {
      smoother.columns.push_back(n);
      smoother.values.push_back(0.5 / static_cast<double>(cell.size()));
    }
    smoother.offsets.push_back(static_cast<Index>(smoother.columns.size()));
  }
  return smoother;
}

}  // namespace

ErrorBars::ErrorBars(const Cells& cells, Workers& workers, const DetailConstants& constants,
                     bool are_wanted, bool are_noisy)
    : cells_(cells), workers_(workers), constants_(constants) {
  if (!are_wanted) return;
  const std::size_t k = cells.size();
  smoother_ = smoother_of(cells);
  for (Members* of : {&errors_, &errors_of_change_, &changes_, &targets_, &next_}) {
    of->resize(members * k);
  }
  noise_.resize(are_noisy ? members * k : 0);
  for (auto* of : {&residuals_, &residual_, &turned_, &of_frame_, &averaged_of_frame_}) {
    of->resize(k);
  }
  energies_.resize(k);
  for (auto* of : {&sizes_, &standard_errors_, &variances_, &averaged_}) of->resize(k);
  are_seen_.resize(k);
}

void ErrorBars::reset() {
  if (!exist()) return;
  for (Members* of : {&errors_, &errors_of_change_, &changes_}) {
    std::ranges::fill(*of, Vector3<double>{});
  }
  std::ranges::fill(residuals_, Vector3<double>{});
  std::ranges::fill(are_seen_, std::uint8_t{0});
  std::ranges::fill(energies_, Energy{});
  std::ranges::fill(sizes_, 1.0);
  std::ranges::fill(standard_errors_, 0.0);
  energy_ = {};
  product_ = square_ = 0;
  frame_ = 0;
}

template <class Work>
void ErrorBars::for_each_vertex(const Work& work) {
  workers_.for_each_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    for (Index v = first; v < last; ++v) work(static_cast<std::size_t>(v));
  });
}

/// Without any evidence, changes are taken to persist for a while, since motion does.
double ErrorBars::persistence() const {
  const UncertaintyConstants& constants = constants_.uncertainty;
  if (!(square_ > 0)) return constants.first_persistence;
  return std::clamp(product_ / square_, 0.0, constants.largest_persistence);
}

/// Continues the changes: smooth over the mesh, and partly those of the frame before.
void ErrorBars::draw_changes() {
  const std::uint64_t of_frame = mixed(frame_);
  for_each_vertex([&](std::size_t v) {
    Signs signs(mixed(of_frame + v));
    for (std::size_t i = members * v; i < members * (v + 1); ++i) targets_[i] = signs.next();
  });
  for (int n = 0; n < constants_.uncertainty.smoothings; ++n) {
    apply_operator(smoother_, targets_, static_cast<int>(members), next_, workers_);
    std::swap(targets_, next_);
  }
  const double kept = frame_ == 0 ? 0 : persistence();
  const double fresh = std::sqrt(1 - kept * kept);
  for_each_vertex([&](std::size_t v) {
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      changes_[i] = kept * changes_[i] + fresh * targets_[i];
    }
  });
  ++frame_;
}

/// T = e + c e_u + eta, the errors of the shape that the frame was to have.
void ErrorBars::set_targets(double c) {
  for_each_vertex([&](std::size_t v) {
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      targets_[i] = errors_[i] + c * errors_of_change_[i] + sizes_[v] * changes_[i];
    }
  });
}

/// Makes up the noise of the anchors. lambda, their weight, is the squared ratio of the errors of
/// the shape and of the anchors.
void ErrorBars::set_noise(const Anchors& anchors) {
  double sum = 0;
  for (const Vector3<double>& target : targets_) sum += squared_norm(target);
  const double size = std::sqrt(sum / static_cast<double>(3 * targets_.size()));
  const std::uint64_t of_frame = ~mixed(frame_);  // other bits than those of the changes
  for_each_vertex([&](std::size_t v) {
    Signs signs(mixed(of_frame + v));
    const double weight = anchors.weights[v];
    const double deviation = weight > 0 ? size / std::sqrt(weight) : 0;
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      noise_[i] = deviation * signs.next();
    }
  });
}

/// Compares the residuals of the frame with those of the members, at each vertex and in sum.
ErrorBars::Energy ErrorBars::compare(const CompletedShape& frame, Field steps,
                                     const Anchors& anchors) {
  for_each_vertex([&](std::size_t v) {
    Energy energy;
    if (anchors.counts[v] != 0) {
      energy.found = squared_norm(frame.kx[v] - frame.shape[v]);
      if (anchors.are_noisy()) {
        const auto off = anchors.observable(v, frame.x[v] - anchors.observed[v]);
        energy.found += anchors.weights[v] * squared_norm(off);
      }
      for (std::size_t i = members * v; i < members * (v + 1); ++i) {
        energy.expected += squared_norm(next_[i] - targets_[i]) / members;
        if (anchors.are_noisy()) {
          const auto off = anchors.observable(v, steps[i] - noise_[i]);
          energy.expected += anchors.weights[v] * squared_norm(off) / members;
        }
      }
    }
    of_frame_[v] = {energy.found, energy.expected, 0};
  });
  Energy sum;
  for (const Vector3<double>& energy : of_frame_) sum.add({energy.x, energy.y}, 1);
  return sum;
}

/// Finds out where the shape changes more than elsewhere: the energies around each vertex.
void ErrorBars::learn_sizes() {
  const UncertaintyConstants& constants = constants_.uncertainty;
  for_each_vertex([&](std::size_t v) { of_frame_[v].y /= sizes_[v] * sizes_[v]; });
  for (int n = 0; n < constants.averagings; ++n) {
    apply_operator(smoother_, of_frame_, 1, averaged_of_frame_, workers_);
    std::swap(of_frame_, averaged_of_frame_);
  }
  for_each_vertex([&](std::size_t v) {
    energies_[v].add({of_frame_[v].x, of_frame_[v].y}, constants.kept);
  });
  set_sizes();
}

/// Sets the sizes to the ratio of the energies around each vertex to that of all, and closer to 1
/// where there is little energy to tell.
void ErrorBars::set_sizes() {
  const UncertaintyConstants& constants = constants_.uncertainty;
  Energy mean;
  for (const Energy& energy : energies_) mean.add(energy, 1);
  const auto n = static_cast<double>(energies_.size());
  const double ratio = mean.found / mean.expected;
  const double prior = constants.pull * mean.found / n;
  for_each_vertex([&](std::size_t v) {
    const double size =
        std::sqrt((energies_[v].found + prior) / (ratio * energies_[v].expected + prior));
    sizes_[v] =
        std::isfinite(size) ? std::clamp(size, constants.least_size, constants.largest_size) : 1;
  });
}

/// Finds out how much of a change persists, where both this frame and the last one show it: all of
/// the cell is known, and the residual is the change.
void ErrorBars::learn_persistence(const CompletedShape& frame, const Generations& generations,
                                  const Rotations& rotations) {
  const auto generation = generations.of_vertices();
  for_each_vertex([&](std::size_t v) { residual_[v] = frame.kx[v] - frame.shape[v]; });
  rotations.turn_back(residual_, turned_);
  double product = 0;
  double square = 0;
  for (std::size_t v = 0; v < turned_.size(); ++v) {
    const bool is_seen = generation[v] == Generations::anchor &&
                         std::ranges::all_of(cells_[static_cast<Index>(v)], [&](Index n) {
                           return generation[static_cast<std::size_t>(n)] == Generations::anchor;
                         });
    if (is_seen && are_seen_[v] != 0) {
      product += dot(turned_[v], residuals_[v]);
      square += (squared_norm(turned_[v]) + squared_norm(residuals_[v])) / 2;
    }
    are_seen_[v] = is_seen ? 1 : 0;
  }
  std::swap(residuals_, turned_);
  const double kept = constants_.uncertainty.kept;
  if (!std::isfinite(product) || !std::isfinite(square)) return;
  product_ = kept * product_ + product;
  square_ = kept * square_ + square;
}

/// The next memory is what the members look like after the frame: K D where an anchor ties them, T
/// where no anchor does. `next_` holds K D.
void ErrorBars::advance(const Generations& generations) {
  const auto generation = generations.of_vertices();
  const double newest = constants_.newest;
  for_each_vertex([&](std::size_t v) {
    const bool is_unseen = generation[v] == Generations::unseen;
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      const Vector3<double> error = is_unseen ? targets_[i] : next_[i];
      errors_of_change_[i] = (1 - newest) * errors_of_change_[i] + newest * (error - errors_[i]);
      errors_[i] = error;
    }
  });
}

void ErrorBars::find_standard_errors(Field steps, double scale, const Generations& generations) {
  const auto generation = generations.of_vertices();
  for_each_vertex([&](std::size_t v) {
    double sum = 0;
    for (std::size_t i = members * v; i < members * (v + 1); ++i) sum += squared_norm(steps[i]);
    variances_[v] = sum / (3 * members);
  });
  for (int n = 0; n < constants_.uncertainty.variance_averagings; ++n) {
    for_each_vertex([&](std::size_t v) {
      averaged_[v] = variances_[v];
      if (generation[v] <= 0) return;
      double count = 1;
      for (const Index j : cells_[static_cast<Index>(v)]) {
        const auto other = static_cast<std::size_t>(j);
        if (generation[other] <= 0) continue;
        averaged_[v] += variances_[other];
        ++count;
      }
      averaged_[v] /= count;
    });
    std::swap(variances_, averaged_);
  }
  for_each_vertex([&](std::size_t v) {
    const double found = std::sqrt(scale * variances_[v]);
    const bool is_fixed = generation[v] == Generations::anchor && variances_[v] == 0;
    standard_errors_[v] = generation[v] == Generations::unseen ? infinite
                          : is_fixed                           ? 0
                          : std::isfinite(found)               ? found
                                                               : infinite;
  });
}

void ErrorBars::update(const CompletedShape& frame, double c, const Anchors& anchors,
                       const Generations& generations, ShapeSystem& system,
                       const Rotations& rotations) {
  const UncertaintyConstants& constants = constants_.uncertainty;
  draw_changes();
  set_targets(c);
  if (anchors.are_noisy()) set_noise(anchors);
  const Field steps = system.solve<members, members>(
      [&](std::size_t v, std::size_t f) { return targets_[members * v + f]; },
      [&](std::size_t v, std::size_t f) { return noise_[members * v + f]; }, anchors);
  system.apply(steps, static_cast<int>(members), next_);

  const Energy energy = compare(frame, steps, anchors);
  if (!(energy.expected < largest_member)) {  // nothing that was made up makes sense any more
    reset();
    return pass(generations);
  }
  double scale = 0;
  if (std::isfinite(energy.found)) {
    energy_.add(energy, constants.kept);
    // A motion that has just begun shows in this frame alone; one that has just ended has left its
    // errors behind.
    for (const Energy& seen : {energy, energy_}) {
      if (seen.expected > 0) scale = std::max(scale, seen.found / seen.expected);
    }
    learn_sizes();
  } else {
    scale = infinite;
  }
  learn_persistence(frame, generations, rotations);
  find_standard_errors(steps, scale, generations);
  advance(generations);
}

void ErrorBars::pass(const Generations& generations) {
  const auto generation = generations.of_vertices();
  draw_changes();
  set_targets(0);
  std::ranges::fill(next_, Vector3<double>{});
  advance(generations);
  std::ranges::fill(are_seen_, std::uint8_t{0});
  std::ranges::transform(generation, standard_errors_.begin(),
                         [](Index g) { return g == Generations::anchor ? 0 : infinite; });
}

ErrorBars::Memory ErrorBars::memory() const {
  Memory memory;
  memory.rows.resize(standard_errors_.size());
  for (std::size_t v = 0; v < memory.rows.size(); ++v) {
    auto number = memory.rows[v].begin();
    const auto append = [&](const Vector3<double>& x) {
      for (const double coordinate : {x.x, x.y, x.z}) *number++ = coordinate;
    };
    for (const Members* of : {&errors_, &errors_of_change_, &changes_}) {
      for (std::size_t i = members * v; i < members * (v + 1); ++i) append((*of)[i]);
    }
    append(residuals_[v]);
    *number++ = are_seen_[v];
    *number++ = energies_[v].found;
    *number++ = energies_[v].expected;
    *number++ = standard_errors_[v];
  }
  memory.sums = {energy_.found, energy_.expected, product_, square_, static_cast<double>(frame_)};
  return memory;
}

bool ErrorBars::accepts(const Memory& memory) const {
  if (memory.rows.size() != standard_errors_.size()) return false;
  const auto is_sum = [](double x) { return x >= 0 && std::isfinite(x); };
  const auto is_sound = [&](const Memory::Row& row) {
    const auto end_of_members = row.begin() + 9 * members;
    return std::all_of(row.begin(), end_of_members,
                       [](double x) { return std::abs(x) < largest_member; }) &&
           is_in_range(Vector3<double>{row[27], row[28], row[29]}) &&
           (row[30] == 0 || row[30] == 1) && is_sum(row[31]) && is_sum(row[32]) && row[33] >= 0;
  };
  const auto& [found, expected, product, square, frame] = memory.sums;
  return std::ranges::all_of(memory.rows, is_sound) && is_sum(found) && is_sum(expected) &&
         std::isfinite(product) && is_sum(square) && is_sum(frame) && frame == std::floor(frame) &&
         frame < largest_frame && (exist() || memory.sums == Memory{}.sums);
}

void ErrorBars::recall(const Memory& memory) {
  if (!exist()) return;
  for (std::size_t v = 0; v < memory.rows.size(); ++v) {
    auto number = memory.rows[v].begin();
    const auto next = [&] {
      const Vector3<double> x = {number[0], number[1], number[2]};
      number += 3;
      return x;
    };
    for (Members* of : {&errors_, &errors_of_change_, &changes_}) {
      for (std::size_t i = members * v; i < members * (v + 1); ++i) (*of)[i] = next();
    }
    residuals_[v] = next();
    are_seen_[v] = *number++ != 0 ? 1 : 0;
    energies_[v].found = *number++;
    energies_[v].expected = *number++;
    standard_errors_[v] = *number++;
  }
  energy_ = {memory.sums[0], memory.sums[1]};
  product_ = memory.sums[2];
  square_ = memory.sums[3];
  frame_ = static_cast<std::uint64_t>(memory.sums[4]);
  set_sizes();
}

}  // namespace dynmesh
