/// dynmesh-complete: fills in the missing vertices of a stream of frames.
#include <csignal>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "frame_files.hpp"
#include "options.hpp"

namespace {

using dynmesh::app::DataError;
using dynmesh::app::FrameReader;
using dynmesh::app::FrameWriter;
using dynmesh::app::Options;
using dynmesh::app::UsageError;

// A signal handler can access nothing else.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t caught_signal = 0;

/// Makes a signal stop the program after the current frame, so that the completed frames are not
/// lost. A signal that was ignored when the program was started stays ignored, as background jobs
/// of a shell script expect.
void stop_on(int signal) {
  struct sigaction action {};
  sigaction(signal, nullptr, &action);
  if (action.sa_handler == SIG_IGN) return;
  action = {};
  action.sa_handler = [](int number) { caught_signal = number; };
  sigaction(signal, &action, nullptr);  // without SA_RESTART, a blocking read returns
}

void print(const dynmesh::FrameReport& report, std::size_t frame) {
  std::fprintf(stderr,
               "{\"frame\": %zu, \"known\": %zu, \"filled\": %zu, \"unseen\": %zu, "
               "\"rejected\": %zu, \"iterations\": %zu, \"seconds\": %.9f}\n",
               frame, report.known, report.filled, report.unseen, report.rejected,
               report.iterations, report.seconds);
}

/// Returns what `call` returns. Adds `where` to the message of an error of the library.
template <class Call>
auto with_context(const std::string& where, const Call& call) {
  try {
    return call();
  } catch (const std::invalid_argument& error) {
    throw DataError(where + ": " + error.what());
  }
}

void complete(const Options& options) {
  (void)dynmesh::app::format_of(*options.input);
  (void)dynmesh::app::format_of(*options.output);
  const dynmesh::TemplateMesh mesh = dynmesh::read_template(*options.template_path);
  dynmesh::Completer<float> completer = with_context(*options.template_path, [&] {
    return dynmesh::Completer<float>(mesh.triangles(), mesh.points(), options.settings);
  });

  std::error_code missing;
  if (std::filesystem::equivalent(*options.input, *options.output, missing)) {
    throw UsageError(*options.output +
                     ": is also the input file, which would be overwritten; choose another output");
  }
  FrameReader reader(*options.input, completer.n_vertices());
  FrameWriter writer(*options.output, completer.n_vertices(), reader.timing(), options.overwrite);
  std::vector<float> frame(3 * completer.n_vertices());
  const dynmesh::Points<float> points(frame.data(), completer.n_vertices());
  std::optional<DataError> damage;
  for (std::size_t number = 1;; ++number) {
    dynmesh::FrameReport report;
    try {
      if (caught_signal != 0 || !reader.read(frame)) break;
      report = with_context(*options.input + ": frame " + std::to_string(number),
                            [&] { return completer.push(points, points); });
    } catch (const DataError& error) {
      damage = error;  // keep the frames that were completed before it
      break;
    }
    if (options.report) print(report, number);
    writer.write(frame);
  }
  if (damage && writer.n_frames() == 0)
    throw DataError(*damage);  // leave an existing file unchanged
  writer.finish();
  if (damage) throw DataError(*damage);
}

}  // namespace

int main(int argc, char** argv) {
  // If the reader of a pipe exits, writing fails, which is reported.
  std::signal(SIGPIPE, SIG_IGN);
  stop_on(SIGINT);
  stop_on(SIGTERM);
  try {
    if (const auto options = dynmesh::app::parse_options(argc, argv)) complete(*options);
    if (caught_signal != 0) {
      std::fprintf(
          stderr, "dynmesh-complete: interrupted; all frames completed so far have been written\n");
      return 128 + caught_signal;
    }
    return 0;
  } catch (const UsageError& error) {
    std::fprintf(stderr, "dynmesh-complete: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "dynmesh-complete: %s\n", error.what());
    return 1;
  }
}
