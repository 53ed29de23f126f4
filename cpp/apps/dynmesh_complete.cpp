/// dynmesh-complete: fills in the missing vertices of a stream of frames.
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <dynmesh/version.hpp>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <regex>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>
#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

#include "api/settings_table.hpp"
#include "base/checks.hpp"
#include "io/parse_number.hpp"
#include "io/paths.hpp"

namespace {

using namespace dynmesh;
namespace fs = std::filesystem;

constexpr const char* help =
    R"(Usage: dynmesh-complete --template MESH --input FRAMES --output FRAMES [OPTION]...

Completes the missing vertices of every frame of a dynamic mesh, from that frame and
earlier frames only.

  --template MESH    the complete frame 0 and the faces: .obj, .ply or .off
  --input FRAMES     frames 1, 2, ... with the vertices of MESH in the same order;
                     a vertex with a coordinate that is NaN or infinite is missing
  --output FRAMES    one completed frame for each input frame

FRAMES is raw little-endian float32, x y z for each vertex, frame after frame (.raw or
no suffix; "-" is standard input or output). Or it is a mesh file for each frame, with %d
or %04d in the place of its number. Positions are read from .obj or .ply until there is no
file of the next number; .ply are written, with the triangles of MESH.

  --method METHOD    'detail' preserves the shape of frame 0 and of the last frame,
                     rotated with the motion. 'motion' averages motion vectors as in
                     the paper, and is fast.
  --no-revisit       (method motion) Estimate each vertex only once, when it is
                     reached: another reading of the paper, in which errors accumulate
                     from frame to frame.
  --extra-iterations N
                     (method motion) Iterations after the one that reaches the last
                     unknown vertex.
  --disconnected RULE
                     Parts that no chain of edges connects to a known vertex 'follow'
                     the nearest surface, or 'hold' their position.
  --noise SIGMA      (method detail) The standard deviation of the noise of the known
                     positions, in the unit of the positions; they are smoothed.
                     Without it, they are exact.
  --reject-outliers  (method detail) Treat known vertices as unknown if they do not
                     move like those around them.
  --learn            (method detail) Learn from the completed frames how the shape of
                     the subject varies: more accurate if motions recur, and about
                     twice as slow.
  --uncertainty      (method detail) Compute the standard error of each vertex, in the
                     unit of the positions.
  --threads N        The number of threads that may work on a frame; more than one helps
                     from 23 553 vertices on.
  --report           print one JSON line per frame to standard error
  --overwrite        replace existing output files
  --help, --version  print this text, or the version

If a frame cannot be read or completed, or if the program is interrupted (Ctrl-C), all
frames before that are completed and written. Exit code: 0 success; 1 the data or a file
is not valid; 2 the command line is not valid; 130 or 143 interrupted.
)";

/// SIGINT or SIGTERM, once one was caught. A signal handler can access nothing else.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t caught_signal = 0;

