/// Streams of frames in files: raw ones, and numbered meshes.
#pragma once

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <filesystem>
#include <memory>
#include <regex>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>
#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

#include "base/checks.hpp"
#include "io/paths.hpp"

namespace dynmesh {

namespace fs = std::filesystem;

/// SIGINT or SIGTERM, once one was caught. A signal handler can access nothing else.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
inline volatile std::sig_atomic_t caught_signal = 0;

/// Lets a signal end the program after the current frame, so that the completed ones are not lost.
inline void stop_on(int signal) {
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

[[noreturn]] inline void refuse_by_system(const std::string& place) {
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
inline File open_file(const std::string& name, const char* mode, std::FILE* standard) {
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
inline bool is_numbered(const std::string& name, const std::string& suffixes) {
  const std::string suffix = lowercase_suffix(name);
  if (suffix.empty() || suffix == ".raw") return false;
  const std::regex numbered(R"([^%]*%(0[1-9])?d[^%/\\]*\.()" + suffixes + ")", std::regex::icase);
  if (std::regex_match(name, numbered)) return true;
  refuse(name, "must be a raw stream, with the suffix .raw or none, or ", suffixes,
         " files with %d or %04d in the place of the number");
}

/// Returns the name of a numbered file. `name` has passed `is_numbered`.
inline std::string file_of(const std::string& name, std::size_t number) {
  std::string file(name.size() + 20, '\0');
  const int size = std::snprintf(file.data(), file.size(), name.c_str(), static_cast<int>(number));
  file.resize(static_cast<std::size_t>(size));
  return file;
}

/// Whether there is anything of this name, if only a link to nothing.
inline bool is_taken(const fs::path& path) { return fs::exists(fs::symlink_status(path)); }

/// Throws if one of numbered files would not be read, as its number is 0 or follows a gap.
inline void check_numbers(const std::string& name) {
  const std::string pattern = path_of(name).filename().string();
  const std::size_t begin = pattern.find('%');
  std::size_t last = 0;
  std::error_code ignored;  // reading the first file gives the message of the system
  const fs::path folder = fs::absolute(path_of(name)).parent_path();
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string file = entry.path().filename().string();
    std::size_t number = 0;
    if (file.size() < begin) continue;
    const auto read = std::from_chars(file.data() + begin, file.data() + file.size(), number);
    if (read.ec != std::errc() || file_of(pattern, number) != file) continue;
    if (number == 0) refuse(file_of(name, 0), "would not be read; number the frames from 1");
    last = std::max(last, number);
  }
  for (std::size_t number = 1; number < last; ++number) {
    if (fs::exists(path_of(file_of(name, number)))) continue;
    refuse(file_of(name, number), "is missing, but there is ", file_of(name, last));
  }
}

/// Reads frames (n_vertices, 3), which are counted from 1.
class FrameReader {
 public:
  explicit FrameReader(const std::string& name) : name_(name) {
    if (is_numbered(name, "obj|ply")) {
      check_numbers(name);
      return;
    }
    const fs::path input = name == "-" ? fs::path("/dev/stdin") : path_of(name);
    std::error_code ignored;  // if there is no such file
    if (fs::is_regular_file(input, ignored) && fs::equivalent(input, "/dev/stdout", ignored)) {
      refuse(name, "is also the standard output");
    }
    stream_ = open_file(name, "rb", stdin);
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

/// Writes frames (n_vertices, 3). A file has its name only once it is complete. A pipe gets each
/// frame at once.
class FrameWriter {
 public:
  FrameWriter(const std::string& name, const TemplateMesh& mesh) : name_(name) {
    if (!is_numbered(name, "ply")) {
      open(name);
      return;
    }
    folder_ = fs::absolute(path_of(name)).parent_path();
    if (is_taken(folder_) && fs::directory_iterator(folder_) != fs::directory_iterator()) {
      refuse(name, "its folder is not empty; write to a folder that is new or empty");
    }
    header_ =
        joined("ply\nformat binary_little_endian 1.0\nelement vertex ", mesh.points().count,
               "\nproperty float x\nproperty float y\nproperty float z\nelement face ",
               mesh.triangles().count, "\nproperty list uchar int vertex_indices\nend_header\n");
    for (std::size_t i = 0; i < mesh.faces.size(); i += 3) {
      faces_.append(1, 3).append(reinterpret_cast<const char*>(&mesh.faces[i]), 3 * sizeof(Index));
    }
  }

  void write(std::span<const float> frame) {
    if (!folder_.empty()) {
      fs::create_directories(folder_);
      open(file_of(name_, ++n_written_));
    }
    std::fwrite(header_.data(), 1, header_.size(), file_.get());
    std::fwrite(frame.data(), sizeof(float), frame.size(), file_.get());
    std::fwrite(faces_.data(), 1, faces_.size(), file_.get());
    if (std::ferror(file_.get()) != 0 || std::fflush(file_.get()) != 0) {
      refuse_by_system((name_ == "-" ? "standard output" : place_) + ": cannot be written");
    }
    if (!folder_.empty()) finish();
  }

  /// Gives the file its name. Without it, what was written is removed.
  void finish() {
    const std::string partial = std::exchange(file_.get_deleter().partial, {});
    file_.reset();
    if (partial.empty()) return;
    if (is_taken(path_of(place_))) refuse(place_, "exists already; the frames are in ", partial);
    fs::rename(path_of(partial), path_of(place_));
  }

 private:
  void open(const std::string& name) {
    place_ = name;
    const fs::path path = path_of(name);
    const bool is_stream = name == "-" || (fs::exists(path) && !fs::is_regular_file(path));
    const std::string partial = name + ".part";  // which another run may be writing
    for (const std::string& file : {name, partial}) {
      if (is_stream || !is_taken(path_of(file))) continue;
      refuse(file, "exists already; remove it or choose another name");
    }
    file_ = open_file(is_stream ? name : partial, "wb", stdout);
    if (!is_stream) file_.get_deleter().partial = partial;
  }

  std::string name_, place_;
  fs::path folder_;             // of numbered files
  std::string header_, faces_;  // which stand around the positions in each of them
  std::size_t n_written_ = 0;
  File file_;
};

}  // namespace dynmesh
