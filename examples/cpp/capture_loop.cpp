/// A capture loop: one thread delivers partial frames 60 times a second, another completes them.
///
///     capture_loop body.obj partial.raw completed.raw [--every-frame]
///
/// partial.raw holds frames of little-endian float32 x y z, NaN where a vertex was not seen. A
/// frame that comes before the last one was taken up is dropped in favour of the newer one, as a
/// live system must, and counted. --every-frame delivers without pause instead, and drops none.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <exception>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace {

using FrameBuffer = std::vector<float>;

/// Holds the newest frame until it is taken. Buffers change hands, so nothing is allocated or
/// copied.
class Mailbox {
 public:
  explicit Mailbox(std::size_t floats) : frame_(floats) {}

  /// Leaves `frame` here and gives an old buffer back. Returns false where that dropped a frame.
  bool deliver(FrameBuffer& frame, bool wait_until_taken) {
    std::unique_lock lock(mutex_);
    if (wait_until_taken) changed_.wait(lock, [&] { return !full_; });
    std::swap(frame, frame_);
    const bool was_taken = !std::exchange(full_, true);
    changed_.notify_all();
    return was_taken;
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

  /// Waits for a frame; false at the end.
  bool take(FrameBuffer& frame) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return full_ || closed_; });
    if (!full_) return false;
    std::swap(frame, frame_);
    full_ = false;
    changed_.notify_all();
    return true;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  FrameBuffer frame_;
  bool full_ = false;
  bool closed_ = false;
};

/// The sensor: returns how many of its frames were dropped.
std::size_t produce(std::ifstream& sensor, std::size_t floats, bool every_frame, Mailbox& mailbox) {
  constexpr auto period = std::chrono::nanoseconds(std::chrono::seconds(1)) / 60;
  FrameBuffer frame(floats);
  std::size_t dropped = 0;
  const auto bytes = static_cast<std::streamsize>(floats * sizeof(float));
  auto due = std::chrono::steady_clock::now();
  while (sensor.read(reinterpret_cast<char*>(frame.data()), bytes)) {
    if (!every_frame) std::this_thread::sleep_until(due += period);
    dropped += mailbox.deliver(frame, every_frame) ? 0U : 1U;
  }
  mailbox.close();
  return dropped;
}

void run(const char* template_path, const char* input, const char* output, bool every_frame) {
  const dynmesh::TemplateMesh mesh = dynmesh::read_template(template_path);
  dynmesh::Completer<float> completer(mesh.triangles(), mesh.points());
  const std::size_t k = completer.n_vertices();

  std::ifstream sensor(input, std::ios::binary);
  std::ofstream display(output, std::ios::binary);
  if (!sensor || !display) throw std::runtime_error("cannot open the input or the output");
  if (std::filesystem::file_size(input) % (3 * k * sizeof(float)) != 0) {
    throw std::runtime_error("the input does not hold whole raw frames of the template's vertices");
  }

  Mailbox mailbox(3 * k);
  std::size_t dropped = 0;
  std::thread producer([&] { dropped = produce(sensor, 3 * k, every_frame, mailbox); });

  FrameBuffer frame(3 * k);
  std::vector<double> milliseconds;
  while (mailbox.take(frame)) {
    const dynmesh::Points<float> points(frame.data(), k);
    milliseconds.push_back(1e3 * completer.push(points, points).seconds);  // completed in place
    display.write(reinterpret_cast<const char*>(frame.data()),
                  static_cast<std::streamsize>(frame.size() * sizeof(float)));
  }
  producer.join();
  if (!display.flush()) throw std::runtime_error("cannot write the output");

  std::ranges::sort(milliseconds);
  std::printf("%zu frames completed, %zu dropped", milliseconds.size(), dropped);
  if (!milliseconds.empty()) {
    std::printf("; %.3f ms each (median), %.3f ms at most", milliseconds[milliseconds.size() / 2],
                milliseconds.back());
  }
  std::puts("");
}

}  // namespace

int main(int argc, char** argv) {
  const bool every_frame = argc == 5 && std::string_view(argv[4]) == "--every-frame";
  if (argc != 4 && !every_frame) {
    std::fputs("Usage: capture_loop TEMPLATE PARTIAL.raw COMPLETED.raw [--every-frame]\n", stderr);
    return 2;
  }
  try {
    run(argv[1], argv[2], argv[3], every_frame);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "capture_loop: %s\n", error.what());
    return 1;
  }
}
