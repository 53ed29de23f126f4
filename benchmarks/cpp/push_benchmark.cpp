/// Measures the C++ calls by Google Benchmark, on a bumpy sheet that rotates back and forth.
///
/// The arguments of each benchmark are the vertices along a side and the known share in per cent.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <dynmesh/completer.hpp>
#include <dynmesh/topology.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "generations/generations.hpp"
#include "meshes.hpp"
#include "motion/motion.hpp"

namespace dynmesh {
namespace {

/// A mesh, two poses that alternate, and a mask.
struct Scene {
  explicit Scene(const benchmark::State& state)
      : mesh(testing::sheet<float>(static_cast<int>(state.range(0)))),
        poses{mesh.vertices, testing::turned(mesh.vertices, 0.01)},
        known(testing::random_mask(mesh.size(), static_cast<double>(state.range(1)) / 100, 1)),
        completed(mesh.vertices.size()) {}

  [[nodiscard]] std::size_t size() const { return mesh.size(); }
  [[nodiscard]] Points<const float> pose(std::size_t number) const {
    return {poses[number % 2].data(), size()};
  }
  [[nodiscard]] KnownMask mask() const { return {known.data(), size()}; }
  [[nodiscard]] Points<float> output() { return {completed.data(), size()}; }

  testing::Mesh<float> mesh;
  std::array<std::vector<float>, 2> poses;
  std::vector<std::uint8_t> known;
  std::vector<float> completed;
};

void count_vertices(benchmark::State& state, const Scene& scene) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(scene.size()));
}

void push_mask(benchmark::State& state) {
  Scene scene(state);
  Completer<float> completer(scene.mesh.faces(), scene.mesh.points(), {.method = Method::motion});
  std::size_t frame = 0;
  for (auto _ : state) completer.push(scene.pose(++frame), scene.mask(), scene.output());
  count_vertices(state, scene);
}

void push_nan(benchmark::State& state) {
  Scene scene(state);
  for (std::vector<float>& pose : scene.poses) {
    for (std::size_t v = 0; v < scene.size(); ++v) {
      if (scene.known[v] == 0) pose[3 * v] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  Completer<float> completer(scene.mesh.faces(), scene.mesh.points(), {.method = Method::motion});
  std::size_t frame = 0;
  for (auto _ : state) completer.push(scene.pose(++frame), scene.output());
  count_vertices(state, scene);
}

void push_sparse(benchmark::State& state) {
  Scene scene(state);
  std::vector<Index> indices;
  std::array<std::vector<float>, 2> observed;
  for (std::size_t v = 0; v < scene.size(); ++v) {
    if (scene.known[v] == 0) continue;
    indices.push_back(static_cast<Index>(v));
    for (std::size_t pose = 0; pose < 2; ++pose) {
      const float* at = &scene.poses[pose][3 * v];
      observed[pose].insert(observed[pose].end(), at, at + 3);
    }
  }
  Completer<float> completer(scene.mesh.faces(), scene.mesh.points(), {.method = Method::motion});
  std::size_t frame = 0;
  for (auto _ : state) {
    const Points<const float> points(observed[++frame % 2].data(), indices.size());
    completer.push_sparse(indices, points, scene.output());
  }
  count_vertices(state, scene);
}

/// The estimate alone, by the direct implementation in motion.cpp.
void plain(benchmark::State& state) {
  Scene scene(state);
  const Topology topology = build_topology(scene.mesh.faces(), scene.size());
  Generations generations(scene.size());
  Motion<float> motion(topology.cells, true, 0);
  std::vector<Vector3<float>> previous(scene.size());
  std::vector<Vector3<float>> current(scene.size());
  const auto read = [&](std::vector<Vector3<float>>& frame, Points<const float> pose) {
    for (std::size_t v = 0; v < scene.size(); ++v) frame[v] = {pose(v, 0), pose(v, 1), pose(v, 2)};
  };
  read(previous, scene.mesh.points());
  motion.reset(previous);
  std::size_t frame = 0;
  for (auto _ : state) {
    read(current, scene.pose(++frame));
    motion.estimate(previous, current, scene.known, generations);
    std::swap(previous, current);
  }
  count_vertices(state, scene);
}

/// Copies the data that a frame must at least touch: points, previous frame, mask and cells.
void copy(benchmark::State& state) {
  const Scene scene(state);
  const Topology topology = build_topology(scene.mesh.faces(), scene.size());
  const std::size_t size = 2 * scene.completed.size() * sizeof(float) + scene.size() +
                           topology.cells.neighbours.size() * sizeof(Index);
  const std::vector<char> from(size, 1);
  std::vector<char> to(size);
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), size);
    benchmark::ClobberMemory();
  }
  count_vertices(state, scene);
}

void sizes_and_shares(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"side", "known"})->Unit(benchmark::kMicrosecond)->UseRealTime();
  for (const int side : {100, 1000}) {
    for (const int known : {10, 50}) benchmark->Args({side, known});
  }
}

BENCHMARK(push_mask)->Apply(sizes_and_shares);
BENCHMARK(push_nan)->Apply(sizes_and_shares);
BENCHMARK(push_sparse)->Apply(sizes_and_shares);
BENCHMARK(plain)->Apply(sizes_and_shares);
BENCHMARK(copy)->Apply(sizes_and_shares);

}  // namespace
}  // namespace dynmesh
