#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <cmath>
#include <cstring>
#include <dynmesh/tracker.hpp>
#include <vector>

#include "meshes.hpp"
#include "scans.hpp"
#include "shared_work.hpp"

namespace dynmesh::testing {
namespace {

std::vector<double> track_images(Tracker<double>& tracker, const std::vector<Image>& images) {
  std::vector<DepthImage> views;
  for (const auto& image : images) views.push_back(image.view());
  std::vector<double> tracked(3 * tracker.n_vertices());
  tracker.push_depth(views, {tracked.data(), tracker.n_vertices()});
  return tracked;
}

TEST_CASE("the result does not depend on the number of threads") {
  const SharedWork shared;
  const auto mesh = bumpy_torus(16);
  Tracker<float> one(as_floats(mesh).faces(), as_floats(mesh).points());
  Tracker<float> three(as_floats(mesh).faces(), as_floats(mesh).points(), {.threads = 3});
  for (int n = 1; n < 4; ++n) {
    auto scan = scan_of(mesh, turned(mesh.vertices, 0.03 * n));
    scan.has_normals = n != 2;
    std::vector<float> found;
    CHECK(shared_pieces([&] { found = track(three, scan); }) > 0);
    CHECK(found == track(one, scan));
  }
}

TEST_CASE("where nothing was measured, the template stays") {
  const auto mesh = bumpy_torus(16);
  Tracker<double> tracker(mesh.faces(), mesh.points());
  const auto first = track(tracker, scan_of(mesh, turned(mesh.vertices, 0.03)));
  std::vector<double> out(first.size());
  CHECK(tracker.skip({out.data(), mesh.size()}).disconnected == mesh.size());
  CHECK(out == first);
  Samples empty;
  empty.viewpoints = {9, 0, 0};
  CHECK(track(tracker, empty) == first);
  auto far = scan_of(mesh, turned(mesh.vertices, 0.03));
  far.points = translated(far.points, 500.0, 0.0, 0.0);
  CHECK(track(tracker, far) == first);
  CHECK(tracker.age()[0] == 3);
  CHECK(tracker.observed()[0] == 0);
  CHECK(tracker.n_frames() == 4);
  // It is found again.
  const auto truth = turned(mesh.vertices, 0.06);
  const auto found = track(tracker, scan_of(mesh, truth));
  CHECK(largest_difference(found, truth) < 0.3 * mean_edge(mesh));
  CHECK(tracker.age()[0] == 0);
}

TEST_CASE("a first scan elsewhere is aligned, or refused with the distance") {
  const auto mesh = bumpy_torus(24);
  const auto truth = translated(turned(mesh.vertices, 0.05), 30.0, 2.0, 1.0);
  Tracker<double> tracker(mesh.faces(), mesh.points());
  const auto found = track(tracker, scan_of(mesh, truth));
  CHECK(tracker.report().aligned);
  CHECK(largest_difference(found, truth) < 0.3 * mean_edge(mesh));

  tracker.reset(mesh.points());
  auto in_millimetres = scan_of(mesh, mesh.vertices);
  for (double& c : in_millimetres.points) c *= 1000;
  const auto before = tracker.state();
  const auto message = message_of([&] { track(tracker, in_millimetres); });
  CHECK(message.find("points: the template is far from the first scan") == 0);
  CHECK(tracker.state() == before);
}

TEST_CASE("a component without points follows the others") {
  const auto left = bumpy_torus(16);
  auto right = left;
  right.vertices = translated(left.vertices, 20.0, 0.0, 0.0);
  const auto mesh = join(left, right);
  Tracker<double> tracker(mesh.faces(), mesh.points());
  const auto truth = translated(mesh.vertices, 0.1, 0.05, 0.0);
  const auto found = track(tracker, scan_of(left, translated(left.vertices, 0.1, 0.05, 0.0)));
  CHECK(largest_difference(found, truth) < 0.2 * mean_edge(left));
  CHECK(tracker.report().disconnected == right.size());
  CHECK(tracker.generation()[mesh.size() - 1] == -1);
}

TEST_CASE("rounding does not decide what is found in depth images") {
  const Mesh<double> mesh = bumpy_torus(24);
  Tracker<double> tracker(mesh.faces(), mesh.points());
  Tracker<double> other(mesh.faces(), mesh.points());
  for (int t = 1; t <= 4; ++t) {
    std::vector<Image> images = images_of(mesh, turned(mesh.vertices, 0.02 * t), 2, 96);
    const auto tracked = track_images(tracker, images);
    for (Image& image : images) {
      for (std::size_t i = 3; i < 12; i += 4) image.pose[i] = std::nextafter(image.pose[i], 100);
    }
    CHECK(largest_difference(track_images(other, images), tracked) < 1e-9);
  }
}

/// Leaves two by two pixels of each block of six by six.
std::vector<Image> sparse(std::vector<Image> images) {
  for (Image& image : images) {
    for (int i = 0; i < image.side * image.side; ++i) {
      const int row = i / image.side;
      const int column = i % image.side;
      if (row % 6 > 1 || column % 6 > 1) image.pixels[static_cast<std::size_t>(i)] = 0;
    }
  }
  return images;
}

TEST_CASE("what is found in sparse depth images does not depend on the order of the vertices") {
  const Mesh<double> mesh = bumpy_torus(24);
  const auto last = static_cast<Index>(mesh.size()) - 1;
  const auto reversed = [](const std::vector<double>& rows) {
    std::vector<double> other;
    for (std::size_t i = rows.size(); i > 0; i -= 3) {
      other.insert(other.end(), {rows[i - 3], rows[i - 2], rows[i - 1]});
    }
    return other;
  };
  Mesh<double> other = {reversed(mesh.vertices), mesh.indices};
  for (Index& v : other.indices) v = last - v;
  const auto tracked_in = [&](const Mesh<double>& of, Index chunk) {
    const SharedWork shared(chunk);
    Tracker<double> tracker(of.faces(), of.points());
    std::vector<std::vector<double>> frames;
    for (int t = 1; t <= 3; ++t) {
      const auto images = images_of(mesh, turned(mesh.vertices, 0.03 * t), 2, 96);
      frames.push_back(track_images(tracker, sparse(images)));
    }
    return frames;
  };
  const auto expected = tracked_in(mesh, 1 << 20);
  for (const Index chunk : {1, 16, 100}) CHECK(tracked_in(mesh, chunk) == expected);
  const auto found = tracked_in(other, 1 << 20);
  for (std::size_t t = 0; t < 3; ++t) {
    CHECK(largest_difference(reversed(found[t]), expected[t]) < 1e-9);
  }
}

TEST_CASE("the C interface tracks as the C++ interface does") {
  const auto mesh = bumpy_torus(16);
  const auto k = static_cast<std::int64_t>(mesh.size());
  const auto scan = scan_of(mesh, turned(mesh.vertices, 0.03));
  Tracker<double> expected(mesh.faces(), mesh.points());
  const auto frame = track(expected, scan);
  const dynmesh_points first = {mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT64};
  const auto rows = static_cast<std::int64_t>(scan.points.size() / 3);
  const dynmesh_points points = {scan.points.data(), rows, 3, 1, DYNMESH_FLOAT64};
  const dynmesh_points normals = {scan.normals.data(), rows, 3, 1, DYNMESH_FLOAT64};
  std::vector<double> found(frame.size());
  const dynmesh_output out = {found.data(), k, 3, 1, DYNMESH_FLOAT64};
  dynmesh_tracker* tracker = nullptr;
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  REQUIRE(dynmesh_tracker_create(mesh.indices.data(), n_faces, &first, 1, &tracker) == DYNMESH_OK);
  dynmesh_tracking_report report{};
  REQUIRE(dynmesh_tracker_push(tracker, &points, &normals, nullptr, &out, &report) == DYNMESH_OK);
  CHECK(found == frame);
  CHECK(report.known == static_cast<std::int64_t>(expected.report().known));
  CHECK(dynmesh_tracker_observed(tracker)[3] == 1);
  CHECK(dynmesh_tracker_generation(tracker)[3] == 0);
  std::int64_t size = 0;
  REQUIRE(dynmesh_tracker_state_size(tracker, &size) == DYNMESH_OK);
  std::vector<std::byte> state(static_cast<std::size_t>(size));
  REQUIRE(dynmesh_tracker_state(tracker, state.data(), size) == DYNMESH_OK);
  CHECK(state == expected.state());
  REQUIRE(dynmesh_tracker_skip(tracker, &out, nullptr) == DYNMESH_OK);
  CHECK(dynmesh_tracker_age(tracker)[3] == 1);
  REQUIRE(dynmesh_tracker_restore(tracker, state.data(), size) == DYNMESH_OK);
  CHECK(dynmesh_tracker_age(tracker)[3] == 0);
  const auto images = images_of(mesh, mesh.vertices, 1, 60);
  const auto view = images[0].view();
  dynmesh_depth_image image{view.data, 60, 60, 0, 0, {}, {}};
  std::memcpy(image.intrinsics, view.intrinsics.data(), sizeof image.intrinsics);
  std::memcpy(image.pose, view.pose.data(), sizeof image.pose);
  CHECK(dynmesh_tracker_push_depth(tracker, &image, 1, &out, nullptr) == DYNMESH_OK);
  image.pose[0] = 2;
  CHECK(dynmesh_tracker_push_depth(tracker, &image, 1, &out, nullptr) == DYNMESH_INVALID_ARGUMENT);
  CHECK(dynmesh_tracker_reset(tracker, &first) == DYNMESH_OK);
  dynmesh_tracker_destroy(tracker);
  CHECK(dynmesh_tracker_create(mesh.indices.data(), n_faces, &first, 0, &tracker) ==
        DYNMESH_INVALID_ARGUMENT);
  CHECK(tracker == nullptr);
}

}  // namespace
}  // namespace dynmesh::testing
