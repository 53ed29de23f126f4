/// Bad input that Python cannot give: it is refused, what is wrong is named, and nothing changes.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <dynmesh/dynmesh.hpp>
#include <functional>
#include <initializer_list>
#include <string_view>
#include <tuple>

#include "c_completer.hpp"
#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

/// What a message must contain: the argument, the place, the value.
using Names = std::initializer_list<std::string_view>;

void check_named(const std::string& message, Names names) {
  CAPTURE(message);
  CHECK(message != "");
  for (const std::string_view name : names) {
    CAPTURE(name);
    CHECK(message.find(name) != std::string::npos);
  }
}

template <class T, class Change>
T with(T value, const Change& change) {
  change(value);
  return value;
}

/// Good arguments, and an output that no refused call may write.
struct World {
  Mesh<double> mesh = sheet<double>(7);
  std::size_t k = mesh.size();
  std::vector<double> given = turned(mesh.vertices, 0.2);
  std::vector<double> written = std::vector<double>(3 * k);
  std::vector<double> untouched = written;
  std::vector<std::uint8_t> seen = random_mask(k, 0.5, 1);
  std::vector<float> pixels = std::vector<float>(20, 1.0F);
  std::array<double, 9> intrinsics = {4, 0, 2, 0, 4, 2, 0, 0, 1};
  std::array<double, 16> pose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
};

