/// A capture loop: one thread delivers partial frames 60 times a second, another completes them.
///
///     capture_loop body.obj partial.raw completed.raw [--every-frame]
///
/// partial.raw holds frames of little-endian float32 x y z, NaN where a vertex was not seen. A
/// frame that comes before the last one was taken up is dropped in favour of the newer one, as a
/// live system must, and counted. --every-frame delivers without pause instead, and drops none. A
/// frame that is refused is told of on standard error and shown as the past foretells it.
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
  std::size_t number = 0;  // in the input; the template is frame 0
};

/// Holds the newest frame until it is taken. Buffers change hands, so nothing is allocated or
/// copied.
class Mailbox {
 public:
  explicit Mailbox(std::size_t floats) : frame_{std::vector<float>(floats)} {}

  /// Leaves `frame` here and gives an old buffer back. Returns false where that dropped a frame.
  /// Waits no longer once it is asked to stop.
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

  /// Waits for a frame; false at the end.
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

/// The sensor: returns how many of its frames were dropped.
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

/// Completes a frame in place. One that is refused has changed nothing, and counts as unobserved.
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
    throw std::runtime_error("the input does not hold whole raw frames of the template's vertices");
  }

  Mailbox mailbox(3 * k);
  Frame frame{std::vector<float>(3 * k)};
  std::size_t dropped = 0;
  // Where this function ends by an error, the producer is stopped and waited for.
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
