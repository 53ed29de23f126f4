/// dynmesh-complete: fills in the missing vertices of a stream of frames.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <dynmesh/version.hpp>
#include <exception>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

#include "api/report_fields.hpp"
#include "api/settings_table.hpp"
#include "base/checks.hpp"
#include "frame_streams.hpp"
#include "io/parse_number.hpp"

namespace {

using namespace dynmesh;

constexpr const char* help =
    R"(Usage: dynmesh-complete --template MESH --input FRAMES --output FRAMES [OPTION]...

Completes the missing vertices of every frame of a dynamic mesh, from that frame and
earlier frames only.

  --template MESH    the complete frame 0 and the faces: .obj or .ply
  --input FRAMES     frames 1, 2, ... with the vertices of MESH in the same order;
                     a vertex with a coordinate that is NaN or infinite is missing
  --output FRAMES    one completed frame for each input frame

FRAMES is raw little-endian float32, x y z for each vertex, frame after frame (.raw or
no suffix; "-" is standard input or output). Or it is a mesh file for each frame, with %d
or %04d in the place of its number, which is 1, 2 and so on without gaps. Positions are
read from .obj or .ply; .ply are written, with the triangles of MESH, into a folder that is
new or empty. No file is replaced.

  --method METHOD    'detail' preserves the local shape, rotated with the motion; 'motion'
                     averages motion vectors as in the paper, and is fast.
  --no-revisit       (method motion) Estimate each vertex only once, when it is reached;
                     errors then accumulate from frame to frame.
  --extra-iterations N
                     (method motion) Iterations after the one that reaches the last
                     unknown vertex.
  --disconnected RULE
                     Parts that no chain of edges connects to a known vertex 'follow'
                     a part that is seen, or 'hold' their position.
  --noise SIGMA      (method detail) The standard deviation of the noise of known positions,
                     in their unit, which are then smoothed; without it, they are exact.
  --reject-outliers  (method detail) Treat known vertices as unknown if they do not
                     move like those around them.
  --learn            (method detail) Learn from the completed frames; twice as slow.
  --uncertainty      (method detail) Compute the standard error of each vertex, in the
                     unit of the positions.
  --threads N        The number of threads that may work on a frame; more than one helps
                     from 23 553 vertices on.
  --report           print one JSON line per frame to standard error: its number, counts of
                     vertices, iterations, seconds, and quality: good, doubtful or ruined
  --help, --version  print this text, or the version

If a frame cannot be read or completed, or if the program is interrupted (Ctrl-C), all
frames before that are completed and written. Exit code: 0 success; 1 the data or a file
is not valid; 2 the command line is not valid; 3 all frames are written, but the result is
doubtful or probably ruined; 130 or 143 interrupted.
)";

struct Options {
  std::map<std::string, std::string> files = {
      {"--template", ""}, {"--input", ""}, {"--output", ""}};
  Settings settings;
  bool report = false;
};

/// Sets the setting of `option`, from what `argument` returns. Returns false if there is none.
template <class Argument>
bool set(Settings& settings, const std::string& option, const Argument& argument) {
  bool is_found = false;
  for_each_setting([&]<class Value>(const Setting& setting, Value Settings::*member, auto...) {
    std::string name = setting.name;
    std::ranges::replace(name, '_', '-');
    if constexpr (std::is_same_v<Value, bool>) {
      const bool default_value = Settings{}.*member;  // one that is on is turned off by --no-
      if (option != (default_value ? "--no-" : "--") + name) return;
      settings.*member = !default_value;
    } else if (option != "--" + name) {
      return;
    } else if constexpr (std::is_enum_v<Value>) {
      settings.*member = from_name<Value>(setting.name, argument());
    } else {
      using Number = std::conditional_t<std::is_same_v<Value, Index>, Index, double>;
      const std::string text = argument();
      const char* const last = text.data() + text.size();
      Number number = 0;
      const auto [end, error] = parse_number(text.data(), last, number);
      if (end != last || error != std::errc()) {
        refuse(option, "'", text, "' is not a ",
               std::is_same_v<Value, Index> ? "whole number" : "number", " in range");
      }
      settings.*member = number;
    }
    is_found = true;
  });
  return is_found;
}

/// Returns nothing if --help or --version has been printed.
std::optional<Options> parse_options(std::span<const std::string> words) {
  Options options;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& option = words[i];
    const auto argument = [&] {
      if (++i == words.size()) refuse(option, "needs a value");
      return words[i];
    };
    if (option == "--help") return std::fputs(help, stdout), std::nullopt;
    if (option == "--version") return std::puts("dynmesh-complete " DYNMESH_VERSION), std::nullopt;
    if (options.files.contains(option)) {
      options.files[option] = argument();
    } else if (option == "--report") {
      options.report = true;
    } else if (!set(options.settings, option, argument)) {
      refuse(option, "is no option; see --help");
    }
  }
  check_settings(options.settings);
  for (const auto& [option, name] : options.files) {
    if (name.empty()) refuse(option, "is missing; see --help");
  }
  return options;
}

