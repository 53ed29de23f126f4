/// Runs the harnesses without a fuzzer: `replay CHANGES FOLDER...` runs the inputs in FOLDER/NAME,
/// and each of them again with this number of random changes. The changes are the same in every
/// run.
#include <filesystem>
#include <random>

#include "input.hpp"

extern "C" {
using Harness = int(const std::uint8_t*, std::size_t);
Harness fuzz_template, fuzz_completer;
}

namespace {

using Bytes = std::vector<std::uint8_t>;
namespace fs = std::filesystem;

Bytes changed(Bytes bytes, std::mt19937& random) {
  const auto below = [&](std::size_t end) { return random() % std::max<std::size_t>(end, 1); };
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    const std::size_t place = below(bytes.size());
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(place);
    const std::size_t length = std::min(1 + below(8), bytes.size() - place);
    switch (below(5)) {
      case 0:
        bytes.resize(place);
        break;
      case 1:
        bytes.insert(at, length, static_cast<std::uint8_t>(random()));
        break;
      case 2:
        bytes.erase(at, at + static_cast<std::ptrdiff_t>(length));
        break;
      case 3:
        std::fill_n(at, length, random() % 2 == 0 ? 0xff : 0x7f);
        break;
      default:
        std::generate_n(at, length, [&] { return static_cast<std::uint8_t>(random()); });
    }
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  using dynmesh::fuzz::require;
  const std::pair<const char*, Harness*> harnesses[] = {{"template", fuzz_template},
                                                        {"completer", fuzz_completer}};
  require(argc > 2, "usage: replay CHANGES FOLDER...");
  const unsigned long changes = std::strtoul(argv[1], nullptr, 10);
  std::size_t runs = 0;
  for (const fs::path folder : std::span(argv, static_cast<std::size_t>(argc)).subspan(2)) {
    for (const auto& [name, harness] : harnesses) {
      if (!fs::is_directory(folder / name)) continue;
      const fs::directory_iterator files(folder / name);
      std::vector<fs::path> inputs(begin(files), end(files));
      std::ranges::sort(inputs);
      for (const fs::path& input : inputs) {
        std::fprintf(stderr, "%s\n",
                     input.string().c_str());  // the last line is the input that failed
        const Bytes bytes = dynmesh::fuzz::read_scratch(input.string());
        harness(bytes.data(), bytes.size());
        std::mt19937 random(1);
        for (unsigned long change = 0; change < changes; ++change) {
          const Bytes other = changed(bytes, random);
          harness(other.data(), other.size());
        }
        runs += 1 + changes;
      }
    }
  }
  std::printf("%zu runs\n", runs);
  return runs > 0 ? 0 : 1;
}
