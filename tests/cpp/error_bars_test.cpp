#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <cstring>
#include <dynmesh/completer.hpp>
#include <limits>
#include <string>
#include <vector>

#include "meshes.hpp"
#include "push.hpp"
#include "seal.hpp"

namespace dynmesh::testing {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr Settings with_bars = {.method = Method::detail, .uncertainty = true};

template <class Real>
std::vector<Real> bars(const Completer<Real>& completer) {
  const auto values = completer.standard_error();
  return {values.begin(), values.end()};
}

TEST_CASE("forged standard errors in a state are refused, or harmless") {
  const auto mesh = sheet<double>(4);
  const std::size_t k = mesh.size();
  Completer<double> completer(mesh.faces(), mesh.points(), with_bars);
  const auto frame = turned(mesh.vertices, 0.2);
  const auto known = random_mask(k, 0.7, 1);
  push(completer, frame, known);
  const auto state = completer.state();
  const std::size_t numbers = 21 * k + 3;
  const std::size_t frames = 20 * k + 2;  // the number of frames, which is an integer
  const std::size_t errors = state.size() - 8 * (numbers + 1);
  const auto with = [&](std::size_t place, double value) {
    auto bytes = state;
    std::memcpy(&bytes[errors + 8 * place], &value, sizeof value);
    seal(bytes);
    return bytes;
  };
  for (std::size_t place = 0; place < numbers; ++place) {
    CAPTURE(place);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (place != frames) {
      CHECK(message_of([&] { completer.restore(with(place, nan)); }).starts_with("state: holds "));
    }
    CHECK(completer.state() == state);
    if (place % 7 != 0 && place < 20 * k) continue;
    for (const double value : {0.0, -1.0, 1.0, 1e-300, 1e49, 1e300, infinite}) {
      try {
        completer.restore(with(place, value));
      } catch (const std::invalid_argument&) {
        continue;
      }
      for (int n = 0; n < 3; ++n) {
        push(completer, frame, known);
        for (const double bar : bars(completer)) CHECK(bar >= 0);
        CHECK_NOTHROW(completer.restore(completer.state()));
      }
    }
    completer.restore(state);
  }
}

TEST_CASE_TEMPLATE("the C interface copies standard errors", Real, float, double) {
  const auto mesh = sheet<Real>(5);
  const auto k = static_cast<std::int64_t>(mesh.size());
  const std::int32_t type = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;
  const dynmesh_points first = {mesh.vertices.data(), k, 3, 1, type};
  dynmesh_settings settings;
  REQUIRE(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK);
  CHECK(settings.uncertainty == 0);
  settings.method = DYNMESH_METHOD_DETAIL;
  settings.uncertainty = 1;
  dynmesh_completer* handle = nullptr;
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  REQUIRE(dynmesh_create(mesh.indices.data(), n_faces, &first, &settings, &handle) == DYNMESH_OK);
  Completer<Real> completer(mesh.faces(), mesh.points(), with_bars);
  const auto frame = turned(mesh.vertices, 0.2);
  const auto known = random_mask(mesh.size(), 0.4, 2);
  push(completer, frame, known);
  std::vector<Real> completed(3 * mesh.size());
  const dynmesh_points points = {frame.data(), k, 3, 1, type};
  const dynmesh_mask mask = {known.data(), k, 1};
  const dynmesh_output out = {completed.data(), k, 3, 1, type};
  dynmesh_frame_report report{};
  CHECK(dynmesh_push(handle, &points, &mask, &out, &report) == DYNMESH_OK);
  CHECK(report.standard_error == completer.report().standard_error);
  std::vector<Real> found(mesh.size(), 7);
  const auto refused = [&](void* values, std::int64_t count, std::int32_t of, const char* why) {
    CHECK(dynmesh_standard_error(handle, values, count, of) == DYNMESH_INVALID_ARGUMENT);
    CHECK(std::string(dynmesh_last_message()).starts_with(why));
    CHECK(found[0] == 7);
  };
  refused(found.data(), k - 1, type, "count:");
  refused(found.data(), k, 96 - type, "type:");
  CHECK(dynmesh_standard_error(handle, found.data(), k, type) == DYNMESH_OK);
  CHECK(found == bars(completer));
  dynmesh_destroy(handle);
}

}  // namespace
}  // namespace dynmesh::testing