void print(const FrameReport& report, std::size_t frame, bool has_errors) {
  std::fprintf(stderr,
               "{\"frame\": %zu, \"known\": %zu, \"filled\": %zu, \"disconnected\": %zu, "
               "\"rejected\": %zu, \"iterations\": %zu, \"seconds\": %.9f, \"quality\": \"%s\"",
               frame, report.known, report.filled, report.disconnected, report.rejected,
               report.iterations, report.seconds,
               quality_names[static_cast<std::size_t>(report.quality)]);
  if (has_errors) std::fprintf(stderr, ", \"standard_error\": %.9g", report.standard_error);
  std::fputs("}\n", stderr);
}

/// How good the completed frames are.
class SequenceQuality {
 public:
  void add(const FrameReport& report, std::size_t frame) {
    const std::size_t n_vertices = report.known + report.filled + report.disconnected;
    ++frames_;
    if (is_hardly_known(report.known, n_vertices)) ++empty_;
    // A few frames without any are no reason to doubt the others.
    if (report.known > 0 && report.quality > worst_.quality) {
      worst_ = report;
      number_ = frame;
    }
  }

  /// Prints why they are not good. Returns the exit code.
  [[nodiscard]] int report_to_user() const {
    constexpr std::array how = {"good", "doubtful", "probably ruined"};
    if (worst_.quality != Quality::good) {
      std::fprintf(stderr,
                   "dynmesh-complete: %s: frame %zu: %s; missing vertices must be NaN, and all "
                   "others in the order and the unit of the template\n",
                   how[static_cast<std::size_t>(worst_.quality)], number_, worst_.reason.data());
      return 3;
    }
    if (2 * empty_ <= frames_) return 0;
    std::fputs("dynmesh-complete: doubtful: hardly anything is known in most frames\n", stderr);
    return 3;
  }

 private:
  FrameReport worst_;
  std::size_t number_ = 0;  // of the first such frame
  std::size_t frames_ = 0, empty_ = 0;
};

/// Returns the exit code.
int complete(Options& options) {
  const TemplateMesh mesh = read_template(options.files["--template"]);
  auto completer = with_place(options.files["--template"], [&] {
    return Completer<float>(mesh.triangles(), mesh.points(), options.settings);
  });
  FrameReader reader(options.files["--input"]);
  FrameWriter writer(options.files["--output"], mesh);
  std::vector<float> frame(mesh.vertices.size());
  const Points<float> points(frame.data(), frame.size() / 3);
  std::exception_ptr damage;
  SequenceQuality quality;
  std::size_t number = 1;
  for (;; ++number) {
    FrameReport report;
    try {
      if (caught_signal != 0 || !reader.read(frame)) break;
      report = with_place(reader.place(), [&] { return completer.push(points, points); });
    } catch (const std::exception&) {
      if (number == 1) throw;
      damage = std::current_exception();
      break;
    }
    if (options.report) print(report, number, options.settings.uncertainty);
    quality.add(report, number);
    writer.write(frame);
  }
  if (number == 1 && caught_signal == 0) refuse(options.files["--input"], "contains no frame");
  if (number > 1) writer.finish();
  const int code = quality.report_to_user();
  if (damage) std::rethrow_exception(damage);
  return code;
}

}  // namespace

#ifdef _WIN32
int wmain(int argc, wchar_t** argv) {
#else
int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that exits is reported as an error
#endif
  stop_on(SIGINT);
  stop_on(SIGTERM);
  int code = 2;  // of an error
  int result = 0;
  try {
    std::vector<std::string> words;
    for (const fs::path word : std::span(argv, static_cast<std::size_t>(argc)).subspan(1)) {
      const std::u8string text = word.u8string();
      words.emplace_back(text.begin(), text.end());
    }
    auto options = parse_options(words);
    code = 1;
    if (options) result = complete(*options);
  } catch (const std::exception& error) {
    std::string message = error.what();
    if (dynamic_cast<const SettingError*>(&error) != nullptr) {  // "extra_iterations: ..."
      std::replace(message.begin(), std::ranges::find(message, ':'), '_', '-');
      message.insert(0, "--");
    }
    std::fprintf(stderr, "dynmesh-complete: %s\n", message.c_str());
    return code;
  }
  if (caught_signal == 0) return result;
  std::fputs("dynmesh-complete: interrupted; all frames completed so far have been written\n",
             stderr);
  return 128 + caught_signal;
}
