/// Whole frames, put together from frames none of which is whole.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/whole_frame.hpp>
#include <limits>
#include <span>
#include <string>
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

std::int32_t read_recording(void* context, std::int64_t frame, void* points, std::uint8_t* known) {
  const auto& recording = *static_cast<const Recording*>(context);
  const auto t = static_cast<std::size_t>(frame);
  std::ranges::copy(recording.frames[t], static_cast<double*>(points));
  std::ranges::copy(recording.known[t], known);
  return 0;
}

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

TEST_CASE("C makes the same frame, and can stop it") {
  Recording recording;
  const auto whole = recording.made_whole();
  const std::size_t k = recording.mesh.size();
  dynmesh_whole_frame_request request{};
  request.faces = recording.mesh.indices.data();
  request.n_faces = static_cast<std::int64_t>(recording.mesh.faces().count);
  request.n_frames = static_cast<std::int64_t>(recording.frames.size());
  request.source = read_recording;
  request.context = &recording;
  request.frame = -1;
  request.noise = std::numeric_limits<double>::quiet_NaN();
  request.threads = 1;
  std::vector<double> positions(3 * k);
  std::vector<std::uint8_t> seen(k);
  std::vector<double> errors(k);
  const dynmesh_output output{positions.data(), static_cast<std::int64_t>(k), 0, 0,
                              DYNMESH_FLOAT64};
  dynmesh_whole_frame_report report{};
  const auto call = [&] {
    return dynmesh_whole_frame(&request, &output, seen.data(), errors.data(), &report);
  };
  REQUIRE(call() == DYNMESH_OK);
  CHECK(positions == whole.positions);
  CHECK(seen == whole.seen);
  CHECK(errors == whole.standard_error);
  CHECK(report.frame == 3);
  CHECK(report.doubtful == 0);

  request.progress = [](void* /*context*/, std::int64_t done, std::int64_t /*of*/) {
    return done < 5 ? 0 : 1;
  };
  CHECK(call() == DYNMESH_STOPPED);
  CHECK(std::string(dynmesh_last_message()).find("stopped after 5 of ") == 0);
  request.frame = -2;
  CHECK(call() == DYNMESH_INVALID_ARGUMENT);
  request.source = nullptr;
  CHECK(call() == DYNMESH_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace dynmesh::testing
