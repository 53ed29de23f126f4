/// Cases of the C++ interface that Python cannot give: the tables of Python show what both check.
#include <dynmesh/dynmesh.hpp>
#include <functional>
#include <limits>

#include "bad_input.hpp"

namespace dynmesh::testing {

void try_cpp(World& world) {
  constexpr auto none = static_cast<const double*>(nullptr);
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

  using Run = std::function<void()>;
  const auto null = [&](const char* call, const std::string& argument, const Run& run) {
    tried(call, ("`" + argument + "`: a null pointer").c_str(), {argument + ":", "null pointer"},
          run);
  };
  const auto flat = [&](const char* call, const std::string& argument, const Run& run) {
    tried(call, ("`" + argument + "`: a row stride of 0").c_str(),
          {argument + ":", "row stride of 0"}, run);
  };
  const auto make = [&](Faces faces, Points<const double> frame, const Settings& settings = {}) {
    return [=] { (void)Completer<double>(faces, frame, settings); };
  };
  const auto faces = world.mesh.faces();
  const auto frame = world.mesh.points();
  const std::vector<Index> low = {0, 1, -1};
  tried("Completer", "no faces", {"faces:", "is empty"}, make({}, frame));
  null("Completer", "faces", make({nullptr, 2}, frame));
  tried("Completer", "`faces`: 2^62 of them", {"faces:", "4611686018427387904"},
        make({faces.data, std::size_t{1} << 62}, frame));
  tried("Completer", "`faces`: an index of -1", {"faces: face 0", "vertex -1"},
        make(faces_of(low), frame));
  tried("Completer", "`first_frame`: no vertex", {"first_frame:", "no vertices"},
        make(faces, {none, 0}));
  null("Completer", "first_frame", make(faces, {none, k}));
  tried("Completer", "`first_frame`: 2^62 rows", {"first_frame:", "4611686018427387904", "32"},
        make(faces, {frame.data, std::size_t{1} << 62, 0, 0}));
  flat("Completer", "first_frame", make(faces, {frame.data, k, 0}));
  tried("Completer", "`noise = infinity` by method detail", {"noise:", "inf"},
        make(faces, frame,
             {.method = Method::detail, .noise = std::numeric_limits<double>::infinity()}));

  const auto push = [&](Points<const double> points, KnownMask known, Points<double> out) {
    return [=, &c] { c.push(points, known, out); };
  };
  const auto points = world.points();
  const auto known = world.known();
  const auto out = world.out();
  null("push", "points", push({none, k}, known, out));
  flat("push", "points", push({points.data, k, 0}, known, out));
  tried("push", "`points`: a column stride of 0", {"points:", "column stride of 0"},
        push({points.data, k, 3, 0}, known, out));
  tried("push", "`points`: a row stride of 0, no `known`", {"points:", "row stride of 0"}, [&] {
    c.push({points.data, k, 0}, out);
  });
  tried("push", "`known`: a stride of 0", {"known:", "row stride of 0"},
        push(points, {known.data, k, 0}, out));
  null("push", "known", push(points, {static_cast<const std::uint8_t*>(nullptr), k}, out));
  null("push", "out", push(points, known, {nullptr, k}));
  tried("push", "`out`: one row further than `points`", {"out:", "overlaps points"},
        push({out.data, k - 1 + 1, 3, 1}, known, {out.data + 3, k}));
  Training<double> training(k);
  const auto train = [&](Points<const double> of) { return [=, &training] { training.add(of); }; };
  tried("Training::add", "`frame`: a row stride of 0", {"training: frame 0:", "row stride of 0"},
        train({frame.data, k, 0}));
  tried("Training::add", "`frame`: a null pointer", {"training: frame 0:", "null pointer"},
        train({none, k}));
  tried("Completer", "`training`: of more vertices", {"training:", "49", "48"}, [&] {
    (void)Completer<double>(faces, {frame.data, k - 1}, {}, training);
  });
  const auto sparse = [&](const std::vector<Index>& indices, Points<const double> observed) {
    return [=, &c] { c.push_sparse(indices, observed, out); };
  };
  flat("push_sparse", "points", sparse({1, 2}, {points.data, 2, 0}));
  null("push_sparse", "points", sparse({1}, {none, 1}));
  flat("skip", "out", [&] { c.skip({out.data, k, 0}); });
  tried("skip", "`out`: rows that overlap", {"out:", "overlap"}, [&] { c.skip({out.data, k, 2}); });
  null("skip", "out", [&] { c.skip({nullptr, k}); });
  flat("reset", "frame", [&] { c.reset({points.data, k, 0}); });

  null("build_topology", "faces", [] { build_topology({nullptr, 2}, 9); });
  tried("read_template", "a file that is not there", {"none.obj:"},
        [] { read_template("none.obj"); });
  tried("read_template", "another format", {"body.npz:", ".off"},
        [] { read_template("body.npz"); });
  tried("method_from_name", "`lsm`", {"method:", "'lsm'"}, [] { method_from_name("lsm"); });
  tried("disconnected_rule_from_name", "`x`", {"disconnected:", "'x'"},
        [] { disconnected_rule_from_name("x"); });
  const Topology topology = build_topology(faces, k);
  LeastSquaresMesh baseline(topology);
  null("LeastSquaresMesh::complete", "points", [&] {
    baseline.complete({none, k}, known, {}, out);
  });
  tried("LeastSquaresMesh::complete", "`completed`: one row too few", {"completed:", "48", "49"},
        [&] {
          baseline.complete(points, known, {}, {out.data, k - 1});
        });
  null("nmsve", "completed", [&] { nmsve<double>(topology.cells, points, {none, k}); });
  tried("vertex_error", "`error`: one place too few", {"reference:", "49", "48"}, [&] {
    vertex_error<double>(points, points, {world.written.data(), k - 1});
  });

  const auto align = [&](Faces triangles, Points<const double> measured) {
    return [=] { (void)find_alignment<double>(triangles, frame, measured); };
  };
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
  tracked("Tracker::push", "`points`: a null pointer", {"points:", "null pointer"},
          scan({{none, k}}, out));
  tracked("Tracker::push", "`points`: a row stride of 0", {"points:", "row stride of 0"},
          scan({{points.data, k, 0}}, out));
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
}

}  // namespace dynmesh::testing
