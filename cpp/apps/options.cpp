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

Fills in the missing vertices of every frame of a dynamic mesh, from that frame and
the past alone, one frame in memory at a time.

  --template MESH    the complete frame 0 and the faces: .obj, .ply or .off
  --input FRAMES     frames 1, 2, ... with the vertices of MESH in the same order;
                     a vertex with a coordinate that is NaN or infinite is missing
  --output FRAMES    one completed frame for each input frame

FRAMES is a point cache (.pc2), or raw little-endian float32, x y z for each vertex,
frame after frame (.raw, .f32, .float32, .bin, .dat or no suffix). "-" is standard
input or output, raw.

  --method METHOD    "motion": the paper's, fast (default); "detail": keeps the shape of
                     the mesh, turned with the motion: truer, at milliseconds a frame
  --unseen RULE      parts of the mesh without any known vertex: "follow" the surface
                     nearest to them (default), or "hold" still
  --extra-iterations N   of method motion: more iterations per frame (default 0); ten
                     take off a third of the error on many sequences
  --no-revisit       estimate each vertex only once: another reading of the paper
  --noise SIGMA      of method detail: the known positions are noisy, by this standard
                     deviation in their unit, and are smoothed
  --reject-outliers  of method detail: known positions that move unlike those around
                     them are taken as missing
  --threads N        that a frame may use (default 1)
  --report           one JSON line per frame on standard error: known, filled, unseen,
                     rejected, iterations, seconds
  --overwrite        replace an output file that exists
  --help, --version

If the input ends within a frame or holds one that no completion can use, or an
interrupt (Ctrl-C) ends the program, all whole frames before that are completed and
written. Exit code: 0 done; 1 the data or a file is bad; 2 the call is; 130 or 143
interrupted.

Examples:
  dynmesh-complete --template body.obj --input partial.pc2 --output completed.pc2
  sensor | dynmesh-complete --template body.ply --input - --output - | renderer
)";

/// `kind`: what the text should be, as in "is not a whole number".
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

/// The library's "extra_iterations: ..." as "--extra-iterations: ...".
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
          throw UsageError("see dynmesh-complete --help");  // getopt said what is wrong
      }
    }
    check_settings(options.settings);
  } catch (const std::invalid_argument& error) {
    throw UsageError(as_option(error.what()));
  }
  if (optind < argc) throw UsageError(std::string("what is '") + argv[optind] + "'? see --help");
  if (!options.template_path) throw UsageError("--template is missing; see --help");
  if (!options.input) throw UsageError("--input is missing; see --help");
  if (!options.output) throw UsageError("--output is missing; see --help");
  return options;
}

}  // namespace dynmesh::app
