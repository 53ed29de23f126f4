#include "shape/error_bars.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/geometry.hpp"
#include "shape/constants.hpp"
#include "shape/random_signs.hpp"

namespace dynmesh {
namespace {

/// The size of the noise of planes, compared with what their weight would say of positions. Recent
/// residuals at planes tell it, and those of the shape that of the changes; were they one sum, the
/// larger noise, made up or measured, would decide how large the errors of the shape seem.
double noise_size(const ErrorMemory& memory) {
  const Energy& noise = memory.of_noise;
  const Energy& shape = memory.of_shape;
  const double square = noise.x / noise.y * (shape.y / shape.x);
  const double largest = uncertainty_constants.largest_noise;
  return std::isfinite(square) ? std::clamp(std::sqrt(square), 1 / largest, largest) : 1;
}

}  // namespace

ErrorBars::ErrorBars(const Cells& cells, Workers& workers, bool are_wanted, AnchorNoise noise)
    : cells_(cells),
      workers_(workers),
      size_(are_wanted ? cells.size() : 0),
      noise_kind_(noise),
      smoother_(are_wanted ? smoother_of(cells) : DetailOperator()),
      changes_(Changes(size_), 1),
      members_(Members(members * size_), noise == AnchorNoise::exact ? 1 : 2),
      energies_(Energies(size_), 1) {}

ErrorMemory ErrorBars::no_errors() const {
  ErrorMemory memory;
  for (Members* of : {&memory.errors, &memory.changes}) of->resize(members * size_);
  memory.energies.resize(size_);
  memory.standard_errors.resize(size_);
  return memory;
}

/// Continues the changes: smooth over the mesh, with a part in common with the cluster, and partly
/// those of the frame before: T = e + eta. `next` may be the memory if that is of frame 0.
auto ErrorBars::draw_changes(const Clusters& clusters, const ErrorMemory& memory, ErrorMemory& next)
    -> Lent<Changes> {
  Lent<Changes> changes = changes_.lend();
  auto& targets = changes.targets;
  auto& sizes = changes.sizes;
  find_sizes(memory.energies, sizes);
  const std::uint64_t of_vertices = mixed(memory.frame);
  const std::uint64_t of_clusters = mixed(of_vertices);
  workers_.for_each_in_chunks(cells_.size(), [&](std::size_t v) {
    const std::uint64_t own = mixed(of_vertices + v);
    const std::uint64_t shared = mixed(of_clusters + at(clusters.of_vertex[v]));
    for (std::size_t i = 0; i < members; ++i) {
      targets[members * v + i] =
          signs_of(own, i) + uncertainty_constants.shared_change * signs_of(shared, i);
    }
  });
  smooth(smoother_, static_cast<int>(members), uncertainty_constants.smoothings, targets,
         next.changes, workers_);
  const double kept = memory.frame == 0 ? 0 : uncertainty_constants.persistence;
  const double fresh = std::sqrt(1 - kept * kept);
  workers_.for_each_in_chunks(cells_.size(), [&](std::size_t v) {
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      next.changes[i] = kept * memory.changes[i] + fresh * targets[i];
      targets[i] = memory.errors[i] + sizes[v] * next.changes[i];
    }
  });
  next.frame = memory.frame + 1;
  next.energies = memory.energies;
  next.energy = memory.energy;
  next.of_noise = memory.of_noise;
  next.of_shape = memory.of_shape;
  return changes;
}

/// Makes up the noise of the anchors. That of positions is as large as their weight says, and each
/// vertex has its own. Planes follow from points within triangles, which neighbours share.
auto ErrorBars::noise_of(const Anchors& anchors, Field targets, const ErrorMemory& memory,
                         ErrorMemory& next) -> Lent<Members> {
  Lent<Members> noise = members_.lend();
  double sum = 0;
  for (const Vector3& target : targets) sum += squared_norm(target);
  const double size = noise_size(memory) * std::sqrt(sum / static_cast<double>(3 * targets.size()));
  const std::uint64_t of_frame = ~mixed(next.frame);  // other bits than those of the changes
  workers_.for_each_in_chunks(cells_.size(), [&](std::size_t v) {
    const std::uint64_t signs = mixed(of_frame + v);
    const double weight = anchors.weights[v];
    const double deviation = weight > 0 ? size / std::sqrt(weight) : 0;
    for (std::size_t i = 0; i < members; ++i) {
      noise[members * v + i] = deviation * signs_of(signs, i);
    }
  });
  if (noise_kind_ == AnchorNoise::of_planes) {
    smooth(smoother_, static_cast<int>(members), 1, noise, next.errors, workers_);
  }
  return noise;
}

