/// The floating-point environment of the program that calls: results do not depend on it, and it
/// stays as it is.
#include <doctest/doctest.h>

#include <algorithm>
#include <cfenv>
#include <dynmesh/completer.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <functional>
#include <limits>
#include <vector>

#include "meshes.hpp"
#include "scans.hpp"

namespace dynmesh::testing {
namespace {

using Frame = std::vector<double>;

/// Frames with few or no known vertices, which completers get with their mask, and with NaN for the
/// unknown ones.
template <class Real>
struct Incomplete {
  Mesh<Real> mesh = join(sheet<Real>(8), sheet<Real>(3, 20));
  std::size_t k = mesh.size();
  std::vector<std::vector<Real>> frames, marked;
  std::vector<std::vector<std::uint8_t>> masks;

  Incomplete() {
    for (unsigned n = 1; n < 5; ++n) {
      frames.push_back(turned(mesh.vertices, 0.1 * n));
      masks.push_back(random_mask(k, n == 2 ? 0 : 0.05 * n, n));
      marked.push_back(frames.back());
      for (std::size_t v = 0; v < k; ++v) {
        if (masks.back()[v] == 0) marked.back()[3 * v] = std::numeric_limits<Real>::quiet_NaN();
      }
    }
  }

  [[nodiscard]] Frame completed_by(const Settings& settings) const {
    Completer<Real> completer(mesh.faces(), mesh.points(), settings);
    std::vector<Real> out(3 * k);
    Frame all;
    for (std::size_t n = 0; n < frames.size(); ++n) {
      completer.push({frames[n].data(), k}, {masks[n].data(), k}, {out.data(), k});
      completer.push({marked[n].data(), k}, {out.data(), k});
      all.insert(all.end(), out.begin(), out.end());
      completer.restore(completer.state());
    }
    return all;
  }
};

/// What a tracker and a registration get.
struct Measured {
  Mesh<double> mesh = bumpy_torus(10);
  std::size_t k = mesh.size();
  Samples first = scan_of(mesh, turned(mesh.vertices, 0.03));
  Samples second = scan_of(mesh, turned(mesh.vertices, 0.06));
  Samples elsewhere = scan_of(mesh, turned(mesh.vertices, 0.3));
  Image image = images_of(mesh, turned(mesh.vertices, 0.09), 1, 60).front();

  Measured() {
    second.has_normals = false;
    image.pixels[0] = std::numeric_limits<float>::quiet_NaN();
  }

  [[nodiscard]] Frame tracked() const {
    Tracker<double> tracker(mesh.faces(), mesh.points(), {.uncertainty = true});
    track(tracker, first);
    Frame all = track(tracker, second);
    Frame out(3 * k);
    const DepthImage view = image.view();
    tracker.push_depth({&view, 1}, {out.data(), k});
    all.insert(all.end(), out.begin(), out.end());
    tracker.skip({out.data(), k});
    return all;
  }
  [[nodiscard]] Frame registered() const {
    return register_template<double>(mesh.faces(), mesh.points(), view_of(elsewhere)).vertices;
  }
};

TEST_CASE("results do not depend on the floating-point environment, which stays as it is") {
  const Incomplete<float> floats;
  const Incomplete<double> doubles;
  const Measured measured;
  const std::vector<std::function<Frame()>> calls = {
      [&] { return floats.completed_by({.method = Method::motion}); },
      [&] { return doubles.completed_by({.method = Method::motion, .revisit = false}); },
      [&] { return floats.completed_by({.uncertainty = true}); },
      [&] { return doubles.completed_by({.noise = 0.01, .learn = true}); },
      [&] { return measured.tracked(); },
      [&] { return measured.registered(); },
  };
  for (std::size_t i = 0; i < calls.size(); ++i) {
    CAPTURE(i);
    const Frame expected = calls[i]();
    std::feclearexcept(FE_ALL_EXCEPT);
    std::fesetround(FE_UPWARD);
#ifdef __GLIBC__
    // A signal would end this program.
    constexpr int traps = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
    feenableexcept(traps);
#endif
    const Frame found = calls[i]();
    CHECK(std::fegetround() == FE_UPWARD);
#ifdef __GLIBC__
    CHECK(fegetexcept() == traps);
    fedisableexcept(FE_ALL_EXCEPT);
#endif
    std::fesetround(FE_TONEAREST);
    CHECK(found == expected);
  }
}

}  // namespace
}  // namespace dynmesh::testing
