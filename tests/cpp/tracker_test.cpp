#include <doctest/doctest.h>

#include <cmath>
#include <dynmesh/tracker.hpp>
#include <string>
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

TEST_CASE("a first scan elsewhere is refused, later ones are not") {
  const auto mesh = bumpy_torus(24);
  Tracker<double> tracker(mesh.faces(), mesh.points());
  const auto before = tracker.state();
  auto elsewhere = scan_of(mesh, translated(mesh.vertices, 30.0, 2.0, 1.0));
  auto in_millimetres = scan_of(mesh, mesh.vertices);
  for (double& c : in_millimetres.points) c *= 1000;
  for (const auto& scan : {elsewhere, in_millimetres}) {
    CHECK(message_of([&] { track(tracker, scan); }).starts_with("points: "));
    CHECK(tracker.state() == before);
  }
  // What else is in a scan does not count.
  auto with_others = scan_of(mesh, mesh.vertices);
  for (int copy = 1; copy < 4; ++copy) {
    const auto other = translated(with_others.points, 60.0 * copy, 0.0, 0.0);
    elsewhere.points.insert(elsewhere.points.end(), other.begin(), other.end());
    elsewhere.normals.insert(elsewhere.normals.end(), with_others.normals.begin(),
                             with_others.normals.end());
  }
  with_others.points.insert(with_others.points.end(), elsewhere.points.begin(),
                            elsewhere.points.end());
  with_others.normals.insert(with_others.normals.end(), elsewhere.normals.begin(),
                             elsewhere.normals.end());
  CHECK(largest_difference(track(tracker, with_others), mesh.vertices) < 0.1 * mean_edge(mesh));
  CHECK(tracker.report().agreement.far_share > 0.5);
  CHECK_NOTHROW(track(tracker, in_millimetres));
}

TEST_CASE("a template that is lost is registered anew, at most once in ten frames") {
  const auto mesh = bumpy_torus(24);
  const auto first = scan_of(mesh, turned(mesh.vertices, 0.03));
  const auto truth = translated(turned(mesh.vertices, 2.1), 40.0, 0.0, 0.0);
  const auto jumped = scan_of(mesh, truth);
  Tracker<double> plain(mesh.faces(), mesh.points());
  Tracker<double> tracker(mesh.faces(), mesh.points(), {.recover = true});
  CHECK(track(tracker, first) == track(plain, first));
  CHECK(!tracker.report().recovered);
  CHECK(largest_difference(track(plain, jumped), truth) > mean_edge(mesh));
  CHECK(plain.report().agreement.far_share > 0.05);
  CHECK(!plain.report().recovered);
  CHECK(largest_difference(track(tracker, jumped), truth) < 0.3 * mean_edge(mesh));
  CHECK(tracker.report().recovered);
  CHECK(tracker.report().agreement.far_share < 0.05);

  // Nine frames are then tracked as without a registration, whatever they are.
  const auto state = tracker.state();
  const auto frame = track(tracker, first);
  CHECK(!tracker.report().recovered);
  CHECK(largest_difference(frame, turned(mesh.vertices, 0.03)) > mean_edge(mesh));
  std::vector<double> out(frame.size());
  for (int n = 0; n < 7; ++n) tracker.skip({out.data(), mesh.size()});
  track(tracker, first);
  CHECK(!tracker.report().recovered);
  const auto last = track(tracker, first);
  CHECK(tracker.report().recovered);
  CHECK(largest_difference(last, turned(mesh.vertices, 0.03)) < 0.3 * mean_edge(mesh));

  // A state holds the last good frame and the pause.
  Tracker<double> other(mesh.faces(), mesh.points(), {.threads = 2, .recover = true});
  other.restore(state);
  CHECK(other.report().recovered);
  CHECK(other.state() == state);
  CHECK(track(other, first) == frame);
  for (int n = 0; n < 7; ++n) other.skip({out.data(), mesh.size()});
  track(other, first);
  CHECK(track(other, first) == last);

  const auto message = message_of([&] { plain.restore(state); });
  CHECK(message.find("recover is True, not False") != std::string::npos);
}

TEST_CASE("a registration that finds nothing better leaves no trace") {
  const auto mesh = bumpy_torus(16);
  const auto truth = turned(mesh.vertices, 0.03);
  auto scan = scan_of(mesh, truth);
  const auto other_things = translated(scan.points, 6.0, 6.0, 3.0);
  scan.points.insert(scan.points.end(), other_things.begin(), other_things.end());
  scan.normals.insert(scan.normals.end(), scan.normals.begin(), scan.normals.end());
  Tracker<double> plain(mesh.faces(), mesh.points(), {.uncertainty = true});
  Tracker<double> tracker(mesh.faces(), mesh.points(), {.uncertainty = true, .recover = true});
  for (int n = 0; n < 2; ++n) {
    CHECK(track(tracker, scan) == track(plain, scan));
    CHECK(plain.report().agreement.far_share > 0.05);
    CHECK(!tracker.report().recovered);
    CHECK(tracker.standard_error()[7] == plain.standard_error()[7]);
  }
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
    // The preconditioner is rounded to single precision, in the order of elimination.
    CHECK(largest_difference(reversed(found[t]), expected[t]) < 1e-6);
  }
}

}  // namespace
}  // namespace dynmesh::testing
