/// Cases of the C++ interface.
#include <dynmesh/dynmesh.hpp>
#include <functional>
#include <limits>

#include "bad_input.hpp"

namespace dynmesh::testing {

void try_cpp(World& world) {
  constexpr auto none = static_cast<const double*>(nullptr);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  auto& c = world.completer;
  const std::size_t k = world.k;
  const auto tried = [&](const char* call, const char* given, Names names,
                         const std::function<void()>& run) {
    const auto before = c.state();
    const auto untouched = world.written;
    show("C++", call, given, message_of(run), names);
    if (c.state() != before) fault(call, given, "changed the completer");
    if (world.written != untouched) fault(call, given, "wrote to its output");
  };
  const auto with = [&](std::size_t index, double value) {
    auto changed = world.given;
    changed[index] = value;
    return changed;
  };

  const auto make = [&](Faces faces, Points<const double> frame, const Settings& settings = {}) {
    return [=] { (void)Completer<double>(faces, frame, settings); };
  };
  const auto faces = world.mesh.faces();
  const auto frame = world.mesh.points();
  const std::vector<Index> low = {0, 1, -1};
  const auto holed = with(13, nan);
  tried("Completer", "no faces", {"faces:", "is empty"}, make({}, frame));
  tried("Completer", "`faces`: a null pointer", {"faces:", "null pointer"},
        make({nullptr, 2}, frame));
  tried("Completer", "`faces`: 2^62 of them", {"faces:", "4611686018427387904"},
        make({faces.data, std::size_t{1} << 62}, frame));
  tried("Completer", "`faces`: an index of -1", {"faces: face 0", "vertex -1"},
        make(faces_of(low), frame));
  tried("Completer", "`first_frame`: no vertex", {"first_frame:", "no vertices"},
        make(faces, {none, 0}));
  tried("Completer", "`first_frame`: a null pointer", {"first_frame:", "null pointer"},
        make(faces, {none, k}));
  tried("Completer", "`first_frame`: 2^62 rows", {"first_frame:", "4611686018427387904", "32"},
        make(faces, {frame.data, std::size_t{1} << 62, 0, 0}));
  tried("Completer", "`first_frame`: one row too few", {"faces: face 71", "vertex 48"},
        make(faces, {frame.data, k - 1}));
  tried("Completer", "`first_frame`: NaN in it", {"first_frame: vertex 4", "nan"},
        make(faces, {holed.data(), k}));
  tried("Completer", "`first_frame`: a row stride of 0", {"first_frame:", "row stride of 0"},
        make(faces, {frame.data, k, 0}));
  tried("Completer", "`reject_outliers = true` by method motion", {"reject_outliers:", "detail"},
        make(faces, frame, {.method = Method::motion, .reject_outliers = true}));
  tried("Completer", "`learn = true` by method motion", {"learn:", "detail"},
        make(faces, frame, {.method = Method::motion, .learn = true}));
  tried("Completer", "`uncertainty = true` by method motion", {"uncertainty:", "detail"},
        make(faces, frame, {.method = Method::motion, .uncertainty = true}));
  tried("Completer", "`noise = 0` by method detail", {"noise:", "not 0"},
        make(faces, frame, {.method = Method::detail, .noise = 0.0}));
  tried("Completer", "`noise = infinity` by method detail", {"noise:", "inf"},
        make(faces, frame,
             {.method = Method::detail, .noise = std::numeric_limits<double>::infinity()}));
  tried("Completer", "`extra_iterations = 1` without method motion",
        {"extra_iterations:", "motion"}, make(faces, frame, {.extra_iterations = 1}));
  tried("Completer", "`extra_iterations = -1`", {"extra_iterations:", "not -1"},
        make(faces, frame, {.method = Method::motion, .extra_iterations = -1}));
  tried("Completer", "`threads = 0`", {"threads:", "not 0"}, make(faces, frame, {.threads = 0}));
  tried("Completer", "`threads = 1000`", {"threads:", "not 1000"},
        make(faces, frame, {.threads = 1000}));
  tried("Completer", "`noise = 0.1` by method motion", {"noise:", "detail"},
        make(faces, frame, {.method = Method::motion, .noise = 0.1}));
  tried("Completer", "`noise = NaN` by method detail", {"noise:", "nan"},
        make(faces, frame, {.method = Method::detail, .noise = nan}));
  tried("Completer", "`revisit = false` by method detail", {"revisit:", "motion"},
        make(faces, frame, {.method = Method::detail, .revisit = false}));

  const auto infinite = with(13, std::numeric_limits<double>::infinity());
  const auto large = with(13, 1e201);
  const std::vector<std::uint8_t> all(k, 1);
  const KnownMask everything(all.data(), k);
  const auto push = [&](Points<const double> points, KnownMask known, Points<double> out) {
    return [=, &c] { c.push(points, known, out); };
  };
  const auto points = world.points();
  const auto known = world.known();
  const auto out = world.out();
  tried("push", "`points`: one row too few", {"points:", "48", "49"},
        push({points.data, k - 1}, known, out));
  tried("push", "`points`: a null pointer", {"points:", "null pointer"},
        push({none, k}, known, out));
  tried("push", "`points`: NaN, marked known", {"points: row 4", "nan"},
        push({holed.data(), k}, everything, out));
  tried("push", "`points`: infinity, marked known", {"points: row 4", "inf"},
        push({infinite.data(), k}, everything, out));
  tried("push", "`points`: 1e201", {"points: row 4", "1e+201"},
        push({large.data(), k}, everything, out));
  tried("push", "`points`: a row stride of 0", {"points:", "row stride of 0"},
        push({points.data, k, 0}, known, out));
  tried("push", "`points`: a column stride of 0", {"points:", "column stride of 0"},
        push({points.data, k, 3, 0}, known, out));
  tried("push", "`points`: a row stride of 0, no `known`", {"points:", "row stride of 0"}, [&] {
    c.push({points.data, k, 0}, out);
  });
  tried("push", "`known`: a stride of 0", {"known:", "row stride of 0"},
        push(points, {known.data, k, 0}, out));
  tried("push", "`known`: one row too few", {"known:", "48", "49"},
        push(points, {known.data, k - 1}, out));
  tried("push", "`known`: a null pointer", {"known:", "null pointer"},
        push(points, {static_cast<const std::uint8_t*>(nullptr), k}, out));
  tried("push", "`out`: one row too many", {"out:", "50", "49"},
        push(points, known, {out.data, k + 1}));
  tried("push", "`out`: a null pointer", {"out:", "null pointer"},
        push(points, known, {nullptr, k}));
  tried("push", "`out`: one row further than `points`", {"out:", "overlaps points"},
        push({out.data, k - 1 + 1, 3, 1}, known, {out.data + 3, k}));
  tried("push", "`out`: rows that overlap", {"out:", "overlap"},
        push(points, known, {out.data, k, 1, 1}));
  Training<double> training(k);
  const auto train = [&](Points<const double> of) { return [=, &training] { training.add(of); }; };
  tried("Training::add", "`frame`: NaN in it", {"training: frame 0: vertex 4", "nan"},
        train({holed.data(), k}));
  tried("Training::add", "`frame`: one row too few", {"training: frame 0:", "48", "49"},
        train({frame.data, k - 1}));
  tried("Training::add", "`frame`: a row stride of 0", {"training: frame 0:", "row stride of 0"},
        train({frame.data, k, 0}));
  tried("Training::add", "`frame`: a null pointer", {"training: frame 0:", "null pointer"},
        train({none, k}));
  training.add(frame);
  training.add(frame);
  const auto make_trained = [&](const Settings& settings, Points<const double> first) {
    return [=, &training] { (void)Completer<double>(faces, first, settings, training); };
  };
  tried("Completer", "`training`: two frames", {"training:", "2", "3"},
        make_trained({.method = Method::detail}, frame));
  training.add(frame);
  tried("Completer", "`training` with method motion", {"training:", "detail"},
        make_trained({.method = Method::motion}, frame));
  tried("Completer", "`training`: of more vertices", {"training:", "49", "48"},
        make_trained({.method = Method::detail}, {frame.data, k - 1}));
  auto in_millimetres = world.mesh.vertices;
  for (double& x : in_millimetres) x *= 1000;
  tried("Completer", "`training`: in another unit", {"training:", "size", "unit"},
        make_trained({.method = Method::detail}, {in_millimetres.data(), k}));
  const auto sparse = [&](const std::vector<Index>& indices, Points<const double> observed) {
    return [=, &c] { c.push_sparse(indices, observed, out); };
  };
  tried("push_sparse", "`indices`: one twice", {"indices:", "0", "2", "4"},
        sparse({4, 7, 4}, {points.data, 3}));
  tried("push_sparse", "`indices`: one of k", {"indices:", "1", "49", "0"},
        sparse({4, 49}, {points.data, 2}));
  tried("push_sparse", "`indices`: a negative one", {"indices:", "0", "-1", "49"},
        sparse({-1}, {points.data, 1}));
  tried("push_sparse", "`points`: fewer than indices", {"points:", "2", "3"},
        sparse({1, 2, 3}, {points.data, 2}));
  tried("push_sparse", "`points`: a row stride of 0", {"points:", "row stride of 0"},
        sparse({1, 2}, {points.data, 2, 0}));
  tried("push_sparse", "`points`: a null pointer", {"points:", "null pointer"},
        sparse({1}, {none, 1}));
  tried("skip", "`out`: one row too few", {"out:", "48", "49"}, [&] { c.skip({out.data, k - 1}); });
  tried("skip", "`out`: a row stride of 0", {"out:", "row stride of 0"}, [&] {
    c.skip({out.data, k, 0});
  });
  tried("skip", "`out`: rows that overlap", {"out:", "overlap"}, [&] { c.skip({out.data, k, 2}); });
  tried("skip", "`out`: a null pointer", {"out:", "null pointer"}, [&] { c.skip({nullptr, k}); });
  tried("reset", "`frame`: a row stride of 0", {"frame:", "row stride of 0"}, [&] {
    c.reset({points.data, k, 0});
  });
  tried("reset", "`frame`: NaN in it", {"frame: vertex 4", "nan"}, [&] {
    c.reset({holed.data(), k});
  });
  tried("reset", "`frame`: one row too few", {"frame:", "48", "49"}, [&] {
    c.reset({points.data, k - 1});
  });

  const auto state = c.state();
  const auto restore = [&](const std::vector<std::byte>& bytes) {
    return [=, &c] { c.restore(bytes); };
  };
  auto flipped = state;
  flipped[200] ^= std::byte{1};
  tried("restore", "`state`: empty", {"state:", "0"}, restore({}));
  tried("restore", "`state`: half of it", {"state:", "1000"},
        restore({state.begin(), state.begin() + 1000}));
  tried("restore", "`state`: a flipped bit", {"state:", "damaged"}, restore(flipped));
  tried("restore", "`state`: other bytes", {"state:", "not a completer state"},
        restore(std::vector<std::byte>(3000)));
  auto longer = state;
  longer.push_back({});
  tried("restore", "`state`: one byte more", {"state:", "1 byte"}, restore(longer));
  auto other_faces = world.mesh.indices;
  other_faces[2] = other_faces[4];
  tried("restore", "`state`: of a mesh with other faces", {"state:", "other faces"},
        restore(Completer<double>(faces_of(other_faces), frame).state()));
  const std::vector<float> single(world.mesh.vertices.begin(), world.mesh.vertices.end());
  tried("restore", "`state`: of 32-bit numbers", {"state:", "32-bit", "64-bit"},
        restore(Completer<float>(faces, {single.data(), k}).state()));
  tried("restore", "`state`: of another mesh", {"state:", "25", "49"},
        restore(Completer<double>(sheet<double>(5).faces(), sheet<double>(5).points()).state()));
  tried("restore", "`state`: of a completer with training", {"state:", "with training"},
        restore(Completer<double>(faces, frame, {.method = Method::detail}, training).state()));
  tried("restore", "`state`: of other settings", {"state:", "disconnected", "hold"},
        restore(Completer<double>(faces, frame, {.disconnected = DisconnectedRule::hold}).state()));

  tried("build_topology", "`faces`: a null pointer", {"faces:", "null pointer"}, [] {
    build_topology({nullptr, 2}, 9);
  });
  tried("build_topology", "`n_vertices`: one too few", {"faces: face 71", "vertex 48"},
        [&] { build_topology(faces, k - 1); });
  tried("build_topology", "`n_vertices`: 2^40", {"faces:", "1099511627776"},
        [&] { build_topology(faces, std::size_t{1} << 40); });
  tried("read_template", "a file that is not there", {"none.obj:"},
        [] { read_template("none.obj"); });
  tried("read_template", "another format", {"body.npz:", ".off"},
        [] { read_template("body.npz"); });
  tried("method_from_name", "`lsm`", {"method:", "'lsm'"}, [] { method_from_name("lsm"); });
  tried("disconnected_rule_from_name", "`x`", {"disconnected:", "'x'"},
        [] { disconnected_rule_from_name("x"); });
  const Topology topology = build_topology(faces, k);
  LeastSquaresMesh baseline(topology);
  tried("LeastSquaresMesh::complete", "nothing known", {"known: component 0", "49"}, [&] {
    baseline.complete(points, {std::vector<std::uint8_t>(k).data(), k}, {}, out);
  });
  tried("LeastSquaresMesh::complete", "`points`: a null pointer", {"points:", "null pointer"}, [&] {
    baseline.complete({none, k}, known, {}, out);
  });
  tried("LeastSquaresMesh::complete", "`completed`: one row too few", {"completed:", "48", "49"},
        [&] {
          baseline.complete(points, known, {}, {out.data, k - 1});
        });
  tried("nmsve", "`completed`: a null pointer", {"completed:", "null pointer"}, [&] {
    nmsve<double>(topology.cells, points, {none, k});
  });
  tried("nmsve", "`reference`: one row too few", {"reference:", "48", "49"}, [&] {
    nmsve<double>(topology.cells, {points.data, k - 1}, points);
  });
  tried("nmsve", "`completed`: NaN in it", {"completed:", "vertex 4", "nan"}, [&] {
    nmsve<double>(topology.cells, points, {holed.data(), k});
  });
  tried("vertex_error", "`error`: one place too few", {"reference:", "49", "48"}, [&] {
    vertex_error<double>(points, points, {world.written.data(), k - 1});
  });
  tried("summary", "no error", {"errors:", "is empty"}, [] { summary({}); });

  const auto align = [&](Faces triangles, Points<const double> measured) {
    return [=] { (void)find_alignment<double>(triangles, frame, measured); };
  };
  tried("find_alignment", "`scan`: no point", {"scan:", "no points"}, align(faces, {none, 0}));
  tried("find_alignment", "`scan`: NaN in it", {"scan: row 4", "nan"},
        align(faces, {holed.data(), k}));
  tried("find_alignment", "no faces", {"faces:", "is empty"}, align({}, points));

  Tracker<double> tracker(faces, frame);
  const auto tracked = [&](const char* call, const char* given, Names names,
                           const std::function<void()>& run) {
    const auto before = tracker.state();
    tried(call, given, names, run);
    if (tracker.state() != before) fault(call, given, "changed the tracker");
  };
  const auto scan = [&](const Scan<double>& measured, Points<double> to) {
    return [=, &tracker] { tracker.push(measured, to); };
  };
  const std::vector<double> far(30, 1e6);
  tracked("Tracker::push", "`points`: a null pointer", {"points:", "null pointer"},
          scan({{none, k}}, out));
  tracked("Tracker::push", "`points`: a row stride of 0", {"points:", "row stride of 0"},
          scan({{points.data, k, 0}}, out));
  tracked("Tracker::push", "`normals`: one row too few", {"normals:", "48", "49"},
          scan({points, {points.data, k - 1}}, out));
  tracked("Tracker::push", "`points`: far from the template", {"points:", "far", "mean edges"},
          scan({{far.data(), 10}, {far.data(), 10}}, out));
  tracked("Tracker::push", "`out`: overlaps the points", {"out:", "overlaps points"},
          scan({{world.written.data() + 3, k - 1}}, out));
  tracked("Tracker::skip", "`out`: a null pointer", {"out:", "null pointer"}, [&] {
    tracker.skip({nullptr, k});
  });
  const std::vector<float> pixels(20, 1.0F);
  DepthImage image = {pixels.data(), 4, 5, 5, 1, {4, 0, 2, 0, 4, 2, 0, 0, 1}, {}};
  for (const std::size_t e : {0U, 5U, 10U, 15U}) image.pose[e] = 1;
  const auto seen = [&](DepthImage view) {
    return [=, &tracker] { tracker.push_depth({&view, 1}, out); };
  };
  auto bad = image;
  bad.data = nullptr;
  tracked("Tracker::push_depth", "`data`: a null pointer", {"depth:", "null pointer"}, seen(bad));
  bad = image;
  bad.row_stride = 0;
  tracked("Tracker::push_depth", "`row_stride = 0`", {"depth:", "stride of 0"}, seen(bad));
  bad = image;
  bad.width = std::size_t{1} << 62;
  tracked("Tracker::push_depth", "`width`: 2^62", {"depth:", "4611686018427387904"}, seen(bad));
  bad = image;
  bad.intrinsics[4] = 0;
  tracked("Tracker::push_depth", "`intrinsics`: a focal length of 0", {"intrinsics:", "singular"},
          seen(bad));
  bad = image;
  bad.pose[0] = -1;
  tracked("Tracker::push_depth", "`pose`: mirrored", {"pose:", "not rigid"}, seen(bad));
}

}  // namespace dynmesh::testing