/// Compares the residuals of the frame with those of the members.
auto ErrorBars::compare(const CompletedShape& frame, const Anchors& anchors, Field targets,
                        Field noise, Field steps, Field k_steps) -> Lent<Energies> {
  Lent<Energies> energies = energies_.lend();
  workers_.for_each_in_chunks(cells_.size(), [&](std::size_t v) {
    Energy& energy = energies.of_shape[v] = {};
    Energy& of_noise = energies.of_noise[v] = {};
    if (anchors.counts[v] == 0) return;
    energy.x = squared_norm(frame.kx[v] - frame.shape[v]);
    if (anchors.are_noisy()) {
      const auto off = anchors.observable(v, frame.x[v] - anchors.observed[v]);
      of_noise.x = anchors.weights[v] * squared_norm(off);
    }
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      energy.y += squared_norm(k_steps[i] - targets[i]) / members;
      if (anchors.are_noisy()) {
        const auto off = anchors.observable(v, steps[i] - noise[i]);
        of_noise.y += anchors.weights[v] * squared_norm(off) / members;
      }
    }
    if (noise_kind_ == AnchorNoise::by_weight) energy = energy + of_noise;
  });
  return energies;
}

/// Adds the newest energies, which are those of changes of the current sizes, to the energies
/// around each vertex.
void ErrorBars::learn_sizes(std::span<const double> sizes, Energies& newest,
                            const ErrorMemory& memory, ErrorMemory& next) {
  auto& of_shape = newest.of_shape;
  workers_.for_each_in_chunks(sizes.size(),
                              [&](std::size_t v) { of_shape[v].y /= sizes[v] * sizes[v]; });
  smooth(smoother_, 1, uncertainty_constants.averagings, of_shape, newest.of_noise, workers_);
  workers_.for_each_in_chunks(sizes.size(), [&](std::size_t v) {
    next.energies[v] = uncertainty_constants.kept_of_sizes * memory.energies[v] + of_shape[v];
  });
}

/// The size of the changes around each vertex, compared with the mean, which tells busy parts from
/// quiet ones: the root of the ratio of the energies found and expected there in recent frames,
/// closer to 1 where there is little energy to tell.
void ErrorBars::find_sizes(std::span<const Energy> energies, std::span<double> sizes) {
  const Energy mean = std::accumulate(energies.begin(), energies.end(), Energy{});
  const double ratio = mean.x / mean.y;
  const double prior = uncertainty_constants.pull * mean.x / static_cast<double>(energies.size());
  workers_.for_each_in_chunks(sizes.size(), [&](std::size_t v) {
    const double size = std::sqrt((energies[v].x + prior) / (ratio * energies[v].y + prior));
    const double largest = uncertainty_constants.largest_size;
    sizes[v] = std::isfinite(size) ? std::clamp(size, 1 / largest, largest) : 1;
  });
}

/// Finds the standard errors from the `steps` of the members, and the next memory, which is what
/// the members look like after the frame: K D where an anchor ties them, T where no anchor does.
/// The errors in `next` are K D so far.
void ErrorBars::end_frame(Field targets, Field steps, double scale, const Generations& generations,
                          ErrorMemory& next) {
  const auto generation = generations.of_vertices();
  workers_.for_each_in_chunks(cells_.size(), [&](std::size_t v) {
    const bool is_disconnected = generation[v] == Generations::disconnected;
    double sum = 0;
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      sum += squared_norm(steps[i]);
      if (is_disconnected) next.errors[i] = targets[i];
    }
    const double variance = sum / (3 * members);
    const double found = std::sqrt(scale * variance);
    const bool is_fixed = generation[v] == Generations::anchor && variance == 0;
    const bool is_known = !is_disconnected && std::isfinite(found);
    next.standard_errors[v] = is_fixed ? 0 : is_known ? found : infinite;
  });
}

/// Replaces the standard errors at planes, which tell the errors along their normals and leave
/// those along the surface: three numbers of a vertex, hence the mean square of those around it.
void ErrorBars::look_along_normals(Field steps, double scale, const Anchors& anchors,
                                   Energies& seen, ErrorMemory& next) {
  auto& squares = seen.of_shape;
  workers_.for_each_in_chunks(cells_.size(), [&](std::size_t v) {
    squares[v] = {};
    if (!(anchors.weights[v] > 0)) return;
    for (std::size_t i = members * v; i < members * (v + 1); ++i) {
      squares[v].x += squared_norm(anchors.observable(v, steps[i])) / members;
    }
    squares[v].y = 1;
  });
  smooth(smoother_, 1, uncertainty_constants.averagings, squares, seen.of_noise, workers_);
  for (std::size_t v = 0; v < cells_.size(); ++v) {
    if (!(anchors.weights[v] > 0) || !std::isfinite(next.standard_errors[v])) continue;
    next.standard_errors[v] = std::sqrt(scale * squares[v].x / squares[v].y);
  }
}

