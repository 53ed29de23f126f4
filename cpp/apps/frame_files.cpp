#include "frame_files.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "support/paths.hpp"
#include "system.hpp"

namespace dynmesh::app {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little,
              "frames are read in the byte order of memory");

constexpr std::array<char, 12> pc2_signature = {'P', 'O', 'I', 'N', 'T', 'C',
                                                'A', 'C', 'H', 'E', '2', '\0'};

struct Pc2Header {
  std::array<char, 12> signature = pc2_signature;
  std::int32_t version = 1;
  std::int32_t n_vertices = 0;
  float start_frame = 0;
  float sample_rate = 1;
  std::int32_t n_frames = 0;
};
static_assert(sizeof(Pc2Header) == 32);

std::string system_message() { return std::generic_category().message(errno); }

File open_file(const std::string& path, const char* mode) {
  std::error_code ignored;
  if (fs::is_directory(path_of(path), ignored)) throw DataError(path + ": is a folder");
  File file(open_binary(path, mode));
  if (!file) throw DataError(path + ": " + system_message());
  return file;
}

File standard_stream(std::FILE* stream) {
  make_binary(stream);
  return File(stream);
}

std::string frames(std::uint64_t count) {
  return std::to_string(count) + (count == 1 ? " whole frame" : " whole frames");
}

}  // namespace

FrameFormat format_of(const std::string& path) {
  if (path == "-") return FrameFormat::raw;
  const std::string suffix = lowercase_suffix(path);
  if (suffix == ".pc2") return FrameFormat::pc2;
  constexpr std::array raw = {"", ".raw", ".f32", ".float32", ".bin", ".dat"};
  if (std::ranges::find(raw, suffix) != raw.end()) return FrameFormat::raw;
  throw UsageError(
      path + ": the suffix must be .pc2, or .raw, .f32, .float32, .bin, .dat or none for raw " +
      "little-endian float32");
}

FrameReader::FrameReader(const std::string& path, std::size_t n_vertices)
    : path_(path == "-" ? "standard input" : path),
      format_(format_of(path)),
      file_(path == "-" ? standard_stream(stdin) : open_file(path, "rb")) {
  if (format_ == FrameFormat::pc2) read_header(n_vertices);
}

void FrameReader::read_header(std::size_t n_vertices) {
  Pc2Header header;
  if (std::fread(&header, sizeof header, 1, file_.get()) != 1 ||
      header.signature != pc2_signature || header.version != 1) {
    throw DataError(path_ + ": is not a PC2 file: it must begin with POINTCACHE2 and version 1");
  }
  if (header.n_vertices < 0 || static_cast<std::size_t>(header.n_vertices) != n_vertices) {
    throw DataError(path_ + ": has frames of " + std::to_string(header.n_vertices) +
                    " vertices, but the template has " + std::to_string(n_vertices));
  }
  if (header.n_frames < 0) {
    throw DataError(path_ + ": declares " + std::to_string(header.n_frames) + " frames");
  }
  timing_ = {header.start_frame, header.sample_rate};
  n_frames_ = static_cast<std::uint32_t>(header.n_frames);
}

/// Reads up to one frame and returns the number of bytes read.
std::size_t FrameReader::fill(std::span<float> frame) {
  bool interrupted = false;
  const std::size_t got = read_bytes(file_.get(), frame.data(), frame.size_bytes(), interrupted);
  if (std::ferror(file_.get()) != 0 && !interrupted) {
    throw DataError(path_ + ": " + system_message());
  }
  return got;
}

bool FrameReader::read(std::span<float> frame) {
  const bool at_declared_end = n_frames_ && n_read_ == *n_frames_;
  const std::size_t got = fill(at_declared_end ? frame.first(1) : frame);
  if (at_declared_end) {
    if (got == 0) return false;
    throw DataError(path_ + ": continues after the " + frames(n_read_) +
                    " that its header declares");
  }
  if (got == frame.size_bytes()) {
    if (n_read_ == 0 && format_ == FrameFormat::raw &&
        std::memcmp(frame.data(), pc2_signature.data(), std::min(got, pc2_signature.size())) == 0) {
      throw DataError(path_ +
                      ": begins like a PC2 file, but is read as raw frames; rename it to .pc2");
    }
    ++n_read_;
    return true;
  }
  const bool interrupted = std::ferror(file_.get()) != 0;
  if (interrupted || (got == 0 && !n_frames_)) return false;
  throw DataError(path_ + ": frame " + std::to_string(n_read_ + 1) +
                  (n_frames_ ? " of " + std::to_string(*n_frames_) : std::string()) +
                  " ends after " + std::to_string(got) + " of " +
                  std::to_string(frame.size_bytes()) + " bytes; " + frames(n_read_) +
                  " preceded it");
}

FrameWriter::FrameWriter(const std::string& path, std::size_t n_vertices, Timing timing,
                         bool overwrite)
    : path_(path == "-" ? "standard output" : path),
      format_(format_of(path)),
      n_vertices_(static_cast<std::uint32_t>(n_vertices)),
      timing_(timing) {
  if (path == "-") {
    file_ = standard_stream(stdout);
    return;
  }
  const bool exists = fs::exists(path_of(path));
  if (exists && !fs::is_regular_file(path_of(path))) {
    if (format_ == FrameFormat::pc2) {
      throw UsageError(path +
                       ": PC2 can only be written to a regular file, since its header contains the "
                       "number of frames");
    }
    file_ = open_file(path, "wb");
    return;
  }
  if (exists && !overwrite) throw DataError(path + ": exists already; --overwrite replaces it");
  partial_ = path + "." + std::to_string(process_number()) + ".part";
  file_.reset(open_binary(partial_, "wb"));
  if (!file_) throw DataError(path + ": " + system_message());
  if (format_ == FrameFormat::pc2) write_header();
}

FrameWriter::~FrameWriter() {
  if (partial_.empty()) return;
  file_.reset();
  std::error_code ignored;
  fs::remove(path_of(partial_), ignored);
}

void FrameWriter::write_header() {
  const Pc2Header header{.n_vertices = static_cast<std::int32_t>(n_vertices_),
                         .start_frame = timing_.start_frame,
                         .sample_rate = timing_.sample_rate,
                         .n_frames = static_cast<std::int32_t>(n_frames_)};
  write_bytes(&header, sizeof header);
}

void FrameWriter::write_bytes(const void* data, std::size_t size) {
  if (std::fwrite(data, 1, size, file_.get()) != size) {
    throw DataError(path_ + ": frame " + std::to_string(n_frames_ + 1) +
                    " cannot be written: " + system_message());
  }
}

void FrameWriter::write(std::span<const float> frame) {
  write_bytes(frame.data(), frame.size_bytes());
  if (partial_.empty() && std::fflush(file_.get()) != 0) {
    throw DataError(path_ + ": frame " + std::to_string(n_frames_ + 1) +
                    " cannot be written: " + system_message());
  }
  ++n_frames_;
}

void FrameWriter::finish() {
  if (format_ == FrameFormat::pc2) {
    std::rewind(file_.get());
    write_header();
  }
  if (std::fflush(file_.get()) != 0) {
    throw DataError(path_ + ": cannot be written: " + system_message());
  }
  if (partial_.empty()) return;
  file_.reset();
  // Windows replaces no file that another program has open.
  const std::string written = std::exchange(partial_, {});
  std::error_code error;
  fs::rename(path_of(written), path_of(path_), error);
  if (error) {
    throw DataError(path_ + ": cannot be replaced: " + error.message() + "; all frames are in " +
                    written);
  }
}

}  // namespace dynmesh::app
