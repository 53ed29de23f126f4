/// dynmesh-complete: fills in the missing vertices of a stream of frames.
#include <getopt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <dynmesh/dynmesh.hpp>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "frame_files.hpp"

namespace {

using dynmesh::app::DataError;
using dynmesh::app::FrameReader;
using dynmesh::app::FrameWriter;
using dynmesh::app::UsageError;

constexpr const char* help =
    R"(Usage: dynmesh-complete --template MESH --input FRAMES --output FRAMES [OPTION]...

Fills in the missing vertices of every frame of a dynamic mesh, from that frame and
the past alone, one frame in memory at a time.

  --template MESH    the complete frame 0 and the faces: .obj, .ply or .off
  --input FRAMES     frames 1, 2, ... with the vertices of MESH in the same order;
                     a vertex with a coordinate that is NaN or infinite is missing
  --output FRAMES    one completed frame for each input frame

FRAMES is a point cache (.pc2), or raw little-endian float32, x y z for each vertex,
frame after frame (.raw, .f32, .float32, .bin, .dat or no suffix). "-" is standard
input or output, raw.

  --unseen RULE      parts of the mesh without any known vertex: "follow" the surface
                     nearest to them (default), or "hold" still
  --extra-iterations N   more iterations per frame (default 0); ten often halve the error
  --no-revisit       estimate each vertex only once: another reading of the paper
  --report           one JSON line per frame on standard error: known, filled, unseen,
                     iterations, seconds
  --overwrite        replace an output file that exists
  --help, --version

If the input ends within a frame or holds one that no completion can use, or an
interrupt (Ctrl-C) ends the program, all whole frames before that are completed and
written. Exit code: 0 done; 1 the data
or a file is bad; 2 the call is; 130 or 143 interrupted.

Examples:
  dynmesh-complete --template body.obj --input partial.pc2 --output completed.pc2
  sensor | dynmesh-complete --template body.ply --input - --output - | renderer
)";

// A signal handler reaches nothing else.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t caught_signal = 0;

/// Reading and writing stop at the next frame, so that what was completed is not lost.
void stop_on(int signal) {
  struct sigaction action {};
  action.sa_handler = [](int number) { caught_signal = number; };
  sigaction(signal, &action, nullptr);  // no SA_RESTART: a read that waits comes back
}

struct Options {
  std::optional<std::string> template_path, input, output;
  dynmesh::Settings settings;
  bool report = false;
  bool overwrite = false;
};

dynmesh::Index parse_count(const char* option, const std::string& text) {
  dynmesh::Index value = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (stopped != end || error == std::errc::invalid_argument) {
    throw UsageError(std::string(option) + ": '" + text + "' is not a whole number");
  }
  if (error != std::errc())
    throw UsageError(std::string(option) + ": " + text + " is out of range");
  return value;
}

/// The library's "extra_iterations: ..." as "--extra-iterations: ...".
std::string as_option(std::string message) {
  std::replace(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(message.find(':')),
               '_', '-');
  return "--" + message;
}

/// Nothing where the answer was printed already.
std::optional<Options> parse(int argc, char** argv) {
  enum : int { template_path = 256, input, output, unseen, extra, no_revisit, report, overwrite };
  constexpr std::array known = {option{"template", required_argument, nullptr, template_path},
                                option{"input", required_argument, nullptr, input},
                                option{"output", required_argument, nullptr, output},
                                option{"unseen", required_argument, nullptr, unseen},
                                option{"extra-iterations", required_argument, nullptr, extra},
                                option{"no-revisit", no_argument, nullptr, no_revisit},
                                option{"report", no_argument, nullptr, report},
                                option{"overwrite", no_argument, nullptr, overwrite},
                                option{"help", no_argument, nullptr, 'h'},
                                option{"version", no_argument, nullptr, 'v'},
                                option{nullptr, 0, nullptr, 0}};
  Options options;
  try {
    for (int c = 0; (c = getopt_long(argc, argv, "h", known.data(), nullptr)) != -1;) {
      switch (c) {
        case template_path:
          options.template_path = optarg;
          break;
        case input:
          options.input = optarg;
          break;
        case output:
          options.output = optarg;
          break;
        case unseen:
          options.settings.unseen = dynmesh::unseen_rule_from_name(optarg);
          break;
        case extra:
          options.settings.extra_iterations = parse_count("--extra-iterations", optarg);
          break;
        case no_revisit:
          options.settings.revisit = false;
          break;
        case report:
          options.report = true;
          break;
        case overwrite:
          options.overwrite = true;
          break;
        case 'h':
          std::fputs(help, stdout);
          return {};
        case 'v':
          std::puts("dynmesh-complete " DYNMESH_VERSION);
          return {};
        default:
          throw UsageError("see dynmesh-complete --help");  // getopt said what is wrong
      }
    }
    dynmesh::check_settings(options.settings);
  } catch (const std::invalid_argument& error) {
    throw UsageError(as_option(error.what()));
  }
  if (optind < argc) throw UsageError(std::string("what is '") + argv[optind] + "'? see --help");
  if (!options.template_path) throw UsageError("--template is missing; see --help");
  if (!options.input) throw UsageError("--input is missing; see --help");
  if (!options.output) throw UsageError("--output is missing; see --help");
  return options;
}

void print(const dynmesh::FrameReport& report, std::size_t frame) {
  std::fprintf(stderr,
               "{\"frame\": %zu, \"known\": %zu, \"filled\": %zu, \"unseen\": %zu, "
               "\"iterations\": %zu, \"seconds\": %.9f}\n",
               frame, report.known, report.filled, report.unseen, report.iterations,
               report.seconds);
}

/// What `call` returns; what the library refuses in it is said to be in `place`.
template <class Call>
auto blaming(const std::string& place, const Call& call) {
  try {
    return call();
  } catch (const std::invalid_argument& error) {
    throw DataError(place + ": " + error.what());
  }
}

void complete(const Options& options) {
  (void)dynmesh::app::format_of(*options.input);
  (void)dynmesh::app::format_of(*options.output);
  const dynmesh::TemplateMesh mesh = dynmesh::read_template(*options.template_path);
  dynmesh::Completer<float> completer = blaming(*options.template_path, [&] {
    return dynmesh::Completer<float>(mesh.triangles(), mesh.points(), options.settings);
  });

  std::error_code missing;
  if (std::filesystem::equivalent(*options.input, *options.output, missing)) {
    throw UsageError(*options.output + ": is the input; completing it in place would lose it");
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
      report = blaming(*options.input + ": frame " + std::to_string(number),
                       [&] { return completer.push(points, points); });
    } catch (const DataError& error) {
      damage = error;  // what was completed before it is worth having
      break;
    }
    if (options.report) print(report, number);
    writer.write(frame);
  }
  if (damage && writer.n_frames() == 0) throw DataError(*damage);  // an older file stays
  writer.finish();
  if (damage) throw DataError(*damage);
}

}  // namespace

int main(int argc, char** argv) {
  // A reader that goes away shows as a failed write, which is reported.
  std::signal(SIGPIPE, SIG_IGN);
  stop_on(SIGINT);
  stop_on(SIGTERM);
  try {
    if (const auto options = parse(argc, argv)) complete(*options);
    if (caught_signal != 0) {
      std::fprintf(stderr, "dynmesh-complete: interrupted; the frames so far are written\n");
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
