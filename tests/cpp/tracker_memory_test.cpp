/// A frame of tracking that runs out of memory changes nothing.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <dynmesh/tracker.hpp>
#include <vector>

#include "counted_memory.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

/// A tracker in the middle of a sequence, and the next frame as a scan and as images.
struct Sequence {
  bool is_trained = false;
  Mesh<double> mesh = bumpy_torus(10);
  Samples first = scan_of(mesh, turned(mesh.vertices, 0.03));
  Samples second = scan_of(mesh, turned(mesh.vertices, 0.06));
  std::vector<Image> images = images_of(mesh, turned(mesh.vertices, 0.06), 2, 60);
  std::vector<double> out = std::vector<double>(3 * mesh.size());

  [[nodiscard]] Tracker<double> begun() const {
    Tracker<double> tracker =
        is_trained ? Tracker<double>(mesh.faces(), mesh.points(), {.uncertainty = true},
                                     training_of(training_frames_of(mesh.vertices, 3)))
                   : Tracker<double>(mesh.faces(), mesh.points());
    track(tracker, first);
    return tracker;
  }
  void push(Tracker<double>& tracker) {
    Scan<double> scan;
    scan.points = {second.points.data(), second.points.size() / 3};
    if (second.has_normals) scan.normals = {second.normals.data(), second.normals.size() / 3};
    tracker.push(scan, {out.data(), mesh.size()});
  }
  void push_depth(Tracker<double>& tracker) {
    const std::array<DepthImage, 2> views = {images[0].view(), images[1].view()};
    tracker.push_depth(views, {out.data(), mesh.size()});
  }
};

TEST_CASE("a frame of tracking that runs out of memory changes nothing") {
  Sequence sequence;
  sequence.second.has_normals = false;
  SUBCASE("alone") {}
  SUBCASE("with training and errors") { sequence.is_trained = true; }
  for (const auto call : {&Sequence::push, &Sequence::push_depth}) {
    auto expected = sequence.begun();
    const auto before = expected.state();
    (sequence.*call)(expected);
    const auto frame = sequence.out;
    const auto prepare = [&] {
      std::ranges::fill(sequence.out, 7);
      return sequence.begun();
    };
    const auto check = [&](Tracker<double>& tracker) {
      CHECK(std::ranges::count(sequence.out, 7) == std::ssize(sequence.out));
      CHECK(tracker.state() == before);
      (sequence.*call)(tracker);
      CHECK(sequence.out == frame);
    };
    const int failures = fail_everywhere(
        prepare, [&](Tracker<double>& t) { (sequence.*call)(t); }, check);
    CHECK(failures > 2);
  }
}

}  // namespace
}  // namespace dynmesh::testing
