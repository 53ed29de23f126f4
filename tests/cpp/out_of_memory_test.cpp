/// Makes each allocation of each function fail in turn. The completer must be unchanged.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <array>
#include <dynmesh/completer.hpp>
#include <dynmesh/tracker.hpp>
#include <new>
#include <optional>

#include "counted_memory.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "shared_work.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

/// The settings of a completer, and whether it learns from a training sequence.
struct Subject {
  Settings settings;
  bool is_trained = false;
};

template <class Real>
struct World {
  Mesh<Real> mesh = join(sheet<Real>(5), sheet<Real>(2, 9.0));
  std::size_t k = mesh.size();
  std::vector<Real> completed = std::vector<Real>(3 * k);
  std::vector<Real> moved = turned(mesh.vertices, 0.2);
  std::vector<std::uint8_t> known = random_mask(k, 0.3, 2);
  std::vector<Index> indices = {4, 2, 7, 25, 26, 27};
  Settings settings;
  std::optional<Training<Real>> training;
  std::vector<std::byte> start;

  explicit World(const Subject& subject) : settings(subject.settings) {
    if (subject.is_trained) training = training_of(training_frames_of(mesh.vertices, 4));
    Completer<Real> completer = make();
    const auto other_start = turned(mesh.vertices, 1.0);
    completer.reset({other_start.data(), k});
    const unsigned n_frames = settings.learn ? 14 : 4;  // modes are in use, and in the making
    for (unsigned frame = 1; frame < n_frames; ++frame) {
      const auto points = turned(mesh.vertices, 1.0 + 0.05 * frame);
      const auto seen = random_mask(k, 0.8, frame);
      completer.push({points.data(), k}, {seen.data(), k}, out());
    }
    start = completer.state();
    std::ranges::fill(known.begin() + 25, known.end(),
                      std::uint8_t{0});  // one component is disconnected
  }

  [[nodiscard]] Points<Real> out() { return {completed.data(), k}; }
  [[nodiscard]] Completer<Real> make() {
    if (training) return {mesh.faces(), mesh.points(), settings, *training};
    return {mesh.faces(), mesh.points(), settings};
  }
  [[nodiscard]] Completer<Real> begun() {
    Completer<Real> completer = make();
    completer.restore(start);
    return completer;
  }
  void push(Completer<Real>& completer) {
    completer.push({moved.data(), k}, {known.data(), k}, out());
  }

  /// Makes each allocation of `call` fail and checks that the completer is unchanged.
  template <class Call>
  int leaves_all_as_it_was(const Call& call) {
    Completer<Real> twin = begun();
    const std::vector<Index> generation(twin.generation().begin(), twin.generation().end());
    const std::vector<Index> age(twin.age().begin(), twin.age().end());
    const FrameReport report = twin.report();
    push(twin);
    const std::vector<Real> expected = completed;
    const auto next = twin.state();
    constexpr Real untouched = 7;
    const auto prepare = [&] {
      std::ranges::fill(completed, untouched);
      return begun();
    };
    return fail_everywhere(prepare, call, [&](Completer<Real>& completer) {
      CHECK(std::ranges::count(completed, untouched) == std::ssize(completed));
      CHECK(std::ranges::equal(completer.generation(), generation));
      CHECK(std::ranges::equal(completer.age(), age));
      CHECK((completer.report() == report));
      CHECK(completer.state() == start);
      push(completer);
      CHECK(completed == expected);
      CHECK(completer.report().rejected == twin.report().rejected);
      CHECK(completer.state() == next);
    });
  }
};

const std::vector<Subject>& all_subjects() {
  static const std::vector<Subject> all = {
      {{.method = Method::motion}},
      {{.method = Method::motion,
        .revisit = false,
        .extra_iterations = 2,
        .disconnected = DisconnectedRule::hold}},
      {{.method = Method::detail}},
      {{.method = Method::detail, .noise = 0.01, .reject_outliers = true}},
      {{.method = Method::detail}, true},
      {{.method = Method::detail, .learn = true}},
      {{.method = Method::detail, .noise = 0.01, .uncertainty = true}},
  };
  return all;
}

template <class Real>
void check_every_call(const Subject& subject) {
  const bool is_detail = subject.settings.method == Method::detail;
  CAPTURE(is_detail);
  CAPTURE(subject.settings.noise.has_value());
  CAPTURE(subject.is_trained);
  World<Real> world(subject);
  const std::size_t k = world.k;
  using C = Completer<Real>;
  world.moved[3 * 20] += 50;  // an outlier
  world.known[20] = 1;

  // Motion allocates no memory; detail allocates memory for its factor.
  const int least = is_detail ? 1 : 0;
  CHECK(world.leaves_all_as_it_was([&](C& c) { world.push(c); }) >= least);
  CHECK(world.leaves_all_as_it_was([&](C& c) {
    c.push_sparse(world.indices, {world.moved.data(), world.indices.size()}, world.out());
  }) >= least);
  CHECK(world.leaves_all_as_it_was([&](C& c) { c.skip(world.out()); }) == 0);
  CHECK(world.leaves_all_as_it_was([&](C& c) { c.reset({world.moved.data(), k}); }) >= 2);
  CHECK(world.leaves_all_as_it_was([&](C& c) { (void)c.state(); }) >= 1);
  C other = world.begun();
  world.push(other);
  const auto state = other.state();
  CHECK(world.leaves_all_as_it_was([&](C& c) { c.restore(state); }) >= 4);
}

TEST_CASE("a call that runs out of memory changes nothing") {
  for (const Subject& subject : all_subjects()) check_every_call<float>(subject);
  check_every_call<double>(all_subjects().front());
}

