#include <doctest/doctest.h>

#include <cstring>
#include <dynmesh/completer.hpp>
#include <dynmesh/version.hpp>
#include <limits>

#include "meshes.hpp"
#include "seal.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST_CASE("a forged state is refused if later frames could not handle it") {
  const auto mesh = sheet<float>(4);
  const std::size_t k = mesh.size();
  for (const Method method : {Method::motion, Method::detail}) {
    Completer<float> completer(mesh.faces(), mesh.points(), {.method = method});
    const auto state = completer.state();
    const std::size_t facts = 100;  // the offset of the details of the last frame, after the header
    const std::size_t frames = 156;  // the offset of frame 0
    const std::size_t ages = frames + 2 * k * 3 * sizeof(float);
    const std::size_t masks = ages + k * sizeof(Index);
    const std::size_t rows = masks + k;
    const auto refused = [&](std::size_t offset, const auto& value, const std::string& why) {
      auto bytes = state;
      std::memcpy(&bytes[offset], &value, sizeof value);
      seal(bytes);
      CHECK(message_of([&] { completer.restore(bytes); }).find(why) != std::string::npos);
      CHECK(completer.state() == state);
    };
    refused(facts - 6 * sizeof(double), -0.0, "extra_iterations is -0, not 0");
    refused(facts, std::int64_t{-1}, "reports 18446744073709551615 iterations");
    refused(facts, std::int64_t{1} << 32, "reports 4294967296 iterations");
    refused(facts + 8, std::uint64_t{1}, "reports 1 outliers, but only 0 vertices were unknown");
    for (const std::size_t field : {16U, 24U, 32U, 40U}) refused(facts + field, nan, "not finite");
    refused(ages + sizeof(Index), Index{1}, "vertex 1 has the age 1 after 0 frames");
    refused(frames, std::numeric_limits<float>::quiet_NaN(), "not finite");
    refused(ages - sizeof(float), 1e30F, "position of vertex 15");
    refused(ages + sizeof(Index), Index{-1}, "vertex 1 has the age -1");
    refused(masks + 2, std::uint8_t{2}, "the mask 2");
    if (method == Method::detail) {
      refused(rows, 2.0, "holds a rotation that is none");
      refused(state.size() - 24, nan, "not finite");  // the share of the first-order step
    }
    // It is refused for no other reason.
    CHECK_NOTHROW(completer.restore(state));
    // The number of frames does not start again at 0, where ages would exceed it.
    auto bytes = state;
    const auto most = std::numeric_limits<std::uint64_t>::max();
    std::memcpy(&bytes[facts + 48], &most, sizeof most);
    seal(bytes);
    completer.restore(bytes);
    std::vector<float> out(3 * k);
    for (int n = 0; n < 2; ++n) completer.skip({out.data(), k});
    CHECK_NOTHROW(completer.restore(completer.state()));
    if (method == Method::detail) {  // nor does that of the first-order step
      bytes = state;
      std::memcpy(&bytes[bytes.size() - 16], &most, sizeof most);
      seal(bytes);
      completer.restore(bytes);
      const auto known = random_mask(k, 0.5, 1);
      CHECK_NOTHROW(completer.push(mesh.points(), {known.data(), k}, {out.data(), k}));
    }
  }

  SUBCASE("of a training sequence") {
    auto completer = trained(mesh);
    std::vector<float> out(3 * k);
    const auto frame = bent(mesh.vertices, 0.3);
    const auto known = random_mask(k, 0.5, 1);
    completer.push({frame.data(), k}, {known.data(), k}, {out.data(), k});
    const auto state = completer.state();
    const std::size_t pose = state.size() - 8 - (4 + 13 * 16) * 8;
    const auto with = [&](std::size_t place, double value) {
      auto bytes = state;
      std::memcpy(&bytes[pose + 8 * place], &value, sizeof value);
      seal(bytes);
      return bytes;
    };
    const auto refused = [&](std::size_t place, double value, const std::string& why) {
      CHECK(message_of([&] { completer.restore(with(place, value)); }) == "state: holds " + why);
      CHECK(completer.state() == state);
    };
    for (std::size_t place = 0; place < 4 + 13 * 16; place += 7) {
      refused(place, nan, "a number that is not finite");
    }
    for (const std::size_t place : {4, 211}) refused(place, 1e7, "a pose far out of any range");
    // With every other value, later frames are finite, and so are their states.
    for (const double value : {-1.0, 0.0, 1e-300, 1e300}) {
      for (const std::size_t place : {0, 1, 2, 3}) {
        completer.restore(with(place, value));
        for (int n = 0; n < 3; ++n) {
          completer.push({frame.data(), k}, {known.data(), k}, {out.data(), k});
          CHECK_NOTHROW(completer.restore(completer.state()));
        }
        for (const float x : out) CHECK(std::abs(x) < 100);
      }
    }
  }
  SUBCASE("of a completer that learns") {
    Completer<float> completer(mesh.faces(), mesh.points(),
                               {.method = Method::detail, .learn = true});
    std::vector<float> out(3 * k);
    const auto push = [&](unsigned n) {
      const auto frame = bent(mesh.vertices, 0.3 * n);
      const auto known = random_mask(k, 0.5, n);
      completer.push({frame.data(), k}, {known.data(), k}, {out.data(), k});
    };
    for (unsigned n = 1; n < 15; ++n) push(n);
    const auto state = completer.state();
    const std::size_t factors = state.size() - 8 - 13 * 32 * 16 * sizeof(float);
    const std::size_t combination =
        8 + 32 * sizeof(Index);  // the number of shapes, and their slots
    const std::size_t used = factors - 2 * combination;
    const std::size_t slices = used - 2 * sizeof(Index);  // and a flag
    const std::size_t shapes = slices - k * 96 * sizeof(float);
    const std::size_t order = shapes - 32 * sizeof(Index);
    const std::size_t members = order - 8;
    const auto with = [&](std::size_t offset, const auto& value) {
      auto bytes = state;
      std::memcpy(&bytes[offset], &value, sizeof value);
      seal(bytes);
      return bytes;
    };
    const auto refused = [&](std::size_t offset, const auto& value) {
      CAPTURE(offset);
      CAPTURE(value);
      CHECK(message_of([&] { completer.restore(with(offset, value)); }).starts_with("state: "));
      CHECK(completer.state() == state);
    };
    refused(members, std::uint64_t{29});  // more shapes than the library keeps
    for (const Index slot : {-1, 8, 32}) refused(order, slot);  // none, or twice
    for (const Index slice : {-1, 5}) refused(slices, slice);
    for (const std::size_t of : {used, used + combination}) {
      refused(of, std::uint64_t{33});
      for (const Index slot : {-1, 32}) refused(of + 8, slot);
    }
    for (std::size_t place = 0; place < 13 * 32 * 16; place += 97) {
      refused(factors + 4 * place, static_cast<float>(nan));
    }
    for (std::size_t place = 0; place < k * 96; place += 13) {
      refused(shapes + 4 * place, static_cast<float>(nan));
    }
    // With every other value, later frames are finite, and so are their states.
    for (std::size_t place = members; place < factors; place += 4) {
      if (place == shapes) place = slices;
      for (const Index value : {0, 1, 4, 31}) {
        try {
          completer.restore(with(place, value));
        } catch (const std::invalid_argument&) {
          continue;
        }
        for (unsigned n = 15; n < 22; ++n) push(n);
        CHECK_NOTHROW(completer.restore(completer.state()));
        for (const float x : out) CHECK(std::abs(x) < 100);
      }
    }
  }
  SUBCASE("ages do not overflow") {
    Completer<float> completer(mesh.faces(), mesh.points());
    auto state = completer.state();
    const Index oldest = std::numeric_limits<Index>::max();
    const std::uint64_t n_frames = oldest;
    std::memcpy(&state[148], &n_frames, sizeof n_frames);
    std::memcpy(&state[156 + 2 * k * 3 * sizeof(float)], &oldest, sizeof oldest);
    seal(state);
    completer.restore(state);
    std::vector<float> out(3 * k);
    completer.skip({out.data(), k});
    CHECK(completer.age()[0] == oldest);
    CHECK(completer.age()[1] == 1);
  }
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
