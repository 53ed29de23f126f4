#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <dynmesh/completer.hpp>
#include <dynmesh/version.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "meshes.hpp"
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
  std::memcpy(&state[152], &n_frames, sizeof n_frames);
  std::memcpy(&state[160 + 2 * k * 3 * sizeof(float)], &oldest, sizeof oldest);
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

TEST_CASE("a completer can be moved") {
  const auto mesh = sheet<double>(5);
  const auto known = random_mask(mesh.size(), 0.4, 1);
  const auto push = [&](Completer<double>& completer) {
    auto frame = turned(mesh.vertices, 0.2);
    const Points<double> points(frame.data(), mesh.size());
    completer.push(points, {known.data(), known.size()}, points);
    return frame;
  };
  std::vector<Completer<double>> completers;
  for (int i = 0; i < 5; ++i) completers.emplace_back(mesh.faces(), mesh.points());
  Completer<double> last = std::move(completers[0]);
  CHECK(push(last) == push(completers[1]));
}

}  // namespace
}  // namespace dynmesh::testing