TEST_CASE("C++ refuses what it cannot use") {
  constexpr auto none = static_cast<const double*>(nullptr);
  constexpr std::size_t huge = std::size_t{1} << 62;
  World world;
  const std::size_t k = world.k;
  const auto faces = world.mesh.faces();
  const auto frame = world.mesh.points();
  const Points<const double> points(world.given.data(), k);
  const KnownMask known(world.seen.data(), k);
  const Points<double> out(world.written.data(), k);
  Completer<double> c(faces, frame);
  Tracker<double> t(faces, frame);
  const auto refused = [&](Names names, const std::function<void()>& run) {
    const auto before = std::tuple(c.state(), t.state());
    check_named(message_of(run), names);
    CHECK(std::tuple(c.state(), t.state()) == before);
    CHECK(world.written == world.untouched);
  };
  const auto make = [](Faces of, Points<const double> first) {
    return [=] { (void)Completer<double>(of, first); };
  };
  refused({"faces:", "is empty"}, make({}, frame));
  refused({"faces:", "null pointer"}, make({nullptr, 2}, frame));
  refused({"faces:", "4611686018427387904"}, make({faces.data, huge}, frame));
  refused({"first_frame:", "no vertices"}, make(faces, {none, 0}));
  refused({"first_frame:", "null pointer"}, make(faces, {none, k}));
  refused({"first_frame:", "4611686018427387904", "32"}, make(faces, {frame.data, huge, 0, 0}));
  refused({"first_frame:", "row stride of 0"}, make(faces, {frame.data, k, 0}));

  const auto push = [&](Points<const double> rows, KnownMask mask, Points<double> to) {
    return [=, &c] { c.push(rows, mask, to); };
  };
  refused({"points:", "null pointer"}, push({none, k}, known, out));
  refused({"points:", "row stride of 0"}, push({points.data, k, 0}, known, out));
  refused({"points:", "column stride of 0"}, push({points.data, k, 3, 0}, known, out));
  refused({"points:", "row stride of 0"}, [&] { c.push({points.data, k, 0}, out); });
  refused({"known:", "row stride of 0"}, push(points, {known.data, k, 0}, out));
  refused({"known:", "null pointer"},
          push(points, {static_cast<const std::uint8_t*>(nullptr), k}, out));
  refused({"out:", "null pointer"}, push(points, known, {nullptr, k}));
  refused({"out:", "overlaps points"}, push({out.data, k, 3, 1}, known, {out.data + 3, k}));
  const auto sparse = [&](const std::vector<Index>& indices, Points<const double> observed) {
    return [=, &c] { c.push_sparse(indices, observed, out); };
  };
  refused({"points:", "row stride of 0"}, sparse({1, 2}, {points.data, 2, 0}));
  refused({"points:", "null pointer"}, sparse({1}, {none, 1}));
  refused({"out:", "row stride of 0"}, [&] { c.skip({out.data, k, 0}); });
  refused({"out:", "overlap"}, [&] { c.skip({out.data, k, 2}); });
  refused({"out:", "null pointer"}, [&] { c.skip({nullptr, k}); });
  refused({"frame:", "row stride of 0"}, [&] { c.reset({points.data, k, 0}); });

  Training<double> training(k);
  const std::string first = "training: frame 0:";
  refused({first, "row stride of 0"}, [&] { training.add({frame.data, k, 0}); });
  refused({first, "null pointer"}, [&] { training.add({none, k}); });
  refused({"training:", "49", "48"}, [&] {
    (void)Completer<double>(faces, {frame.data, k - 1}, {}, training);
  });

  refused({"faces:", "null pointer"}, [] { build_topology({nullptr, 2}, 9); });
  const Topology topology = build_topology(faces, k);
  LeastSquaresMesh baseline(topology);
  refused({"points:", "null pointer"}, [&] { baseline.complete({none, k}, known, {}, out); });
  refused({"completed:", "48", "49"}, [&] {
    baseline.complete(points, known, {}, {out.data, k - 1});
  });
  refused({"completed:", "null pointer"}, [&] {
    nmsve<double>(topology.cells, points, {none, k});
  });
  const std::vector<double> beyond(3 * k, 1e201);
  refused({"completed: vertex 0", "1e+201", "below 1e200"}, [&] {
    nmsve<double>(topology.cells, points, {beyond.data(), k});
  });
  refused({"reference:", "49", "48"}, [&] {
    vertex_error<double>(points, points, {world.written.data(), k - 1});
  });

  const auto scan = [&](const Scan<double>& measured) {
    return [=, &t] { t.push(measured, out); };
  };
  refused({"points:", "null pointer"}, scan({{none, k}}));
  refused({"points:", "row stride of 0"}, scan({{points.data, k, 0}}));
  refused({"out:", "overlaps points"}, scan({{world.written.data() + 3, k - 1}}));
  refused({"out:", "null pointer"}, [&] { t.skip({nullptr, k}); });
  const DepthImage image = {world.pixels.data(), 4, 5, 5, 1, world.intrinsics, world.pose};
  const auto seen = [&](const auto& change) {
    return [&, view = with(image, change)] { t.push_depth({&view, 1}, out); };
  };
  refused({"depth:", "null pointer"}, seen([](auto& one) { one.data = nullptr; }));
  refused({"depth:", "stride of 0"}, seen([](auto& one) { one.row_stride = 0; }));
  refused({"depth:", "4611686018427387904"}, seen([](auto& one) { one.width = huge; }));
}

/// Calls of C, between which the state of a completer or tracker must stay the same.
struct Refusals {
  const World& world;
  std::function<std::vector<std::byte>()> state;
  std::vector<std::byte> before = state();

  void operator()(Names names, dynmesh_status status,
                  dynmesh_status expected = DYNMESH_INVALID_ARGUMENT) const {
    const std::string message = dynmesh_last_message();
    CAPTURE(message);
    CHECK(status == expected);
    check_named(message, names);
    CHECK(state() == before);
    CHECK(world.written == world.untouched);
  }
  /// Calls a function with a null pointer in the place of each argument that has a name.
  template <class... Given>
  void with_nulls(dynmesh_status (*function)(Given...),
                  const std::array<const char*, sizeof...(Given)>& names,
                  std::type_identity_t<Given>... given) const {
    const auto try_null = [&]<std::size_t i>() {
      if constexpr (std::is_pointer_v<std::tuple_element_t<i, std::tuple<Given...>>>) {
        if (names[i] == nullptr) return;
        std::tuple<Given...> arguments(given...);
        std::get<i>(arguments) = nullptr;
        (*this)({std::string(names[i]) + ":", "null pointer"}, std::apply(function, arguments));
      }
    };
    [&]<std::size_t... i>(std::index_sequence<i...>) { (try_null.template operator()<i>(), ...); }
    (std::index_sequence_for<Given...>{});
  }
};

