/// The unit of length does not matter: frames in another unit, a power of two times as large, are
/// completed and tracked to the same frames bit for bit, whatever the settings.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <dynmesh/tracker.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "meshes.hpp"
#include "push.hpp"
#include "scans.hpp"
#include "stream/settings_table.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

/// 30 would be from metres to nanometres. Squares of lengths of the first one are out of the range
/// of float.
constexpr int exponents[] = {-70, -30, 40};

template <class Real>
std::vector<Real> scaled(std::span<const Real> values, int exponent) {
  std::vector<Real> result(values.begin(), values.end());
  for (Real& x : result) x = std::ldexp(x, exponent);
  return result;
}

template <class Real>
std::vector<Real> scaled(const std::vector<Real>& values, int exponent) {
  return scaled(std::span<const Real>(values), exponent);
}

void change(bool& value) { value = !value; }
void change(Index& value) { value += 2; }
void change(std::optional<double>& value) { value = 0.05; }
void change(DisconnectedRule& value) { value = DisconnectedRule::hold; }
void change(Method& /*method*/) {}

/// The settings of both methods, and each of them with one setting changed.
std::vector<Settings> all_settings() {
  std::vector<Settings> all;
  for (const Method method : {Method::motion, Method::detail}) {
    all.push_back({.method = method});
    for_each_setting([&](const Setting& setting, auto member, auto...) {
      if (setting.method && *setting.method != method) return;
      Settings settings = {.method = method};
      change(settings.*member);
      all.push_back(settings);
    });
  }
  all.push_back({.method = Method::detail,
                 .noise = 0.05,
                 .reject_outliers = true,
                 .learn = true,
                 .uncertainty = true});
  return all;
}

/// What a completer says of frames that bend, with an outlier, in a unit: the frames and standard
/// errors in the unit of exponent 0, and the numbers of the reports.
template <class Real>
std::vector<std::vector<Real>> completed(Settings settings, bool is_trained, int exponent) {
  auto mesh = join(sheet<Real>(6), sheet<Real>(3, 20));
  const std::size_t k = mesh.size();
  const auto original = mesh.vertices;
  mesh.vertices = scaled(original, exponent);
  if (settings.noise) settings.noise = std::ldexp(*settings.noise, exponent);
  std::vector<std::vector<Real>> shown;
  if (is_trained) {
    for (const auto& frame : training_frames_of(original, 6))
      shown.push_back(scaled(frame, exponent));
  }
  auto completer = is_trained
                       ? Completer<Real>(mesh.faces(), mesh.points(), settings, training_of(shown))
                       : Completer<Real>(mesh.faces(), mesh.points(), settings);
  std::vector<std::vector<Real>> results;
  for (unsigned n = 1; n <= 24; ++n) {
    auto frame = bent(original, 0.3 * n);
    if (n == 12) frame[3] += Real{50000};
    const auto known = random_mask(k, 0.5, n);
    results.push_back(scaled(push(completer, scaled(frame, exponent), known), -exponent));
    const StageReport stages = completer.report().stages;
    results.push_back({static_cast<Real>(stages.blend), static_cast<Real>(stages.prior_weight),
                       static_cast<Real>(stages.prior_share)});
    if (settings.uncertainty) results.push_back(scaled(completer.standard_error(), -exponent));
  }
  return results;
}

TEST_CASE_TEMPLATE("completed frames do not depend on the unit of length", Real, float, double) {
  for (const Settings& settings : all_settings()) {
    for (const bool is_trained : {false, true}) {
      if (is_trained && (settings.method != Method::detail || settings.learn)) continue;
      std::string changed;
      for_each_setting([&](const Setting& setting, auto member, auto...) {
        if (settings.*member != Settings{}.*member) changed += std::string(" ") + setting.name;
      });
      CAPTURE(changed);
      const auto expected = completed<Real>(settings, is_trained, 0);
      for (const int exponent : exponents) {
        CAPTURE(exponent);
        CHECK(completed<Real>(settings, is_trained, exponent) == expected);
      }
    }
  }
}

/// The same of a tracker: from points with and without normals and viewpoints, or depth images.
template <class Real>
std::vector<std::vector<Real>> tracked(bool is_trained, bool sees_images, int exponent) {
  const auto mesh = bumpy_torus(12);
  auto scaled_mesh = as_floats(mesh);
  scaled_mesh.vertices = scaled(scaled_mesh.vertices, exponent);
  const Mesh<Real> first = {{scaled_mesh.vertices.begin(), scaled_mesh.vertices.end()},
                            mesh.indices};
  std::vector<std::vector<Real>> shown;
  for (const auto& frame : training_frames_of(mesh.vertices, is_trained ? 5 : 0)) {
    shown.push_back(scaled(std::vector<Real>(frame.begin(), frame.end()), exponent));
  }
  const TrackerSettings settings = {.uncertainty = true};
  auto tracker = is_trained
                     ? Tracker<Real>(first.faces(), first.points(), settings, training_of(shown))
                     : Tracker<Real>(first.faces(), first.points(), settings);
  std::vector<std::vector<Real>> results;
  for (int n = 1; n <= 6; ++n) {
    const auto truth = translated(bent(mesh.vertices, 0.1 * n), 0.1 * n, 0.0, 0.0);
    std::vector<Real> frame(first.vertices.size());
    if (sees_images) {
      auto images = images_of(mesh, truth, 2, 60);
      std::vector<DepthImage> views;
      for (auto& image : images) {
        image.pixels = scaled(image.pixels, exponent);
        for (const std::size_t i : {3, 7, 11}) image.pose[i] = std::ldexp(image.pose[i], exponent);
        views.push_back(image.view());
      }
      tracker.push_depth(views, {frame.data(), tracker.n_vertices()});
    } else {
      auto scan = scan_of(mesh, truth);
      scan.has_normals = n % 3 != 0;
      if (n % 2 == 0) scan.viewpoints = {20, 3, 9};
      std::vector<Real> points(scan.points.begin(), scan.points.end());
      scan.points.assign(points.begin(), points.end());  // rounded alike
      scan.points = scaled(scan.points, exponent);
      scan.viewpoints = scaled(scan.viewpoints, exponent);
      frame = track(tracker, scan);
    }
    CHECK(tracker.report().known > 0);
    results.push_back(scaled(frame, -exponent));
    results.push_back(scaled(tracker.standard_error(), -exponent));
    const StageReport stages = tracker.report().stages;
    results.push_back(
        {static_cast<Real>(stages.prior_weight), static_cast<Real>(stages.prior_share)});
  }
  return results;
}

TEST_CASE_TEMPLATE("tracked frames do not depend on the unit of length", Real, float, double) {
  for (const bool is_trained : {false, true}) {
    for (const bool sees_images : {false, true}) {
      CAPTURE(is_trained);
      CAPTURE(sees_images);
      const auto expected = tracked<Real>(is_trained, sees_images, 0);
      for (const int exponent : exponents) {
        CAPTURE(exponent);
        CHECK(tracked<Real>(is_trained, sees_images, exponent) == expected);
      }
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
