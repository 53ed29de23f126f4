/// A capture loop: one thread delivers partial frames 60 times a second, another completes them.
///
///     capture_loop body.obj partial.raw completed.raw [--every-frame]
///
/// partial.raw contains frames of little-endian float32 x y z, with NaN for vertices that were not
/// observed. As in any live system, a frame that has not been taken when the next one arrives is
/// replaced by it; such dropped frames are counted. With --every-frame, frames are delivered
/// without a pause and none is dropped. If a frame is refused, a message is printed to standard
/// error, and the frame is replaced by one predicted from earlier frames.
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
#include <stop_token>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace {

struct Frame {
  std::vector<float> positions;
  std::size_t number = 0;  // counted from 1; the template is frame 0
};

/// Stores the newest frame until it is taken. Buffers are swapped, so nothing is allocated or
/// copied.
class Mailbox {
 public:
  explicit Mailbox(std::size_t floats) : frame_{std::vector<float>(floats)} {}

  /// Stores `frame` and returns an old buffer in it. Returns false if this dropped a frame. Stops
  /// waiting if a stop is requested.
  bool deliver(Frame& frame, bool wait_until_taken, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    if (wait_until_taken) changed_.wait(lock, stop, [&] { return !full_; });
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

  /// Waits for a frame. Returns false after the last one.
  bool take(Frame& frame) {
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
  std::condition_variable_any changed_;
  Frame frame_;
  bool full_ = false;
  bool closed_ = false;
};

/// Simulates the sensor. Returns the number of dropped frames.
std::size_t produce(std::ifstream& sensor, Frame frame, bool every_frame, Mailbox& mailbox,
                    const std::stop_token& stop) {
  constexpr auto period = std::chrono::nanoseconds(std::chrono::seconds(1)) / 60;
  std::size_t dropped = 0;
  const auto bytes = static_cast<std::streamsize>(frame.positions.size() * sizeof(float));
  auto due = std::chrono::steady_clock::now();
  for (std::size_t number = 1; !stop.stop_requested(); ++number) {
    if (!sensor.read(reinterpret_cast<char*>(frame.positions.data()), bytes)) break;
    frame.number = number;
    if (!every_frame) std::this_thread::sleep_until(due += period);
    dropped += mailbox.deliver(frame, every_frame, stop) ? 0U : 1U;
  }
  mailbox.close();
  return dropped;
}

/// Completes a frame in place. A refused frame leaves the completer unchanged and is replaced by
/// one in which nothing was observed.
dynmesh::FrameReport complete(dynmesh::Completer<float>& completer, Frame& frame) {
  const dynmesh::Points<float> points(frame.positions.data(), completer.n_vertices());
  try {
    return completer.push(points, points);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "capture_loop: frame %zu refused: %s\n", frame.number, error.what());
    return completer.skip(points);
  }
}

void run(const char* template_path, const char* input, const char* output, bool every_frame) {
  const dynmesh::TemplateMesh mesh = dynmesh::read_template(template_path);
  dynmesh::Completer<float> completer(mesh.triangles(), mesh.points());
  const std::size_t k = completer.n_vertices();

  std::ifstream sensor(input, std::ios::binary);
  std::ofstream display(output, std::ios::binary);
  if (!sensor || !display) throw std::runtime_error("cannot open the input or the output");
  if (std::filesystem::file_size(input) % (3 * k * sizeof(float)) != 0) {
    throw std::runtime_error("the size of the input is not a multiple of the size of a frame");
  }

  Mailbox mailbox(3 * k);
  Frame frame{std::vector<float>(3 * k)};
  std::size_t dropped = 0;
  // If this function throws, the destructor stops and joins the producer.
  std::jthread producer([&, buffer = frame](const std::stop_token& stop) mutable {
    dropped = produce(sensor, std::move(buffer), every_frame, mailbox, stop);
  });

  std::vector<double> milliseconds;
  while (mailbox.take(frame)) {
    milliseconds.push_back(1e3 * complete(completer, frame).seconds);
    if (!display.write(reinterpret_cast<const char*>(frame.positions.data()),
                       static_cast<std::streamsize>(frame.positions.size() * sizeof(float)))) {
      break;
    }
  }
  if (!display.flush()) throw std::runtime_error("cannot write the output");
  producer.join();

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