void ErrorBars::update(const CompletedShape& frame, ShapeFactor& factor,
                       const Generations& generations, ShapeSystem& system,
                       const Clusters& clusters, const ErrorMemory& memory, ErrorMemory& next) {
  if (carry_on(frame, factor, generations, system, clusters, memory, next)) return;
  // Nothing that was made up makes sense any more. Begin again, as in frame 0, which has no error.
  for (Members* of : {&next.errors, &next.changes}) std::ranges::fill(*of, Vector3{});
  std::ranges::fill(next.energies, Energy{});
  next.energy = next.of_noise = next.of_shape = {};
  next.frame = 0;
  pass(generations, clusters, next, next);
}

/// Finds the errors of a frame unless those of the members are out of range.
bool ErrorBars::carry_on(const CompletedShape& frame, ShapeFactor& factor,
                         const Generations& generations, ShapeSystem& system,
                         const Clusters& clusters, const ErrorMemory& memory, ErrorMemory& next) {
  const Anchors& anchors = factor.anchors;
  const Lent<Changes> changes = draw_changes(clusters, memory, next);
  const Field targets = changes.targets;
  std::optional<Lent<Members>> made_up;
  if (anchors.are_noisy()) made_up.emplace(noise_of(anchors, targets, memory, next));
  const Field noise = made_up ? Field(*made_up) : Field();
  Lent<Members> steps = members_.lend();
  system.solve<members, members>(
      [&](std::size_t v, std::size_t f) { return targets[members * v + f]; },
      [&](std::size_t v, std::size_t f) { return noise[members * v + f]; }, factor, steps);
  system.apply(steps, static_cast<int>(members), next.errors);

  Lent<Energies> newest = compare(frame, anchors, targets, noise, steps, next.errors);
  const auto sum_of = [](const std::vector<Energy>& energies) {
    return std::accumulate(energies.begin(), energies.end(), Energy{});
  };
  const Energy energy = sum_of(newest.of_shape);
  Energy of_noise = sum_of(newest.of_noise);
  if (!(energy.y + of_noise.y < largest_member)) return false;
  double scale = infinite;
  if (std::isfinite(energy.x + of_noise.x)) {
    if (noise_kind_ == AnchorNoise::of_planes) {
      const double size = noise_size(memory);
      of_noise.y /= size * size;
      next.of_noise = uncertainty_constants.kept_of_sizes * memory.of_noise + of_noise;
      next.of_shape = uncertainty_constants.kept_of_sizes * memory.of_shape + energy;
    }
    // A motion that has just begun shows in this frame alone, one that has ended has left its
    // errors behind, and a side that is quiet for a while does not vouch for a hidden one.
    next.energy = uncertainty_constants.kept_of_scale * memory.energy + energy;
    const auto ratio = [](const Energy& e) { return e.y > 0 ? e.x / e.y : 0; };
    scale = std::max(ratio(energy), ratio(next.energy));
    // Where rounding errors happen to be large says nothing about the subject.
    const double counted = std::accumulate(anchors.counts.begin(), anchors.counts.end(), 0.0);
    if (energy.x <= counted * frame.rounding) {
      for (Energy& at_vertex : newest.of_shape) at_vertex.x = 0;
    }
    learn_sizes(changes.sizes, newest, memory, next);
  }
  end_frame(targets, steps, scale, generations, next);
  if (noise_kind_ == AnchorNoise::of_planes) {
    look_along_normals(steps, scale, anchors, newest, next);
  }
  return true;
}

void ErrorBars::pass(const Generations& generations, const Clusters& clusters,
                     const ErrorMemory& memory, ErrorMemory& next) {
  const Lent<Changes> changes = draw_changes(clusters, memory, next);
  std::ranges::fill(next.errors, Vector3{});
  // 0 for anchors, infinite for all others
  end_frame(changes.targets, next.errors, infinite, generations, next);
}

void ErrorBars::widen(const Generations& generations, double size, ErrorMemory& next) {
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < next.standard_errors.size(); ++v) {
    if (generation[v] == Generations::anchor) continue;
    next.standard_errors[v] = std::hypot(next.standard_errors[v], size);
  }
}

}  // namespace dynmesh