/// The arguments of most calls of C.
struct Arguments {
  const std::int32_t* faces;
  std::int64_t n_faces;
  std::int64_t k;
  dynmesh_points frame, single, negative, nothing, typeless, misaligned;
  dynmesh_output out;

  explicit Arguments(World& world)
      : faces(world.mesh.indices.data()),
        n_faces(static_cast<std::int64_t>(world.mesh.faces().count)),
        k(static_cast<std::int64_t>(world.k)),
        frame{world.mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT64},
        single(with(frame, [](auto& rows) { rows.type = DYNMESH_FLOAT32; })),
        negative(with(frame, [](auto& rows) { rows.count = -1; })),
        nothing(with(frame, [](auto& rows) { rows.data = nullptr; })),
        typeless(with(frame, [](auto& rows) { rows.type = 16; })),
        misaligned(
            with(frame, [](auto& rows) { rows.data = static_cast<const char*>(rows.data) + 1; })),
        out{world.written.data(), k, 3, 1, DYNMESH_FLOAT64} {}
};

TEST_CASE("C refuses what a completer cannot use") {
  World world;
  const Arguments given(world);
  const auto& [faces, n_faces, k, frame, single, negative, nothing, typeless, misaligned, out] =
      given;
  const CCompleter<double> owner(world.mesh.faces(), world.mesh.points());
  dynmesh_completer* c = owner.get();
  const Refusals refused{world, [&] { return owner.state(); }};
  dynmesh_settings settings{};
  dynmesh_default_settings(&settings, sizeof settings);
  refused.with_nulls(dynmesh_default_settings, {"settings", nullptr}, &settings, sizeof settings);
  refused({"size:", "0", "48"}, dynmesh_default_settings(&settings, 0));

  dynmesh_completer* other = nullptr;
  const auto create = [&](const dynmesh_points& first, const dynmesh_settings& how,
                          std::int64_t n = -2) {
    other = c;
    const auto status =
        dynmesh_create(given.faces, n == -2 ? given.n_faces : n, &first, &how, &other);
    CHECK(other == nullptr);
    return status;
  };
  refused.with_nulls(dynmesh_create, {"faces", nullptr, "first_frame", nullptr, "completer"}, faces,
                     n_faces, &frame, &settings, &other);
  refused({"faces:", "-1"}, create(frame, settings, -1));
  refused({"first_frame:", "not 16"}, create(typeless, settings));
  refused({"settings.size:", "48"}, create(frame, {}));
  refused({"method:", "not 7"}, create(frame, with(settings, [](auto& s) { s.method = 7; })));
  refused({"disconnected:", "0", "1", "-1"},
          create(frame, with(settings, [](auto& s) { s.disconnected = -1; })));
  refused({"settings.size:", "56", "48"},
          create(frame, with(settings, [](auto& s) { s.size += 8; })));

  dynmesh_training* training = nullptr;
  dynmesh_training* other_training = nullptr;
  REQUIRE(dynmesh_training_create(k, DYNMESH_FLOAT64, &training) == DYNMESH_OK);
  refused.with_nulls(dynmesh_training_create, {nullptr, nullptr, "training"}, k, DYNMESH_FLOAT64,
                     nullptr);
  refused.with_nulls(dynmesh_training_add, {"training", "frame"}, training, &frame);
  const auto train = [&](std::int64_t rows, std::int32_t type) {
    return dynmesh_training_create(rows, type, &other_training);
  };
  refused({"n_vertices:", "not -1"}, train(-1, DYNMESH_FLOAT64));
  refused({"n_vertices:", "not 2147483648"}, train(std::int64_t{1} << 31, DYNMESH_FLOAT64));
  refused({"type:", "not 16"}, train(k, 16));
  CHECK(other_training == nullptr);
  refused({"frame:", "64", "training", "not 32"}, dynmesh_training_add(training, &single));
  for (int n = 0; n < 3; ++n) REQUIRE(dynmesh_training_add(training, &frame) == DYNMESH_OK);
  refused.with_nulls(dynmesh_create_trained,
                     {nullptr, nullptr, "first_frame", nullptr, "training", "completer"}, faces,
                     n_faces, &frame, &settings, training, &other);
  refused({"first_frame:", "64", "training", "not 32"},
          dynmesh_create_trained(faces, n_faces, &single, &settings, training, &other));
  CHECK(other == nullptr);
  CHECK(dynmesh_create_trained(faces, n_faces, &frame, &settings, training, &other) == DYNMESH_OK);
  dynmesh_destroy(other);
  dynmesh_training_destroy(training);

  const dynmesh_mask known = {world.seen.data(), k, 1};
  const std::array<std::int32_t, 2> twice = {4, 4};
  const auto two = with(frame, [](auto& rows) { rows.count = 2; });
  const auto planar = dynmesh_points{frame.data, k, 0, k, DYNMESH_FLOAT64};
  const auto& state = refused.before;
  const auto size = std::ssize(state);
  std::vector<std::byte> room(state.size());
  std::int64_t unwritten = 7;
  float bar = 0;
  dynmesh_frame_report report{};
  const dynmesh_template* mesh = nullptr;
  refused.with_nulls(dynmesh_push, {"completer", "points", nullptr, "out", nullptr}, c, &frame,
                     &known, &out, nullptr);
  refused.with_nulls(dynmesh_push_sparse,
                     {"completer", "indices", nullptr, "points", "out", nullptr}, c, twice.data(),
                     2, &two, &out, nullptr);
  refused.with_nulls(dynmesh_skip, {"completer", "out", nullptr}, c, &out, nullptr);
  refused.with_nulls(dynmesh_reset, {"completer", "frame"}, c, &frame);
  refused.with_nulls(dynmesh_state_size, {"completer", "size"}, c, &unwritten);
  refused.with_nulls(dynmesh_state, {"completer", "state", nullptr}, c, room.data(), size);
  refused.with_nulls(dynmesh_restore, {"completer", "state", nullptr}, c, state.data(), size);
  refused.with_nulls(dynmesh_standard_error, {"completer", "values", nullptr, nullptr}, c, &bar, k,
                     DYNMESH_FLOAT32);
  refused.with_nulls(dynmesh_report, {"completer", "report"}, c, &report);
  refused.with_nulls(dynmesh_read_template, {"path", nullptr}, "none.obj", &mesh);

  const auto push = [&](const dynmesh_points& rows, const dynmesh_mask& mask,
                        const dynmesh_output& to) {
    return dynmesh_push(c, &rows, &mask, &to, nullptr);
  };
  refused({"points:", "64", "32"}, push(single, known, out));
  refused({"points: row_stride", "0", "49"}, push(planar, known, out));
  refused({"points:", "null pointer"}, push(nothing, known, out));
  refused({"points:", "-1"}, push(negative, known, out));
  refused({"points:", "aligned", "8 bytes"}, push(misaligned, known, out));
  refused({"known:", "-2"}, push(frame, {known.data, -2, 1}, out));
  refused({"out:", "64", "not 32"}, push(frame, known, {out.data, k, 3, 1, 32}));
  refused({"indices:", "-1"}, dynmesh_push_sparse(c, twice.data(), -1, &two, &out, nullptr));
  refused({"state:", std::to_string(size - 1), std::to_string(size)},
          dynmesh_state(c, room.data(), size - 1));
  refused({"state:", "-1"}, dynmesh_restore(c, state.data(), -1));
  refused({"standard_error:", "uncertainty"}, dynmesh_standard_error(c, &bar, k, DYNMESH_FLOAT32));
  const CCompleter<double> unsure(world.mesh.faces(), world.mesh.points(), {.uncertainty = true});
  refused({"count:", "50"}, dynmesh_standard_error(unsure.get(), &bar, k + 1, DYNMESH_FLOAT64));
  refused({"type:", "32"}, dynmesh_standard_error(unsure.get(), &bar, k, DYNMESH_FLOAT32));
  refused({"none.obj:"}, dynmesh_read_template("none.obj", &mesh), DYNMESH_UNREADABLE_FILE);
  refused({"null pointer"}, dynmesh_read_template("none.obj", nullptr));
  CHECK(mesh == nullptr);
  CHECK(room == std::vector<std::byte>(room.size()));
  CHECK(unwritten == 7);
}

