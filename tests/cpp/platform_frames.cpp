/// The frames that script/try-platforms completes on every platform, and the differences between
/// the results.
///
///     dynmesh-platform-frames write FOLDER            body.obj and partial.raw for
///                                                     dynmesh-complete, ring.obj and scans.raw
///                                                     for `track`
///     dynmesh-platform-frames track FOLDER RESULT     the frames of a tracker of ring.obj in scans
///                                                     with and without normals and depth images
///     dynmesh-platform-frames compare TEMPLATE A B    the largest distance, in mean edges, between
///                                                     the same vertices of two files of frames
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/tracker.hpp>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "meshes.hpp"
#include "scans.hpp"

using namespace dynmesh;
using namespace dynmesh::testing;

namespace {

constexpr int side = 40;
constexpr int n_scans = 12;
constexpr int n_cameras = 2;
constexpr int image_side = 96;

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

template <class T>
void append(std::ofstream& file, const T& numbers) {
  file.write(reinterpret_cast<const char*>(numbers.data()),
             static_cast<std::streamsize>(sizeof(numbers[0]) * numbers.size()));
}

/// Numbers that were appended to a file.
template <class T>
std::vector<T> read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  std::vector<T> numbers(bytes.size() / sizeof(T));
  std::memcpy(numbers.data(), bytes.data(), sizeof(T) * numbers.size());
  return numbers;
}

void write_template(const std::string& path, const std::vector<float>& vertices,
                    const std::vector<Index>& indices) {
  std::ofstream obj(path);
  obj.precision(9);
  for (std::size_t i = 0; i < vertices.size(); i += 3) {
    obj << "v " << vertices[i] << ' ' << vertices[i + 1] << ' ' << vertices[i + 2] << '\n';
  }
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    obj << "f " << indices[i] + 1 << ' ' << indices[i + 1] + 1 << ' ' << indices[i + 2] + 1 << '\n';
  }
}

/// Moves points by up to a two-hundredth of a unit. The faces of a scan share the points of their
/// edges: among points at one place, rounding alone would decide which is the nearest.
void scatter(std::vector<double>& points, std::uint32_t seed) {
  std::minstd_rand random(seed);
  for (double& x : points) {
    x +=
        0.01 * (static_cast<double>(random()) / static_cast<double>(std::minstd_rand::max()) - 0.5);
  }
}

/// For each frame a scan and depth images with their cameras. All numbers are in the file, since
/// the sines of systems differ.
void write_scans(const std::string& folder) {
  const Mesh<double> ring = bumpy_torus(side);
  write_template(folder + "/ring.obj", frame_at(ring, 0), ring.indices);
  std::ofstream file(folder + "/scans.raw", std::ios::binary);
  for (int t = 1; t <= n_scans; ++t) {
    const std::vector<float> frame = frame_at(ring, t);
    const std::vector<double> vertices(frame.begin(), frame.end());
    Samples scan = scan_of(ring, vertices);
    scatter(scan.points, static_cast<std::uint32_t>(t));
    append(file, scan.points);
    append(file, scan.normals);
    for (const Image& image : images_of(ring, vertices, n_cameras, image_side)) {
      append(file, image.intrinsics);
      append(file, image.pose);
      append(file, std::vector<double>(image.pixels.begin(), image.pixels.end()));
    }
  }
}

void track_scans(const std::string& folder, const std::string& result) {
  const TemplateMesh ring = read_template(folder + "/ring.obj");
  const std::vector<double> numbers = read<double>(folder + "/scans.raw");
  const auto* next = numbers.data();
  const auto take = [&next](auto& to, std::size_t count) {
    if constexpr (requires { to.resize(count); }) to.resize(count);
    for (auto& number : to) number = static_cast<std::decay_t<decltype(number)>>(*next++);
  };
  constexpr auto n_pixels = static_cast<std::size_t>(image_side * image_side);
  const std::size_t of_cameras = n_cameras * (9 + 16 + n_pixels);
  const std::size_t of_points = (numbers.size() / n_scans - of_cameras) / 2;
  Tracker<float> tracker(ring.triangles(), ring.points());
  std::ofstream file(result, std::ios::binary);
  for (int t = 0; t < n_scans; ++t) {
    Samples scan;
    take(scan.points, of_points);
    take(scan.normals, of_points);
    std::vector<Image> images(n_cameras);
    std::vector<DepthImage> views;
    for (Image& image : images) {
      image.side = image_side;
      take(image.intrinsics, 9);
      take(image.pose, 16);
      take(image.pixels, n_pixels);
      views.push_back(image.view());
    }
    std::vector<float> tracked(ring.vertices.size());
    if (t % 3 == 2) {
      tracker.push_depth(views, {tracked.data(), tracker.n_vertices()});
    } else {
      scan.has_normals = t % 3 == 0;
      if (!scan.has_normals) scan.viewpoints = {0, 0, 15, 15, 0, -5};
      tracked = track(tracker, scan);
    }
    append(file, tracked);
  }
}

void write(const std::string& folder) {
  write_scans(folder);
  Mesh<double> body = join(torus(side), sheet<double>(side, 10));
  write_template(folder + "/body.obj", frame_at(body, 0), body.indices);
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

double distance(const float* a, const float* b) {
  return std::hypot(double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]);
}

void compare(const std::string& template_path, const std::string& a_path,
             const std::string& b_path) {
  const TemplateMesh body = read_template(template_path);
  double mean_edge = 0;  // over the sides of all triangles
  for (std::size_t i = 0; i < body.faces.size(); ++i) {
    const auto from = static_cast<std::size_t>(body.faces[i]);
    const auto to = static_cast<std::size_t>(body.faces[i % 3 == 2 ? i - 2 : i + 1]);
    mean_edge += distance(&body.vertices[3 * from], &body.vertices[3 * to]);
  }
  mean_edge /= static_cast<double>(body.faces.size());
  const auto a = read<float>(a_path);
  const auto b = read<float>(b_path);
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
    } else if (command == "track" && argc == 4) {
      track_scans(argv[2], argv[3]);
    } else if (command == "compare" && argc == 5) {
      compare(argv[2], argv[3], argv[4]);
    } else {
      std::fputs(
          "usage: dynmesh-platform-frames write FOLDER | track FOLDER RESULT | "
          "compare TEMPLATE A B\n",
          stderr);
      return 2;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
