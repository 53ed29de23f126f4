/// The states of completers and trackers.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <dynmesh/completer.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/version.hpp>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "api/report_fields.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "seal.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST_CASE("a forged state is refused, or later frames are finite") {
  const auto mesh = sheet<float>(4);
  const std::size_t k = mesh.size();
  std::vector<Completer<float>> completers;
  completers.push_back(trained(mesh));
  for (const Settings& settings :
       {Settings{.method = Method::motion}, Settings{}, Settings{.learn = true},
        Settings{.noise = 0.01, .uncertainty = true}}) {
    completers.emplace_back(mesh.faces(), mesh.points(), settings);
  }
  std::vector<float> out(3 * k);
  for (auto& completer : completers) {
    const auto push = [&](unsigned n) {
      const auto frame = bent(mesh.vertices, 0.3 * n);
      const auto known = random_mask(k, 0.5, n);
      completer.push({frame.data(), k}, {known.data(), k}, {out.data(), k});
    };
    for (unsigned n = 1; n < 15; ++n) push(n);
    const auto state = completer.state();
    std::size_t n_refused = 0;
    const auto forge = [&](std::size_t place, const auto& value) {
      completer.restore(state);
      auto bytes = state;
      std::memcpy(&bytes[place], &value, sizeof value);
      seal(bytes);
      CAPTURE(place);
      CAPTURE(value);
      try {
        completer.restore(bytes);
      } catch (const std::invalid_argument& error) {
        CHECK(std::string(error.what()).starts_with("state: "));
        CHECK(completer.state() == state);
        ++n_refused;
        return;
      }
      for (unsigned n = 15; n < 18; ++n) push(n);
      for (const float x : out) CHECK(std::isfinite(x));
      CHECK_NOTHROW(completer.restore(completer.state()));
    };
    constexpr std::size_t n_places = 250;
    for (std::size_t i = 0; i < n_places; ++i) {
      const std::size_t place = i * (state.size() - 16) / n_places / 4 * 4;
      for (const double value : {nan, -1.0, 1e300}) forge(place, value);
      for (const float value : {static_cast<float>(nan), 1e30F}) forge(place, value);
      for (const Index value : {-1, 1, 40, std::numeric_limits<Index>::max()}) forge(place, value);
    }
    CHECK(n_refused > 0);
  }
}

TEST_CASE("ages do not overflow") {
  const auto mesh = sheet<float>(4);
  const std::size_t k = mesh.size();
  Completer<float> completer(mesh.faces(), mesh.points());
  auto state = completer.state();
  const Index oldest = std::numeric_limits<Index>::max();
  const std::uint64_t n_frames = oldest;
  std::memcpy(&state[152 + k * 3 * sizeof(double)], &n_frames, sizeof n_frames);
  std::memcpy(&state[160 + 2 * k * 3 * sizeof(double)], &oldest, sizeof oldest);
  seal(state);
  completer.restore(state);
  std::vector<float> out(3 * k);
  completer.skip({out.data(), k});
  CHECK(completer.age()[0] == oldest);
  CHECK(completer.age()[1] == 1);
}

TEST_CASE("a state of another format is refused with the numbers of both") {
  const auto mesh = sheet<double>(4);
  Completer<double> completer(mesh.faces(), mesh.points());
  auto state = completer.state();
  state[7] = std::byte{'7'};
  seal(state);
  CHECK_THROWS_WITH_AS(
      completer.restore(state),
      doctest::Contains("has format 7, but dynmesh " DYNMESH_VERSION " reads format"),
      std::invalid_argument);
}

/// Everything that a stream tells of its last frame, as text, in which NaN equals NaN, but for the
/// times.
template <class Stream>
std::map<std::string, std::string> told_by(const Stream& stream) {
  std::map<std::string, std::string> told;
  const auto tell = [&](const std::string& name, const auto& value) {
    std::ostringstream text;
    text << std::hexfloat;
    if constexpr (std::is_enum_v<std::remove_cvref_t<decltype(value)>>) {
      text << static_cast<int>(value);
    } else if constexpr (requires { text << value; }) {
      text << value;
    } else if constexpr (requires { std::string(value.data()); }) {
      text << value.data();
    } else {
      for (const auto& one : value) text << one << ' ';
    }
    told[name] = text.str();
  };
  const auto report = stream.report();
  for_each_field(report, [&](const std::string& name, const auto& value, auto...) {
    if (!name.ends_with("seconds")) tell(name, value);
  });
  if constexpr (requires { report.measure; }) {
    tell("is_start", report.measure.is_start);
    tell("quality of the measure", report.measure.quality);
    tell("observed", std::vector<int>(stream.observed().begin(), stream.observed().end()));
  }
  tell("n_frames", stream.n_frames());
  tell("generation", stream.generation());
  tell("age", stream.age());
  if (stream.settings().uncertainty) tell("standard_error", stream.standard_error());
  return told;
}

/// What a stream told, and the state in which it did.
struct Moment {
  std::string name;
  std::vector<std::byte> state;
  std::map<std::string, std::string> told;
};

