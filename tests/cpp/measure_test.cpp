/// How good a mesh in a scan is, by what is measured of it.
#include "quality/measure.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <dynmesh/quality.hpp>
#include <dynmesh/topology.hpp>
#include <vector>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

struct Situation {
  const char* name;
  Measure measure;
  Quality quality;
  Cause cause = Cause::place;  // if it is not good
};

TEST_CASE("what speaks against a mesh makes it doubtful or ruined, for the cause that it tells") {
  const auto agreement = [](double far, double disagreeing) {
    return Agreement{1000, far, disagreeing, 0.1};
  };
  const Agreement near = agreement(0, 0);
  const std::array situations = {
      Situation{"nothing", {}, Quality::good},
      Situation{"some of each, and little", {near, 0.01, 0.01, 0.0005, 0.02}, Quality::good},
      Situation{"some of each", {near, 0.01, 0.01, 0.001, 0.06}, Quality::doubtful},
      Situation{"unexplained points", {near, 0.04}, Quality::doubtful},
      Situation{"a hole", {near, 0, 0.05}, Quality::doubtful},
      Situation{"a large hole", {near, 0, 0.45}, Quality::doubtful, Cause::part},
      Situation{"half of it on the other half", {near, 0, 0, 0.5}, Quality::doubtful, Cause::part},
      Situation{"far points", {agreement(0.3, 0), 0.3, 0.5}, Quality::ruined, Cause::pose},
      Situation{"edges", {near, 0, 0, 0, 0.135}, Quality::doubtful},
      Situation{"long edges", {near, 0, 0, 0, 0.2}, Quality::doubtful, Cause::pose},
      Situation{"very long edges", {near, 0, 0, 0, 0.35}, Quality::ruined, Cause::pose},
      Situation{"all edges longer", {near, 0, 0, 0, 0.5, 2}, Quality::ruined, Cause::size},
      Situation{"all edges shorter", {near, 0, 0, 0, 0.5, 0.5}, Quality::ruined, Cause::size},
  };
  for (const Situation& one : situations) {
    CAPTURE(one.name);
    Measure measure = one.measure;
    measure.quality = judged(measure);
    CHECK(measure.quality == one.quality);
    CHECK(measure.reason().empty() == (one.quality == Quality::good));
    if (one.quality != Quality::good) CHECK(measure.cause() == one.cause);
  }
}

TEST_CASE("a mesh has grown by its median edge, whatever has become of a part of it") {
  const auto mesh = sheet<double>(20);
  const auto before = rows_of(mesh.vertices);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  const std::vector<std::uint8_t> observed(mesh.size(), 1);
  auto after = before;
  for (auto& x : after) x = (x.y > 13 ? 9.0 : 2.0) * x;
  CHECK(measured({}, observed, topology.cells, before, after).growth == doctest::Approx(2));
}

}  // namespace
}  // namespace dynmesh::testing
