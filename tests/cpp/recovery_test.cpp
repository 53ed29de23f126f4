/// What a tracker remembers of frames in which the template is lost.
#include "api/recovery.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <dynmesh/quality.hpp>
#include <span>

#include "meshes.hpp"
#include "scans.hpp"
#include "surface_fit/surface_level.hpp"

namespace dynmesh::testing {
namespace {

/// What is common to all frames, without a solver.
struct Common final : Stream {
  using Stream::Stream;
  void write(Writer& /*writer*/) const override {}
  void restore(std::span<const std::byte> /*state*/) override {}
};

TEST_CASE("a template that was misplaced is found again in a good frame only") {
  const auto mesh = bumpy_torus(12);
  const auto frame = rows_of(mesh.vertices);
  Common common(mesh.faces(), frame.size(), 1, task_sharing_of_tracking(), coordinates_of<double>,
                {});
  const SurfaceLevel surface(common.faces, common.topology, common.workers, frame);
  const Recovery recovery(common, surface, frame, false);
  // How it was lost: out of sight, while a point lay on a single vertex, or while points lay on it.
  for (const double share : {0.0, 0.007, 0.5}) {
    for (const Quality quality : {Quality::good, Quality::doubtful, Quality::ruined}) {
      CAPTURE(share);
      CAPTURE(quality);
      Memory memory(frame);
      recovery.begin(memory);
      memory.tracking.good_in_a_row = 0;
      const auto n = static_cast<double>(frame.size());
      std::ranges::fill(memory.known, 0);
      std::fill_n(memory.known.begin(), static_cast<std::ptrdiff_t>(share * n), 1);
      Memory next = memory;
      recovery.remember(memory, {.agreement = {1000, 0, 0, 0.1}, .quality = quality}, {}, next);
      const bool was_misplaced = share > 0.01;
      const bool is_found =
          quality == Quality::good || (quality == Quality::doubtful && !was_misplaced);
      CHECK((next.tracking.good_in_a_row > 0) == is_found);
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
