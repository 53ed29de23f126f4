/// Streams of frames in files and pipes: PC2, or raw little-endian float32.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

namespace dynmesh::app {

/// A call that makes no sense: exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file that does not hold or take what it should: exit code 1.
class DataError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class FrameFormat { pc2, raw };

/// By the suffix of `path`; "-" is raw. UsageError for a suffix of something else.
FrameFormat format_of(const std::string& path);

/// What a PC2 header says of time.
struct Timing {
  float start_frame = 0;
  float sample_rate = 1;
};

struct CloseFile {
  void operator()(std::FILE* file) const {
    if (file != stdin && file != stdout) (void)std::fclose(file);
  }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// Reads frames of `n_vertices` one after another. Everything throws DataError that names the file.
class FrameReader {
 public:
  /// "-" is standard input.
  FrameReader(const std::string& path, std::size_t n_vertices);

  /// Fills (n_vertices, 3) and returns true, or false at the end or when a signal came. A frame
  /// that is cut off throws, and so does what follows the last frame of a PC2 file.
  bool read(std::span<float> frame);

  [[nodiscard]] const Timing& timing() const { return timing_; }

 private:
  void read_header(std::size_t n_vertices);
  [[nodiscard]] std::size_t fill(std::span<float> frame);

  std::string path_;
  FrameFormat format_;
  File file_;
  Timing timing_;
  std::optional<std::uint32_t> n_frames_;  // as PC2 declares them
  std::uint64_t n_read_ = 0;
};

/// Writes frames one after another. Everything throws DataError that names the file.
class FrameWriter {
 public:
  /// "-" is standard output. A regular file is written under a temporary name until `finish`; an
  /// existing one throws unless `overwrite`.
  FrameWriter(const std::string& path, std::size_t n_vertices, Timing timing, bool overwrite);
  ~FrameWriter();
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;
  FrameWriter(FrameWriter&&) = delete;
  FrameWriter& operator=(FrameWriter&&) = delete;

  /// A reader at the other end of a pipe gets the frame at once.
  void write(std::span<const float> frame);

  /// Completes the header and gives the file its name.
  void finish();

  [[nodiscard]] std::size_t n_frames() const { return n_frames_; }

 private:
  void write_header();
  void write_bytes(const void* data, std::size_t size);

  std::string path_;
  FrameFormat format_;
  std::filesystem::path partial_;  // empty for what cannot be renamed
  File file_;
  std::uint32_t n_vertices_;
  Timing timing_;
  std::uint32_t n_frames_ = 0;
};

}  // namespace dynmesh::app
