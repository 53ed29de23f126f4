#include "options.hpp"

#include <getopt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <dynmesh/version.hpp>
#include <stdexcept>
#include <system_error>

#include "frame_files.hpp"

namespace dynmesh::app {
namespace {

constexpr const char* help =
    R"(Usage: dynmesh-complete --template MESH --input FRAMES --output FRAMES [OPTION]...

Completes the missing vertices of every frame of a dynamic mesh, from that frame and
earlier frames only. One frame is in memory at a time.

  --template MESH    the complete frame 0 and the faces: .obj, .ply or .off
  --input FRAMES     frames 1, 2, ... with the vertices of MESH in the same order;
                     a vertex with a coordinate that is NaN or infinite is missing
  --output FRAMES    one completed frame for each input frame

FRAMES is a point cache (.pc2), or raw little-endian float32, x y z for each vertex,
frame after frame (.raw, .f32, .float32, .bin, .dat or no suffix). "-" is standard
input or output, raw.

  --method METHOD    "motion": the method of the paper, fast (default); "detail":
                     preserves the shape of the mesh, rotated with the motion; more
                     accurate, but takes milliseconds per frame
  --unseen RULE      for parts of the mesh without any known vertex: "follow" the
                     nearest surface (default), or "hold" their positions
  --extra-iterations N   for method motion: additional iterations per frame (default
                     0); ten reduce the error by a third on many sequences
  --no-revisit       for method motion: estimate each vertex only once per frame,
                     another interpretation of the paper
  --noise SIGMA      for method detail: the known positions have noise of this standard
                     deviation, in their unit, and are smoothed
  --reject-outliers  for method detail: treat known positions whose motion contradicts
                     that of their neighbours as missing
  --threads N        the number of threads that may work on a frame (default 1)
  --report           print one JSON line per frame to standard error: known, filled,
                     unseen, rejected, iterations, seconds
  --overwrite        replace an existing output file
  --help             print this text
  --version          print the version

If the input ends within a frame or contains a frame that cannot be completed, or if
the program is interrupted (Ctrl-C), all frames before that are completed and written.
Exit code: 0 success; 1 the data or a file is not valid; 2 the command line is not
valid; 130 or 143 interrupted.

Examples:
  dynmesh-complete --template body.obj --input partial.pc2 --output completed.pc2
  sensor | dynmesh-complete --template body.ply --input - --output - | renderer
)";

/// `kind` is what the text should be, as in "is not a whole number".
template <class Number>
Number parse(const char* option, const std::string& text, const char* kind) {
  Number value = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (stopped != end || error == std::errc::invalid_argument) {
    throw UsageError(std::string(option) + ": '" + text + "' is not a " + kind);
  }
  if (error != std::errc()) {
    throw UsageError(std::string(option) + ": " + text + " is out of range");
  }
  return value;
}

/// Converts "extra_iterations: ..." of the library to "--extra-iterations: ...".
std::string as_option(std::string message) {
  std::replace(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(message.find(':')),
               '_', '-');
  return "--" + message;
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  enum : int {
    template_path = 256,
    input,
    output,
    method,
    unseen,
    extra,
    no_revisit,
    noise,
    reject_outliers,
    threads,
    report,
    overwrite
  };
  constexpr std::array known = {option{"template", required_argument, nullptr, template_path},
                                option{"input", required_argument, nullptr, input},
                                option{"output", required_argument, nullptr, output},
                                option{"method", required_argument, nullptr, method},
                                option{"unseen", required_argument, nullptr, unseen},
                                option{"extra-iterations", required_argument, nullptr, extra},
                                option{"no-revisit", no_argument, nullptr, no_revisit},
                                option{"noise", required_argument, nullptr, noise},
                                option{"reject-outliers", no_argument, nullptr, reject_outliers},
                                option{"threads", required_argument, nullptr, threads},
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
        case method:
          options.settings.method = method_from_name(optarg);
          break;
        case unseen:
          options.settings.unseen = unseen_rule_from_name(optarg);
          break;
        case extra:
          options.settings.extra_iterations =
              parse<Index>("--extra-iterations", optarg, "whole number");
          break;
        case no_revisit:
          options.settings.revisit = false;
          break;
        case noise:
          options.settings.noise = parse<double>("--noise", optarg, "number");
          break;
        case reject_outliers:
          options.settings.reject_outliers = true;
          break;
        case threads:
          options.settings.threads = parse<Index>("--threads", optarg, "whole number");
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
          throw UsageError("see dynmesh-complete --help");  // getopt has printed what is wrong
      }
    }
    check_settings(options.settings);
  } catch (const std::invalid_argument& error) {
    throw UsageError(as_option(error.what()));
  }
  if (optind < argc)
    throw UsageError(std::string("unexpected argument '") + argv[optind] + "'; see --help");
  if (!options.template_path) throw UsageError("--template is missing; see --help");
  if (!options.input) throw UsageError("--input is missing; see --help");
  if (!options.output) throw UsageError("--output is missing; see --help");
  return options;
}

}  // namespace dynmesh::app
