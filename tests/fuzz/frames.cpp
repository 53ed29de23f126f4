/// Streams of frames with arbitrary bytes, read, completed and written as by dynmesh-complete.
#include <cmath>
#include <dynmesh/completer.hpp>
#include <optional>

#include "../../cpp/apps/frame_files.hpp"
#include "input.hpp"

using namespace dynmesh;
using namespace dynmesh::app;
using namespace dynmesh::fuzz;

namespace {

/// A mesh in which every third vertex is in no face.
Completer<float> completer_of(std::size_t k) {
  std::vector<float> vertices(3 * k);
  for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i] = static_cast<float>((i * i) % 7);
  std::vector<Index> faces = {0, 0, 0};
  for (Index v = 0; v + 4 < static_cast<Index>(k); v += 3) {
    for (const Index corner : {v, v + 1, v + 4}) faces.push_back(corner);
  }
  return {{faces.data(), faces.size() / 3}, {vertices.data(), k}, {}};
}

void check_completed(const std::vector<float>& given, const std::vector<float>& completed) {
  for (std::size_t v = 0; v < given.size(); v += 3) {
    bool is_known = true;
    for (std::size_t c = v; c < v + 3; ++c) {
      is_known = is_known && std::isfinite(given[c]);
      require(std::isfinite(completed[c]), "completed frames are finite");
    }
    require(!is_known || std::memcmp(&given[v], &completed[v], 12) == 0, "anchors are as given");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  const bool is_pc2 = input.flip();
  const std::size_t k = 1 + input.below(12);
  const auto content = input.take_rest();
  const std::string path = write_scratch(is_pc2 ? "in.pc2" : "in.raw", content);
  const std::string output = (scratch() / (is_pc2 ? "out.pc2" : "out.raw")).string();
  std::filesystem::remove(output);

  Completer<float> completer = completer_of(k);
  std::vector<float> frame(3 * k);
  const Points<float> points(frame.data(), k);
  const std::size_t header = is_pc2 ? 32 : 0;
  std::size_t n_read = 0;
  try {
    FrameReader reader(path, k);
    FrameWriter writer(output, k, reader.timing(), false);
    std::optional<DataError> damage;
    while (true) {
      try {
        if (!reader.read(frame)) break;
      } catch (const DataError& error) {
        damage = error;
        break;
      }
      const std::size_t place = header + n_read++ * 12 * k;
      require(place + 12 * k <= content.size(), "no more is read than there is");
      require(std::memcmp(frame.data(), &content[place], 12 * k) == 0,
              "frames are read as they are");
      const std::vector<float> given = frame;
      try {
        completer.push(points, points);
      } catch (const std::invalid_argument&) {  // a position beyond the range
        require(std::memcmp(frame.data(), given.data(), 12 * k) == 0, "a refusal writes nothing");
        continue;
      }
      check_completed(given, frame);
      writer.write(frame);
    }
    if (damage) throw DataError(*damage);
    require(header + n_read * 12 * k == content.size(), "all is read");
    writer.finish();
    const auto written = read_scratch(output);
    require(written.size() == header + writer.n_frames() * 12 * k, "all is written");
    if (is_pc2) {
      FrameReader again(output, k);
      for (std::size_t n = 0; n < writer.n_frames(); ++n) require(again.read(frame), "reads back");
      require(!again.read(frame), "and ends there");
    }
  } catch (const DataError& error) {
    require(std::string(error.what()).starts_with(path + ": "), "the error names the file");
    require(!std::filesystem::exists(output), "an unfinished file is not left");
  }
  return 0;
}
