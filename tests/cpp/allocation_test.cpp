/// Counts all allocations of the process, to verify that a frame makes none.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <dynmesh/completer.hpp>

#include "c_completer.hpp"
#include "counted_memory.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "shared_work.hpp"
#include "surface_fit/scan_arguments.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

#ifdef DYNMESH_WRAPPED_MALLOC
TEST_CASE("allocations of Eigen are counted as well") {
  const std::size_t before = allocations();
  const Eigen::VectorXd vector = Eigen::VectorXd::Zero(100);
  CHECK(vector.size() == 100);
  CHECK(allocations() == before + 1);
}
#endif

TEST_CASE_TEMPLATE("a frame of method motion allocates no memory, in C neither", Subject,
                   Completer<float>, Completer<double>, CCompleter<float>) {
  using Real = std::conditional_t<std::is_same_v<Subject, Completer<double>>, double, float>;
  auto mesh = join(join(sheet<Real>(20), sheet<Real>(5, 30.0)), sheet<Real>(3, 40.0));
  mesh.vertices.insert(mesh.vertices.end(), {0, 0, 9});
  const std::size_t k = mesh.size();
  const SharedWork shared;
  constexpr Method motion = Method::motion;
  for (const auto& settings :
       {Settings{.method = motion}, Settings{.method = motion, .revisit = false},
        Settings{.method = motion, .threads = 3}}) {
    Subject completer(mesh.faces(), mesh.points(), settings);
    std::vector<Real> out(3 * k);
    const Points<Real> completed(out.data(), k);
    const std::vector<Index> indices = {4, 2, 7};
    std::vector<Real> ruined = mesh.vertices;  // the reason is told without memory, too
    for (Real& coordinate : ruined) coordinate *= 1000;
    for (const double share : {1.0, 0.0, 0.01, 0.3, 0.9}) {
      auto known = random_mask(k, share, 5);
      std::fill(known.begin() + 400, known.begin() + 425,
                std::uint8_t{0});  // one component is disconnected
      const std::size_t before = allocations();
      const std::uint64_t pieces = pieces_done_by_others();
      completer.push(mesh.points(), {known.data(), k}, completed);
      completer.push(mesh.points(), completed);
      completer.push_sparse(indices, {mesh.vertices.data(), 3}, completed);
      completer.skip(completed);
      completer.push({ruined.data(), k}, completed);
      CHECK(allocations() == before);
      CHECK((pieces_done_by_others() > pieces) == (settings.threads > 1));
    }
  }
}

TEST_CASE("depth images allocate memory for a scan, not for each pixel") {
  const auto mesh = bumpy_torus(20);
  const auto image = images_of(mesh, mesh.vertices, 1, 200).front();
  const DepthImage view = image.view();
  for (const std::size_t most : {std::size_t{100'000}, std::size_t{500}}) {  // one is reduced
    const std::size_t before = allocations();
    CHECK(point_scan_of({&view, 1}, 3, most).size() > 50);
    CHECK(allocations() - before < 100);
  }
}

TEST_CASE("method detail allocates memory only if its factor is larger than all earlier ones") {
  constexpr unsigned n_frames = 100;
  const SharedWork shared;
  Settings settings = {.method = Method::detail};
  bool is_trained = false;
  SUBCASE("anchors exact") {}
  SUBCASE("with training") { is_trained = true; }
  SUBCASE("that learns") { settings.learn = true; }
  SUBCASE("that learns, on three threads") {
    settings = {.method = Method::detail, .noise = 0.01, .learn = true, .threads = 3};
  }
  SUBCASE("anchors noisy") { settings.noise = 0.01; }
  SUBCASE("outliers rejected") { settings.reject_outliers = true; }
  SUBCASE("with uncertainty") { settings.uncertainty = true; }
  SUBCASE("all of these, on three threads") {
    is_trained = true;
    settings = {.method = Method::detail,
                .noise = 0.01,
                .reject_outliers = true,
                .uncertainty = true,
                .threads = 3};
  }
  const auto mesh = join(sheet<float>(20), sheet<float>(5, 200));
  const std::size_t k = mesh.size();
  auto completer = is_trained ? trained(mesh, settings)
                              : Completer<float>(mesh.faces(), mesh.points(), settings);
  std::vector<float> out(3 * k);
  auto frame = mesh.vertices;
  const auto push = [&](const std::vector<std::uint8_t>& known) {
    completer.push({frame.data(), k}, {known.data(), k}, {out.data(), k});
  };
  std::vector<std::uint8_t> one_each(k, 0);
  one_each[7] = one_each[k - 5] = 1;
  push(one_each);
  if (settings.noise)
    push(std::vector<std::uint8_t>(k, 1));  // noisy anchors are solved for as well
  // Once the factor has reached its largest size, no frame allocates memory, even with new masks.
  const std::size_t before = allocations();
  const std::uint64_t pieces = pieces_done_by_others();
  std::size_t of_the_test = 0;
  for (unsigned n = 0; n < n_frames; ++n) {
    const std::size_t own = allocations();
    const std::vector<std::uint8_t> known = random_mask(k, n * 1.0 / n_frames, n);
    of_the_test += allocations() - own;
    frame[3 * (n % k)] += 5;  // an outlier, if it is known
    push(known);
    completer.push_sparse(std::span<const Index>(), {nullptr, 0}, {out.data(), k});
    push(one_each);
  }
  CHECK(allocations() - of_the_test == before);
  CHECK((pieces_done_by_others() > pieces) == (settings.threads > 1));
}

}  // namespace
}  // namespace dynmesh::testing