/// Restores all moments in this stream, in another order than that in which they were.
template <class Stream>
void check_restored(Stream& stream, const std::vector<Moment>& moments) {
  for (std::size_t i = 0; i < 2 * moments.size(); ++i) {
    const Moment& moment = moments[i * 3 % moments.size()];
    CAPTURE(moment.name);
    stream.restore(moment.state);
    const auto told = told_by(stream);
    for (const auto& [name, value] : moment.told) {
      CAPTURE(name);
      CHECK(told.at(name) == value);
    }
    CHECK(stream.report().seconds == 0);
    CHECK(stream.report().stages.solve_seconds == 0);
    CHECK(stream.state() == moment.state);
  }
}

TEST_CASE_TEMPLATE("a restored completer tells what the original did", Real, float, double) {
  for (const bool is_flat : {false, true}) {
    auto mesh = join(sheet<Real>(8), sheet<Real>(4, 30));
    if (is_flat) std::ranges::fill(mesh.vertices, Real{1});
    const std::size_t k = mesh.size();
    std::vector<Completer<Real>> completers;
    if (!is_flat) completers.push_back(trained(mesh, {.uncertainty = true}));
    for (const Settings& settings :
         {Settings{.method = Method::motion}, Settings{.uncertainty = true},
          Settings{.noise = 0.01, .reject_outliers = true}, Settings{.learn = true}}) {
      completers.emplace_back(mesh.faces(), mesh.points(), settings);
    }
    for (auto& completer : completers) {
      CAPTURE(completer.settings().uncertainty);
      CAPTURE(completer.settings().learn);
      std::vector<Moment> moments;
      std::vector<Real> out(3 * k);
      const auto remember = [&](const char* name) {
        moments.push_back({name, completer.state(), told_by(completer)});
      };
      const auto push = [&](const std::vector<Real>& frame, double share) {
        const auto known = random_mask(k, share, static_cast<unsigned>(moments.size()));
        completer.push({frame.data(), k}, {known.data(), k}, {out.data(), k});
      };
      remember("frame 0");
      push(bent(mesh.vertices, 0.3), 0.5);
      remember("a frame");
      completer.skip({out.data(), k});
      remember("nothing known");
      push(bent(mesh.vertices, 0.5), 1);
      remember("all known");
      std::vector<Real> reversed(mesh.vertices.rbegin(), mesh.vertices.rend());
      for (Real& x : reversed) x *= 40;
      push(reversed, 0.7);
      remember("ruined");
      push(bent(mesh.vertices, 0.6), 0.02);
      remember("after a ruined frame");
      completer.reset({reversed.data(), k});
      remember("another frame 0");
      push(reversed, 0.4);
      remember("a frame after a reset");
      check_restored(completer, moments);
      if (completer.settings().learn || moments.size() > 8) continue;
      if (completer.settings().uncertainty && !is_flat) continue;  // the one with training
      Completer<Real> other(mesh.faces(), {reversed.data(), k}, completer.settings());
      check_restored(other, moments);
    }
  }
}

TEST_CASE("a restored tracker tells what the original did") {
  const auto mesh = bumpy_torus(20);
  const std::size_t k = mesh.size();
  for (const TrackerSettings& settings :
       {TrackerSettings{}, TrackerSettings{.uncertainty = true, .recover = true},
        TrackerSettings{.recover = true, .resolution = 100}}) {
    CAPTURE(settings.recover);
    Tracker<double> tracker(mesh.faces(), mesh.points(), settings);
    std::vector<Moment> moments;
    std::vector<double> out(3 * k);
    const auto remember = [&](const char* name) {
      moments.push_back({name, tracker.state(), told_by(tracker)});
    };
    remember("frame 0");
    tracker.skip({out.data(), k});
    remember("nothing measured from the start");
    auto larger = mesh.vertices;
    for (double& x : larger) x *= 1.09;
    track(tracker, scan_of(mesh, larger));
    CHECK(tracker.report().quality == Quality::doubtful);
    remember("a doubtful frame at the start");
    track(tracker, scan_of(mesh, mesh.vertices));
    CHECK(tracker.report().quality == Quality::good);
    CHECK(tracker.report().measure.is_start);
    remember("the first good frame");
    track(tracker, scan_of(mesh, bent(mesh.vertices, 0.1)));
    remember("a frame");
    tracker.skip({out.data(), k});
    remember("nothing measured");
    track(tracker, scan_of(mesh, translated(mesh.vertices, 9.0, 2.0, 0.0)));
    remember("a frame far away");
    auto other_size = turned(mesh.vertices, 2.1);
    for (double& x : other_size) x *= 0.4;
    track(tracker, scan_of(mesh, other_size));
    CHECK(tracker.report().quality == Quality::ruined);
    remember("a scan of something else");
    track(tracker, scan_of(mesh, mesh.vertices));
    remember("after it");
    tracker.reset({larger.data(), k});
    remember("another template");
    check_restored(tracker, moments);
    Tracker<double> other(mesh.faces(), {larger.data(), k}, settings);
    check_restored(other, moments);
  }
}
}  // namespace
}  // namespace dynmesh::testing
