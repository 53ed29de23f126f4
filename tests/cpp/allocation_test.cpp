/// Counts every allocation of the process, to see that a frame makes none.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <atomic>
#include <cstdlib>
#include <dynmesh/completer.hpp>
#include <new>

#include "meshes.hpp"

namespace {
std::atomic<std::size_t> allocations = 0;
}

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}
void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto align = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(align, (size + align - 1) / align * align)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace dynmesh::testing {
namespace {

TEST_CASE_TEMPLATE("frames allocate nothing", Real, float, double) {
  auto mesh = join(join(sheet<Real>(20), sheet<Real>(5, 30.0)), sheet<Real>(3, 40.0));
  mesh.vertices.insert(mesh.vertices.end(), {0, 0, 9});
  const std::size_t k = mesh.size();
  for (const bool revisit : {true, false}) {
    Completer<Real> completer(mesh.faces(), mesh.points(), {.revisit = revisit});
    std::vector<Real> out(3 * k);
    const Points<Real> completed(out.data(), k);
    const std::vector<Index> indices = {4, 2, 7};
    for (const double share : {1.0, 0.0, 0.01, 0.3, 0.9}) {
      auto known = random_mask(k, share, 5);
      std::fill(known.begin() + 400, known.begin() + 425, std::uint8_t{0});  // a part unseen
      const std::size_t before = allocations;
      completer.push(mesh.points(), {known.data(), k}, completed);
      completer.push(mesh.points(), completed);
      completer.push_sparse(indices, {mesh.vertices.data(), 3}, completed);
      completer.skip(completed);
      CHECK(allocations == before);
    }
  }
}

TEST_CASE("method detail allocates only where its factor is larger than all before") {
  const auto mesh = join(sheet<float>(20), sheet<float>(5, 30.0));
  const std::size_t k = mesh.size();
  Completer<float> completer(mesh.faces(), mesh.points(), {.method = Method::detail});
  std::vector<float> out(3 * k);
  const auto push = [&](const std::vector<std::uint8_t>& known) {
    completer.push(mesh.points(), {known.data(), k}, {out.data(), k});
  };
  std::vector<std::uint8_t> one_each(k, 0);
  one_each[7] = one_each[410] = 1;
  push(one_each);
  for (const double share : {1.0, 0.0, 0.01, 0.3, 0.9}) {
    const auto known = random_mask(k, share, 5);
    const std::size_t before = allocations;
    push(known);
    push(one_each);
    CHECK(allocations == before);
  }
}

TEST_CASE("nor do they in C") {
  const auto mesh = sheet<float>(20);
  constexpr std::int64_t k = 400;
  std::vector<float> frame(3 * k);
  const dynmesh_points points = {mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT32};
  const dynmesh_output out = {frame.data(), k, 3, 1, DYNMESH_FLOAT32};
  const auto known = random_mask(k, 0.3, 5);
  const dynmesh_mask mask = {known.data(), k, 1};
  const Index index = 4;
  const dynmesh_points point = {mesh.vertices.data(), 1, 3, 1, DYNMESH_FLOAT32};
  dynmesh_frame_report report{};
  dynmesh_completer* completer = nullptr;
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  REQUIRE(dynmesh_create(mesh.indices.data(), n_faces, &points, nullptr, &completer) == DYNMESH_OK);
  const std::size_t before = allocations;
  dynmesh_status status = dynmesh_push(completer, &points, &mask, &out, &report);
  status += dynmesh_push(completer, &points, nullptr, &out, &report);
  status += dynmesh_push_sparse(completer, &index, 1, &point, &out, &report);
  status += dynmesh_skip(completer, &out, nullptr);
  CHECK(allocations == before);
  CHECK(status == DYNMESH_OK);
  dynmesh_destroy(completer);
}

}  // namespace
}  // namespace dynmesh::testing
