/// Whole frames, put together from frames none of which is whole.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <dynmesh/whole_frame.hpp>
#include <span>
#include <vector>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

/// A torus that turns, of which every frame knows a random part.
struct Recording {
  Mesh<double> mesh = torus(9);
  std::vector<std::vector<double>> frames;
  std::vector<std::vector<std::uint8_t>> known;

  Recording() {
    for (std::size_t t = 0; t < 12; ++t) {
      frames.push_back(turned(mesh.vertices, 0.05 * static_cast<double>(t)));
      known.push_back(random_mask(mesh.size(), t == 3 ? 0.6 : 0.5, static_cast<unsigned>(t)));
    }
  }

  [[nodiscard]] FrameSource<double> source() const {
    return [this](std::size_t t, Points<double> points, std::span<std::uint8_t> mask) {
      std::ranges::copy(frames[t], points.data);
      std::ranges::copy(known[t], mask.begin());
    };
  }

  [[nodiscard]] WholeFrame<double> made_whole(const WholeFrameSettings& settings = {}) const {
    return whole_frame(mesh.faces(), mesh.size(), frames.size(), source(), settings);
  }
};

TEST_CASE("any number of threads makes the same frame") {
  const Recording recording;
  WholeFrameSettings settings;
  settings.threads = 3;
  const auto alone = recording.made_whole();
  const auto shared = recording.made_whole(settings);
  CHECK(alone.positions == shared.positions);
  CHECK(alone.standard_error == shared.standard_error);
}

TEST_CASE("frames are read in order, twice, and only those that are used") {
  const Mesh<double> mesh = sheet<double>(3);
  std::vector<std::size_t> read;
  const FrameSource<double> source = [&](std::size_t t, Points<double> points,
                                         std::span<std::uint8_t> known) {
    read.push_back(t);
    std::ranges::copy(mesh.vertices, points.data);
    std::ranges::fill(known, std::uint8_t{1});
  };
  const std::size_t n = 2000;
  const auto whole = whole_frame(mesh.faces(), mesh.size(), n, source);
  CHECK(whole.positions == mesh.vertices);
  CHECK(whole.frame == n / 2 - 1);  // the one nearest to the middle
  const auto second = read.begin() + static_cast<std::ptrdiff_t>(n);
  CHECK(std::is_sorted(read.begin(), second));
  CHECK(std::is_sorted(second, read.end()));
  CHECK(read.end() - second < 300);
  for (std::size_t t = whole.frame - 30; t <= whole.frame + 30; ++t) {
    CHECK(std::find(second, read.end(), t) != read.end());
  }
  CHECK(*second < 50);
  CHECK(read.back() > n - 50);
}

}  // namespace
}  // namespace dynmesh::testing