TEST_CASE("C refuses what a tracker cannot use") {
  World world;
  const Arguments given(world);
  const auto& [faces, n_faces, k, frame, single, negative, nothing, typeless, misaligned, out] =
      given;
  dynmesh_tracker* t = nullptr;
  REQUIRE(dynmesh_tracker_create(faces, n_faces, &frame, 1, &t) == DYNMESH_OK);
  const Refusals refused{world, [&] {
                           std::int64_t size = 0;
                           dynmesh_tracker_state_size(t, &size);
                           std::vector<std::byte> state(static_cast<std::size_t>(size));
                           dynmesh_tracker_state(t, state.data(), size);
                           return state;
                         }};
  dynmesh_tracker* other = nullptr;
  refused.with_nulls(dynmesh_tracker_create, {nullptr, nullptr, "first_frame", nullptr, "tracker"},
                     faces, n_faces, &frame, 1, &other);
  other = t;
  refused({"threads", "0"}, dynmesh_tracker_create(faces, n_faces, &frame, 0, &other));
  CHECK(other == nullptr);
  refused.with_nulls(dynmesh_tracker_push,
                     {"tracker", "points", nullptr, nullptr, nullptr, "out", nullptr}, t, &frame,
                     nullptr, nullptr, nullptr, &out, nullptr);

  dynmesh_depth_image image = {world.pixels.data(), 4, 5, 0, 0, {}, {}, nullptr};
  std::ranges::copy(world.intrinsics, image.intrinsics);
  std::ranges::copy(world.pose, image.pose);
  const auto narrow = with(image, [](auto& one) { one.width = -5; });
  refused.with_nulls(dynmesh_tracker_push_depth, {nullptr, "images", nullptr, nullptr, nullptr}, t,
                     &image, 1, &out, nullptr);
  refused({"images", "-1"}, dynmesh_tracker_push_depth(t, &image, -1, &out, nullptr));
  refused({"-5"}, dynmesh_tracker_push_depth(t, &narrow, 1, &out, nullptr));

  dynmesh_registration_request request{};
  request.faces = faces;
  request.n_faces = n_faces;
  request.positions = request.points = &frame;
  request.align = request.threads = 1;
  const auto registered = [&](const auto& change) {
    const auto wrong = with(request, change);
    return dynmesh_register(&wrong, &given.out, nullptr, nullptr, nullptr);
  };
  refused.with_nulls(dynmesh_register, {"request", "vertices", nullptr, nullptr, nullptr}, &request,
                     &out, nullptr, nullptr, nullptr);
  refused({"template:", "null pointer"}, registered([](auto& r) { r.positions = nullptr; }));
  refused({"faces:", "null pointer"}, registered([](auto& r) { r.faces = nullptr; }));
  refused({"points:", "null pointer"}, registered([](auto& r) { r.points = nullptr; }));
  refused({"points:", "type"}, registered([&](auto& r) { r.points = &given.single; }));
  refused({"landmark_vertices:", "null pointer"},
          registered([&](auto& r) { r.landmarks = &given.frame; }));

  const auto& state = refused.before;
  const auto size = std::ssize(state);
  std::vector<std::byte> room(state.size());
  refused({"state:", std::to_string(size - 1)}, dynmesh_tracker_state(t, room.data(), size - 1));
  refused.with_nulls(dynmesh_tracker_restore, {nullptr, "state", nullptr}, t, state.data(), size);
  refused.with_nulls(dynmesh_tracker_skip, {nullptr, "out", nullptr}, t, &out, nullptr);
  CHECK(dynmesh_tracker_observed(nullptr) == nullptr);
  dynmesh_tracker_destroy(t);
  dynmesh_tracker_destroy(nullptr);
}

}  // namespace
}  // namespace dynmesh::testing