TEST_CASE("no result depends on how much memory is left") {
  World<float> world({{.method = Method::detail}});
  std::ranges::fill(world.known, std::uint8_t{1});
  world.known[12] = 0;
  Completer<float> twin = world.begun();
  world.push(twin);
  const auto next = twin.state();
  const int failures = fail_everywhere(
      [&] { return world.begun(); }, [&](auto& completer) { world.push(completer); },
      [&](auto& completer) { CHECK(completer.state() == world.start); },
      [&](auto& completer) { CHECK(completer.state() == next); });
  CHECK(failures > 0);
}

TEST_CASE("a constructor that runs out of memory frees everything") {
  for (Subject subject : all_subjects()) {
    subject.settings.threads = 2;
    World<float> world(subject);
    world.mesh.indices.insert(world.mesh.indices.end(), {0, 0, 1, 0, 1, 6});  // refused
    (void)world.make();
    const std::size_t before = live_allocations();
    const int failures = fail_everywhere([] { return 0; }, [&](int) { (void)world.make(); },
                                         [&](int) { CHECK(live_allocations() == before); });
    CHECK(failures > 20);
  }
}

TEST_CASE("a training sequence that runs out of memory is unchanged") {
  constexpr std::size_t k = 4;
  std::vector<float> frame(3 * k);
  const auto add = [&](Training<float>& training) { training.add({frame.data(), k}); };
  // Also where the array of frames grows, and where only every second frame is kept.
  for (const std::size_t n_added : {0, 1, 2, 8, 64, 74, 75, 76, 150, 152}) {
    CAPTURE(n_added);
    Training<float> before(k);
    for (std::size_t n = 0; n < n_added; ++n) {
      frame[1] = static_cast<float>(n);
      add(before);
    }
    frame[1] = -1;
    Training<float> expected = before;
    add(expected);
    const int failures =
        fail_everywhere([&] { return before; }, add,
                        [&](auto& training) {
                          CHECK(training.n_added() == n_added);
                          CHECK(std::ranges::equal(training.frames(), before.frames()));
                          add(training);
                          CHECK(training.n_added() == n_added + 1);
                          CHECK(std::ranges::equal(training.frames(), expected.frames()));
                        });
    CHECK(failures >= 1);
  }
}

TEST_CASE("the C interface returns a status") {
  World<float> world({{.method = Method::detail}});
  const auto k = static_cast<std::int64_t>(world.k);
  const dynmesh_points first = {world.mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT32};
  const auto n_faces = static_cast<std::int64_t>(world.mesh.faces().count);
  struct Made {
    dynmesh_completer* completer = nullptr;
    dynmesh_status status = DYNMESH_OK;
  };
  const auto create = [&](Made& made) {
    made.status =
        dynmesh_create(world.mesh.indices.data(), n_faces, &first, nullptr, &made.completer);
    dynmesh_destroy(made.completer);
    if (made.status != DYNMESH_OK) throw std::bad_alloc();
  };
  const int failures =
      fail_everywhere([] { return Made(); }, create,
                      [](const Made& made) {
                        CHECK(made.status == DYNMESH_OUT_OF_MEMORY);
                        CHECK(made.completer == nullptr);
                        CHECK(std::string(dynmesh_last_message()) == "out of memory");
                      });
  CHECK(failures > 20);
}

/// A tracker in the middle of a sequence, and the next frame as a scan and as images.
struct Sequence {
  bool is_trained = false;
  Index threads = 1;
  Mesh<double> mesh = bumpy_torus(10);
  Samples first = scan_of(mesh, turned(mesh.vertices, 0.03));
  Samples second = scan_of(mesh, turned(mesh.vertices, 0.06));
  std::vector<Image> images = images_of(mesh, turned(mesh.vertices, 0.06), 2, 60);
  std::vector<double> out = std::vector<double>(3 * mesh.size());

  [[nodiscard]] Tracker<double> begun() const {
    Tracker<double> tracker =
        is_trained ? Tracker<double>(mesh.faces(), mesh.points(), {.uncertainty = true},
                                     training_of(training_frames_of(mesh.vertices, 3)))
                   : Tracker<double>(mesh.faces(), mesh.points(), {.threads = threads});
    track(tracker, first);
    return tracker;
  }
  void push(Tracker<double>& tracker) { tracker.push(view_of(second), {out.data(), mesh.size()}); }
  void push_depth(Tracker<double>& tracker) {
    const std::array<DepthImage, 2> views = {images[0].view(), images[1].view()};
    tracker.push_depth(views, {out.data(), mesh.size()});
  }
};

TEST_CASE("a frame of tracking that runs out of memory changes nothing") {
  Sequence sequence;
  sequence.second.has_normals = false;
  std::optional<SharedWork> shared;
  SUBCASE("with training and errors") { sequence.is_trained = true; }
  SUBCASE("on three threads") {
    shared.emplace(64);
    sequence.threads = 3;
  }
  for (const auto call : {&Sequence::push, &Sequence::push_depth}) {
    auto expected = sequence.begun();
    const auto before = expected.state();
    (sequence.*call)(expected);
    const auto frame = sequence.out;
    const auto prepare = [&] {
      std::ranges::fill(sequence.out, 7);
      return sequence.begun();
    };
    const auto check = [&](Tracker<double>& tracker) {
      CHECK(std::ranges::count(sequence.out, 7) == std::ssize(sequence.out));
      CHECK(tracker.state() == before);
      (sequence.*call)(tracker);
      CHECK(sequence.out == frame);
    };
    const int failures = fail_everywhere(
        prepare, [&](Tracker<double>& t) { (sequence.*call)(t); }, check);
    CHECK(failures > 2);
  }
}

}  // namespace
}  // namespace dynmesh::testing
