/// Reads and writes streams of frames in files and pipes: PC2 or raw little-endian float32.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

namespace dynmesh::app {

/// The command line is not valid: exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file cannot be read or written, or its content is not valid: exit code 1.
class DataError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class FrameFormat { pc2, raw };

/// Returns the format for the suffix of `path`; "-" is raw. Throws UsageError for an unknown
/// suffix.
FrameFormat format_of(const std::string& path);

/// The times in the header of a PC2 file.
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

/// Reads successive frames of `n_vertices`. All functions throw DataError with the path of the
/// file.
class FrameReader {
 public:
  /// "-" is standard input.
  FrameReader(const std::string& path, std::size_t n_vertices);

  /// Reads a frame (n_vertices, 3). Returns false at the end of the file and if a signal interrupts
  /// reading. Throws if a frame is truncated and if data follows the last frame of a PC2 file.
  bool read(std::span<float> frame);

  /// The path, or "standard input".
  [[nodiscard]] const std::string& name() const { return path_; }
  [[nodiscard]] const Timing& timing() const { return timing_; }

 private:
  void read_header(std::size_t n_vertices);
  [[nodiscard]] std::size_t fill(std::span<float> frame);

  std::string path_;
  FrameFormat format_;
  File file_;
  Timing timing_;
  std::optional<std::uint32_t> n_frames_;  // declared in a PC2 header
  std::uint64_t n_read_ = 0;
};

/// Writes successive frames. All functions throw DataError with the path of the file.
class FrameWriter {
 public:
  /// "-" is standard output. A regular file has a temporary name until `finish`. Throws if it
  /// already exists, unless `overwrite` is set.
  FrameWriter(const std::string& path, std::size_t n_vertices, Timing timing, bool overwrite);
  ~FrameWriter();
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;
  FrameWriter(FrameWriter&&) = delete;
  FrameWriter& operator=(FrameWriter&&) = delete;

  /// Writes a frame. A pipe is flushed, so that its reader receives the frame immediately.
  void write(std::span<const float> frame);

  /// Completes the header and renames the file to its final name. If it cannot be renamed, the
  /// temporary file is kept and named in the error.
  void finish();

  [[nodiscard]] std::size_t n_frames() const { return n_frames_; }

 private:
  void write_header();
  void write_bytes(const void* data, std::size_t size);

  std::string path_;
  FrameFormat format_;
  std::string partial_;  // empty unless the output is a regular file
  File file_;
  std::uint32_t n_vertices_;
  Timing timing_;
  std::uint32_t n_frames_ = 0;
};

}  // namespace dynmesh::app