/// Lets a signal end the program after the current frame, so that the completed ones are not lost.
void stop_on(int signal) {
  const auto handler = [](int number) { caught_signal = number; };
#ifdef _WIN32
  std::signal(signal, handler);  // reading goes on until the next frame or the end of the input
#else
  struct sigaction before {
  }, action{};
  action.sa_handler = handler;  // without SA_RESTART, a blocking read returns
  sigaction(signal, nullptr, &before);
  // A background job of a shell script ignores interrupts from its start.
  if (before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
#endif
}

[[noreturn]] void refuse_by_system(const std::string& place) {
  refuse(place, std::generic_category().message(errno));
}

/// Returns what `call` returns. Adds `place` to the message of an error of the library.
template <class Call>
auto with_place(const std::string& place, const Call& call) {
  try {
    return call();
  } catch (const std::invalid_argument& error) {
    refuse(place, error.what());
  }
}

/// Closes a file, and removes one that is not complete.
struct CloseFile {
  std::string partial = {};  ///< its name for the time being, if it has one
  void operator()(std::FILE* file) const {
    (void)std::fclose(file);
    std::error_code ignored;
    if (!partial.empty()) fs::remove(path_of(partial), ignored);
  }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// Returns an open file, or `standard` if the name is "-".
File open_file(const std::string& name, const char* mode, std::FILE* standard) {
#ifdef _WIN32
  if (name == "-") (void)_setmode(_fileno(standard), _O_BINARY);
  const auto open = [&] { return _wfopen(path_of(name).c_str(), path_of(mode).c_str()); };
#else
  const auto open = [&] { return std::fopen(name.c_str(), mode); };
#endif
  File file(name == "-" ? standard : open());
  if (!file) refuse_by_system(name);
  return file;
}

/// Whether `name` stands for numbered mesh files instead of one raw stream. Throws if for neither.
bool is_numbered(const std::string& name, const std::string& suffixes) {
  const std::string suffix = lowercase_suffix(name);
  if (suffix.empty() || suffix == ".raw") return false;
  const std::regex numbered(R"([^%]*%(0[1-9])?d[^%/\\]*\.()" + suffixes + ")", std::regex::icase);
  if (std::regex_match(name, numbered)) return true;
  refuse(name, "must be a raw stream, with the suffix .raw or none, or ", suffixes,
         " files with %d or %04d in the place of the number");
}

/// Returns the name of a numbered file. `name` has passed `is_numbered`.
std::string file_of(const std::string& name, std::size_t number) {
  std::string file(name.size() + 20, '\0');
  const int size = std::snprintf(file.data(), file.size(), name.c_str(), static_cast<int>(number));
  file.resize(static_cast<std::size_t>(size));
  return file;
}

/// Reads frames (n_vertices, 3), which are counted from 1.
class FrameReader {
 public:
  explicit FrameReader(const std::string& name) : name_(name) {
    if (!is_numbered(name, "obj|ply")) stream_ = open_file(name, "rb", stdin);
  }

  /// Returns what errors call the frame that was read last.
  [[nodiscard]] std::string place() const {
    if (!stream_) return file_of(name_, n_read_);
    return joined(name_ == "-" ? "standard input" : name_, ": frame ", n_read_);
  }

  /// Returns false at the end and if a signal interrupts reading.
  bool read(std::span<float> frame) {
    ++n_read_;
    std::size_t got = 0;
    if (stream_) {
      got = std::fread(frame.data(), 1, frame.size_bytes(), stream_.get());
      const bool is_whole = got == frame.size_bytes();
      if (!is_whole && caught_signal != 0) return false;
      if (!is_whole && std::ferror(stream_.get()) != 0) refuse_by_system(place());
      if (got == 0) return false;
    } else {
      if (n_read_ > 1 && !fs::exists(path_of(place()))) return false;
      const std::vector<float> positions = read_positions(place());
      got = sizeof(float) * positions.size();
      std::copy_n(positions.begin(), std::min(positions.size(), frame.size()), frame.begin());
    }
    if (got == frame.size_bytes()) return true;
    refuse(place(), "has ", got / 12, " vertices", got % 12 == 0 ? "" : " and a part of one",
           ", but the template has ", frame.size() / 3);
  }

 private:
  std::string name_;
  File stream_;
  std::size_t n_read_ = 0;
};

/// A file that has its name only once it is complete. A pipe gets each frame at once.
class OutputFile {
 public:
  OutputFile(std::string name, bool overwrite) : name_(std::move(name)) {
    const fs::path path = path_of(name_);
    if (name_ == "-" || (fs::exists(path) && !fs::is_regular_file(path))) {
      file_ = open_file(name_, "wb", stdout);
      return;
    }
    if (!overwrite && fs::exists(path)) refuse(name_, "exists already; --overwrite replaces it");
    const std::string partial = name_ + ".part";
    if (fs::exists(path_of(partial))) {
      refuse(partial, "exists; remove it, unless another run is writing it");
    }
    file_ = open_file(partial, "wb", nullptr);
    file_.get_deleter().partial = partial;
  }

  void write(const std::string& bytes) {
    const bool is_taken = std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) == bytes.size();
    if (is_taken && std::fflush(file_.get()) == 0) return;
    refuse_by_system((name_ == "-" ? "standard output" : name_) + ": cannot be written");
  }

  void finish() {
    const std::string partial = std::exchange(file_.get_deleter().partial, {});
    file_.reset();
    if (partial.empty()) return;
    std::error_code error;  // Windows replaces no file that another program has open
    fs::rename(path_of(partial), path_of(name_), error);
    if (error) refuse(name_, "cannot be replaced: ", error.message(), "; it is in ", partial);
  }

 private:
  std::string name_;
  File file_;
};

std::string ply_of(const std::string& positions, const TemplateMesh& mesh) {
  std::string text = joined(
      "ply\nformat binary_little_endian 1.0\nelement vertex ", mesh.points().count,
      "\nproperty float x\nproperty float y\nproperty float z\nelement face ",
      mesh.triangles().count, "\nproperty list uchar int vertex_indices\nend_header\n", positions);
  for (std::size_t i = 0; i < mesh.faces.size(); i += 3) {
    text.append(1, 3).append(reinterpret_cast<const char*>(&mesh.faces[i]), 3 * sizeof(Index));
  }
  return text;
}

struct Options {
  std::map<std::string, std::string> files = {
      {"--template", ""}, {"--input", ""}, {"--output", ""}};
  Settings settings;
  bool report = false;
  bool overwrite = false;
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
    } else if (option == "--overwrite") {
      options.overwrite = true;
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

void print(const FrameReport& report, std::size_t frame) {
  std::fprintf(stderr,
               "{\"frame\": %zu, \"known\": %zu, \"filled\": %zu, \"disconnected\": %zu, "
               "\"rejected\": %zu, \"iterations\": %zu, \"seconds\": %.9f, "
               "\"standard_error\": %.9g}\n",
               frame, report.known, report.filled, report.disconnected, report.rejected,
               report.iterations, report.seconds, report.standard_error);
}

void complete(Options& options) {
  const std::string& output = options.files["--output"];
  const bool is_raw = !is_numbered(output, "ply");
  const TemplateMesh mesh = read_template(options.files["--template"]);
  auto completer = with_place(options.files["--template"], [&] {
    return Completer<float>(mesh.triangles(), mesh.points(), options.settings);
  });
  FrameReader reader(options.files["--input"]);
  std::optional<OutputFile> file;
  if (is_raw) file.emplace(output, options.overwrite);
  std::vector<float> frame(mesh.vertices.size());
  const Points<float> points(frame.data(), frame.size() / 3);
  std::exception_ptr damage;
  std::size_t number = 1;
  for (;; ++number) {
    FrameReport report;
    try {
      if (caught_signal != 0 || !reader.read(frame)) break;
      report = with_place(reader.place(), [&] { return completer.push(points, points); });
    } catch (const std::exception&) {
      if (number == 1) throw;  // an output that exists stays as it is
      damage = std::current_exception();
      break;
    }
    if (options.report) print(report, number);
    const std::string bytes(reinterpret_cast<const char*>(frame.data()),
                            sizeof(float) * frame.size());
    if (!is_raw) file.emplace(file_of(output, number), options.overwrite);
    file->write(is_raw ? bytes : ply_of(bytes, mesh));
    if (!is_raw) file->finish();
  }
  if (is_raw) file->finish();
  // Files that follow are of a longer sequence that this one replaces.
  while (!is_raw && options.overwrite && fs::remove(path_of(file_of(output, number)))) ++number;
  if (damage) std::rethrow_exception(damage);
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
  int code = 2;
  try {
    std::vector<std::string> words;
    for (const fs::path word : std::span(argv, static_cast<std::size_t>(argc)).subspan(1)) {
      const std::u8string text = word.u8string();
      words.emplace_back(text.begin(), text.end());
    }
    auto options = parse_options(words);
    code = 1;
    if (options) complete(*options);
  } catch (const std::exception& error) {
    std::string message = error.what();
    if (dynamic_cast<const SettingError*>(&error) != nullptr) {  // "extra_iterations: ..."
      std::replace(message.begin(), std::ranges::find(message, ':'), '_', '-');
      message.insert(0, "--");
    }
    std::fprintf(stderr, "dynmesh-complete: %s\n", message.c_str());
    return code;
  }
  if (caught_signal == 0) return 0;
  std::fputs("dynmesh-complete: interrupted; all frames completed so far have been written\n",
             stderr);
  return 128 + caught_signal;
}
