/// Completes the same frame in every run, so that callgrind can count the instructions. The count
/// does not depend on what else the machine does.
///
///     dynmesh-instructions MASK
///
/// `benchmarks/speed/instructions.py` runs it.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <dynmesh/completer.hpp>
#include <string_view>
#include <vector>

#include "meshes.hpp"

using namespace dynmesh;

namespace {

constexpr std::size_t side = 100;
constexpr std::size_t k = side * side;

/// Returns the mask of a name, which is empty if the name is unknown.
std::vector<std::uint8_t> mask_of(std::string_view name) {
  if (name == "10%") return testing::random_mask(k, 0.1, 1);
  if (name == "30%") return testing::random_mask(k, 0.3, 1);
  if (name == "50%") return testing::random_mask(k, 0.5, 1);
  if (name == "70%") return testing::random_mask(k, 0.7, 1);
  if (name != "half" && name != "patches") return {};
  std::vector<std::uint8_t> mask(k, 1);
  for (std::size_t v = 0; v < k; ++v) {
    const auto x = static_cast<int>(v / side);
    const auto y = static_cast<int>(v % side);
    const auto from_centre = [](int coordinate) { return coordinate % 50 - 25; };
    const int distance = from_centre(x) * from_centre(x) + from_centre(y) * from_centre(y);
    if (name == "half" ? v < k / 2 : distance < 240) mask[v] = 0;
  }
  return mask;
}

}  // namespace

/// callgrind counts the instructions of this function only and finds it by its name.
extern "C" __attribute__((noinline)) void counted_frame(Completer<float>& completer,
                                                        Points<const float> points, KnownMask known,
                                                        Points<float> completed) {
  completer.push(points, known, completed);
}

int main(int argc, char** argv) {
  const auto known = mask_of(argc == 2 ? argv[1] : "");
  if (known.empty()) {
    std::fputs("usage: dynmesh-instructions 10%|30%|50%|70%|half|patches\n", stderr);
    return 2;
  }
  const auto mesh = testing::sheet<float>(static_cast<int>(side));
  const auto turned = testing::turned(mesh.vertices, 0.01);
  std::vector<float> completed(3 * k);
  Completer<float> completer(mesh.faces(), mesh.points(), {.method = Method::motion});
  counted_frame(completer, {turned.data(), k}, {known.data(), k}, {completed.data(), k});

  // The count also depends on the compiler and on the kernels that the processor supports.
  std::string_view processor = "portable";
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) processor = "AVX2";
#endif
  std::printf("%s, %s\n", DYNMESH_COMPILER, processor.data());
  return 0;
}
