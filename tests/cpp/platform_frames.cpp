/// The frames that script/try-platforms completes on every platform, and the differences between
/// the results.
///
///     dynmesh-platform-frames write FOLDER           body.obj, partial.raw and rehearsal.raw
///     dynmesh-platform-frames compare FOLDER A B     the largest distance, in mean edges, between
///                                                    the same vertices of two files of frames
#include <cmath>
#include <cstdio>
#include <cstring>
#include <dynmesh/template_mesh.hpp>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "meshes.hpp"

using namespace dynmesh;
using namespace dynmesh::testing;

namespace {

constexpr int side = 40;

/// A torus beside a sheet, both of which turn and swell.
std::vector<float> frame_at(const Mesh<double>& body, double time) {
  std::vector<float> frame;
  const auto moved = turned(body.vertices, 0.02 * time);
  for (std::size_t i = 0; i < moved.size(); i += 3) {
    const double wave = 0.05 * time * std::sin(0.4 * body.vertices[i] + 0.1 * time);
    for (std::size_t c = 0; c < 3; ++c) {
      frame.push_back(static_cast<float>(moved[i + c] * (1 + 0.004 * time) + (c == 2 ? wave : 0)));
    }
  }
  return frame;
}

void append(std::ofstream& file, const std::vector<float>& frame) {
  file.write(reinterpret_cast<const char*>(frame.data()),
             static_cast<std::streamsize>(sizeof(float) * frame.size()));
}

void write(const std::string& folder) {
  Mesh<double> body = join(torus(side), sheet<double>(side, 10));
  std::ofstream obj(folder + "/body.obj");
  obj.precision(9);
  const auto first = frame_at(body, 0);
  for (std::size_t i = 0; i < first.size(); i += 3) {
    obj << "v " << first[i] << ' ' << first[i + 1] << ' ' << first[i + 2] << '\n';
  }
  for (std::size_t i = 0; i < body.indices.size(); i += 3) {
    obj << "f " << body.indices[i] + 1 << ' ' << body.indices[i + 1] + 1 << ' '
        << body.indices[i + 2] + 1 << '\n';
  }
  std::ofstream rehearsal(folder + "/rehearsal.raw", std::ios::binary);
  for (int t = 0; t < 20; ++t) append(rehearsal, frame_at(body, 2.5 * t));
  std::ofstream partial(folder + "/partial.raw", std::ios::binary);
  for (unsigned t = 1; t <= 30; ++t) {
    auto frame = frame_at(body, t);
    // A third of the vertices is known, and none in a third of the torus.
    auto known = random_mask(body.size(), 1 / 3.0, t);
    std::fill_n(known.begin() + 10 * (t % 7), side * side / 3, std::uint8_t{0});
    for (std::size_t i = 0; i < frame.size(); ++i) {
      if (known[i / 3] == 0) frame[i] = std::numeric_limits<float>::quiet_NaN();
    }
    append(partial, frame);
  }
}

std::vector<float> read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  std::vector<float> numbers(bytes.size() / sizeof(float));
  std::memcpy(numbers.data(), bytes.data(), sizeof(float) * numbers.size());
  return numbers;
}

double distance(const float* a, const float* b) {
  return std::hypot(double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]);
}

void compare(const std::string& folder, const std::string& a_path, const std::string& b_path) {
  const TemplateMesh body = read_template(folder + "/body.obj");
  double mean_edge = 0;  // over the sides of all triangles
  for (std::size_t i = 0; i < body.faces.size(); ++i) {
    const auto from = static_cast<std::size_t>(body.faces[i]);
    const auto to = static_cast<std::size_t>(body.faces[i % 3 == 2 ? i - 2 : i + 1]);
    mean_edge += distance(&body.vertices[3 * from], &body.vertices[3 * to]);
  }
  mean_edge /= static_cast<double>(body.faces.size());
  const auto a = read(a_path);
  const auto b = read(b_path);
  if (a.size() != b.size() || a.empty() || a.size() % body.vertices.size() != 0) {
    throw std::runtime_error(b_path + ": has not the size of " + a_path);
  }
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); i += 3) {
    const double difference = distance(&a[i], &b[i]) / mean_edge;
    if (!(difference <= largest)) largest = difference;  // NaN as well
  }
  std::printf("%.2g\n", largest);
  if (!(largest < 1e-3)) throw std::runtime_error(b_path + ": differs by more than rounding");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string_view command = argc > 1 ? argv[1] : "";
    if (command == "write" && argc == 3) {
      write(argv[2]);
    } else if (command == "compare" && argc == 5) {
      compare(argv[2], argv[3], argv[4]);
    } else {
      std::fputs("usage: dynmesh-platform-frames write FOLDER | compare FOLDER A B\n", stderr);
      return 2;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
