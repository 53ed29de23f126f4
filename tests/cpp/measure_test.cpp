/// How good a mesh in a scan is, by what is measured of it.
#include "quality/measure.hpp"

#include <doctest/doctest.h>

#include <array>
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
  const auto made = [](Measure measure) {
    measure.agreement = {1000, 0, 0, 0.1};
    return measure;
  };
  using enum Quality;
  const std::array situations = {
      Situation{"nothing", {}, good},
      Situation{"other things", made({.others = 0.6}), good},
      Situation{"some of each, and little",
                made({.hole = 0.01, .stretch = 0.03, .contradicted = 0.02}), good},
      Situation{"some of each", made({.hole = 0.01, .stretch = 0.06, .contradicted = 0.02}),
                doubtful},
      Situation{"little is missing", made({.explained = 0.91}), good},
      Situation{"a part is missing", made({.explained = 0.85}), doubtful},
      Situation{"hardly anything is there", made({.explained = 0.2}), ruined, Cause::pose},
      Situation{"nothing is seen, and few points are elsewhere", made({.others = 0.4, .seen = 0}),
                doubtful, Cause::unseen},
      Situation{"nothing is seen, and most points are elsewhere", made({.others = 0.9, .seen = 0}),
                doubtful, Cause::pose},
      Situation{"a hole", made({.hole = 0.06}), doubtful},
      Situation{"a large hole", made({.hole = 0.45}), doubtful, Cause::part},
      Situation{"seen through", made({.contradicted = 0.2}), ruined, Cause::pose},
      Situation{"edges", made({.stretch = 0.135}), doubtful, Cause::pose},
      Situation{"very long edges", made({.stretch = 0.35}), ruined, Cause::pose},
      Situation{"another size", made({.stretch = 0.35, .growth = 2}), ruined, Cause::size},
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

TEST_CASE("a shape that leaps is lost, and one that always moves as fast is not") {
  for (const double usual : {0.005, 0.03}) {
    for (const double change : {0.005, 0.03, 0.07}) {
      Before before;
      Measure frame{.agreement = {1000, 0, 0, 0.1}, .stretch = 0.02, .change = usual};
      for (int i = 0; i < 20; ++i) add_frame(frame, before.recent);
      CAPTURE(usual);
      CAPTURE(change);
      Measure next = frame;
      next.change = change;
      CHECK(judged(next, before) == Quality::good);  // while it is the shape of recent frames
      next.stretch = 0.02 + change;
      CHECK((judged(next, before) == Quality::ruined) == (usual < 0.01 && change > 0.05));
    }
  }
}

TEST_CASE("near the limit, more is asked than how far edges changed") {
  for (const double change : {0.02, 0.034, 0.05, 0.2}) {
    for (const double times : {0.3, 1.0, 3.0}) {
      int asked = 0;
      Before before;
      before.times_likely = [&](double) {
        ++asked;
        return times;
      };
      Measure frame{.agreement = {1000, 0, 0, 0.1}, .stretch = 0.02, .change = 0.005};
      for (int i = 0; i < 20; ++i) add_frame(frame, before.recent);
      CAPTURE(change);
      CAPTURE(times);
      frame.stretch = 0.02 + change;
      frame.change = change;
      const bool is_open = change > 0.03 && change < 0.1;
      const bool is_lost = change > 0.1 || (is_open && times * change / 0.035 > 1);
      CHECK((judged(frame, before) == Quality::ruined) == is_lost);
      CHECK(asked == (is_open ? 1 : 0));
    }
  }
}

TEST_CASE("a surface bends elsewhere if edges change where they did not before") {
  const Mesh<double> mesh = sheet<double>(20);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  const auto bent = [&](double left, double right) {
    std::vector<Vector3> frame = rows_of(mesh.vertices);
    for (auto& x : frame) {
      if (x.x < 12) x.y *= 1 + left;
      if (x.x > 17) x.y *= 1 + right;
    }
    return frame;
  };
  const auto first = bent(0, 0);
  const auto before = bent(0.02, 0.001);
  CHECK(bent_elsewhere(topology.cells, first, before, bent(0.1, 0.005)) < 0.05);
  CHECK(bent_elsewhere(topology.cells, first, before, bent(0.02, 0.05)) > 0.2);
}

TEST_CASE("what was lost stays lost until its shape is nearer to that of the good frames") {
  for (const bool was_lost : {false, true}) {
    for (const double departure : {0.01, 0.02, 0.04}) {
      Before before{.was_misplaced = was_lost};
      Measure frame{.agreement = {1000, 0, 0, 0.1}, .stretch = 0.02, .change = 0.005};
      for (int i = 0; i < 20; ++i) add_frame(frame, before.recent);
      CAPTURE(was_lost);
      CAPTURE(departure);
      frame.stretch += departure;
      frame.change = 0.05;
      const double most = was_lost ? 0.015 : 0.03;
      CHECK((judged(frame, before) == Quality::ruined) == (departure > most));
    }
  }
}

TEST_CASE("parts that come apart at once, while something speaks against it, are lost") {
  for (const double usual : {0.01, 0.3}) {
    for (const double contradicted : {0.01, 0.03}) {
      Before before;
      Measure frame{.agreement = {1000, 0, 0, 0.1}, .parted = usual};
      for (int i = 0; i < 20; ++i) add_frame(frame, before.recent);
      CAPTURE(usual);
      CAPTURE(contradicted);
      Measure next = frame;
      next.parted = 0.4;
      next.contradicted = contradicted;
      CHECK((judged(next, before) == Quality::ruined) == (usual < 0.1 && contradicted > 0.02));
    }
  }
}

TEST_CASE("places part that were near each other, and are not any more") {
  const std::vector<Vector3> before = {{0, 0, 0}, {1, 0, 0}, {0, 3, 0}, {1, 3, 0}};
  const std::vector<Tie> ties = {{.i = 0, .j = 1, .weight = 3}, {.i = 2, .j = 3, .weight = 1}};
  std::vector<Vector3> after = {{0, 0, 5}, {0, 1, 5}, {0, 3, 0}, {6, 3, 0}};  // the first turned
  CHECK(parted_share(ties, before, after, 1) == doctest::Approx(0.25));
  CHECK(parted_share(ties, before, after, 2) == 0);
  CHECK(parted_share({}, before, after, 1) == 0);
}

TEST_CASE("slow growth is that of the subject, and sudden growth that of a unit") {
  Before before;
  Measure frame{.agreement = {1000, 0, 0, 0.1}};
  for (; frame.growth < 2; frame.growth *= 1.02) {
    CHECK(judged(frame, before) == Quality::good);
    add_frame(frame, before.recent);
  }
  frame.growth *= 1.1;
  CHECK(judged(frame, before) == Quality::ruined);
}

TEST_CASE("what sensors always miss is expected, and without sensors, what was seen so far") {
  for (const bool knows_sensors : {false, true}) {
    CAPTURE(knows_sensors);
    Before before{.knows_sensors = knows_sensors};
    Measure frame{.agreement = {1000, 0, 0, 0.1}};
    frame.explained = knows_sensors ? 0.8 : 0.5;
    frame.is_start = true;
    CHECK(judged(frame, before) == Quality::good);
    frame.quality = Quality::good;
    for (int i = 0; i < 20; ++i) add_frame(frame, before.recent);
    frame.is_start = false;
    CHECK(judged(frame, before) == Quality::good);
    frame.explained -= 0.15;
    CHECK(judged(frame, before) == Quality::doubtful);
  }
}

TEST_CASE("a template that slowly goes wrong does not make it usual that points are missing") {
  Before before;
  Measure frame{.agreement = {1000, 0, 0, 0.1}};
  for (int i = 0; i < 20; ++i) add_frame(frame, before.recent);
  int doubtful = 0;
  for (int i = 0; i < 15; ++i) {
    frame.explained -= 0.018;
    doubtful += judged(frame, before) == Quality::doubtful ? 1 : 0;
    add_frame(frame, before.recent);
  }
  CHECK(doubtful >= 5);
}

TEST_CASE("doubtful frames do not make it usual that much of a surface has no points") {
  for (const double missing : {0.12, 0.28}) {
    CAPTURE(missing);
    Before before{.knows_sensors = false};
    Measure frame{.agreement = {1000, 0, 0, 0.1}};
    for (int i = 0; i < 5; ++i) add_frame(frame, before.recent);
    frame.explained = 1 - missing;
    for (int i = 0; i < 30; ++i) {
      frame.quality = judged(frame, before);
      CHECK((i > 0 || frame.quality == Quality::doubtful));
      add_frame(frame, before.recent);
    }
    CHECK((judged(frame, before) == Quality::good) == (missing < 0.2));
  }
}

TEST_CASE("a mesh has grown by its median edge, whatever has become of a part of it") {
  const auto mesh = sheet<double>(20);
  const auto before = rows_of(mesh.vertices);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  auto after = before;
  for (auto& x : after) x = (x.y > 13 ? 9.0 : 2.0) * x;
  CHECK(change_of(topology.cells, before, after).growth == doctest::Approx(2));
}

}  // namespace
}  // namespace dynmesh::testing
