/// How much of the stack frames need.
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include <doctest/doctest.h>
#include <pthread.h>

#include <dynmesh/completer.hpp>
#include <dynmesh/tracker.hpp>

#include "meshes.hpp"
#include "scans.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

/// Executes `call` in a thread whose stack is that of threads on systems with musl.
template <class Call>
void on_small_stack(const Call& call) {
  pthread_attr_t attributes;
  REQUIRE(pthread_attr_init(&attributes) == 0);
  REQUIRE(pthread_attr_setstacksize(&attributes, std::size_t{128} * 1024) == 0);
  pthread_t thread{};
  const auto run = [](void* context) -> void* {
    (*static_cast<const Call*>(context))();
    return nullptr;
  };
  REQUIRE(pthread_create(&thread, &attributes, run, const_cast<Call*>(&call)) == 0);
  CHECK(pthread_join(thread, nullptr) == 0);
  pthread_attr_destroy(&attributes);
}

TEST_CASE("a stack of 128 kB suffices") {
  const auto mesh = bumpy_torus(60);
  const std::size_t k = mesh.size();
  const auto moved = turned(mesh.vertices, 0.03);
  const auto known = random_mask(k, 0.3, 1);
  const Samples scan = scan_of(mesh, moved);
  const auto training = training_of(training_frames_of(mesh.vertices, 40));
  std::vector<double> out(3 * k);
  for (const Settings& settings : {Settings{.method = Method::motion},
                                   Settings{.uncertainty = true}, Settings{.learn = true}}) {
    on_small_stack([&] {
      Completer<double> completer(mesh.faces(), mesh.points(), settings);
      for (int n = 0; n < 9; ++n) {
        completer.push({moved.data(), k}, {known.data(), k}, {out.data(), k});
      }
    });
  }
  on_small_stack([&] {
    Tracker<double> tracker(mesh.faces(), mesh.points(), {.uncertainty = true}, training);
    tracker.push(view_of(scan), {out.data(), k});
  });
}

}  // namespace
}  // namespace dynmesh::testing
#endif
