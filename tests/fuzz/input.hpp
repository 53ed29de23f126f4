/// Code that the harnesses share: conversion of bytes to numbers, and checks.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace dynmesh::fuzz {

/// Ends the process if `holds` is false, so that the fuzzer keeps the input.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

/// Reads numbers from a string of bytes; zeros after its end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }

  template <class T>
  T take() {
    std::array<std::uint8_t, sizeof(T)> bytes{};
    const std::size_t n = std::min(rest_.size(), bytes.size());
    std::copy_n(rest_.begin(), n, bytes.begin());
    rest_ = rest_.subspan(n);
    return std::bit_cast<T>(bytes);
  }
  /// From 0 to `end` - 1, at most 2^16.
  std::size_t below(std::size_t end) {
    return (end <= 256 ? take<std::uint8_t>() : take<std::uint16_t>()) % end;
  }
  bool flip() { return (take<std::uint8_t>() & 1) != 0; }
  std::span<const std::uint8_t> take_rest() { return std::exchange(rest_, {}); }

 private:
  std::span<const std::uint8_t> rest_;
};

/// Coordinates: small ones with few bits, or arbitrary values of Real.
template <class Real>
Real coordinate(Input& input, bool tame) {
  if (tame) return static_cast<Real>(input.take<std::int8_t>()) / 8;
  static constexpr std::array<double, 12> edges = {0,    -0.0,    1,    1e-30, 1e-300, 1e15,
                                                   1e18, -1.1e18, 1e38, 1e200, -2e200, 1e308};
  const std::size_t choice = input.below(32);
  if (choice < edges.size()) {
    const double edge = edges[choice];
    const bool fits = std::abs(edge) <= static_cast<double>(std::numeric_limits<Real>::max());
    return static_cast<Real>(fits ? edge : 1e38);
  }
  if (choice == 12) return std::numeric_limits<Real>::quiet_NaN();
  if (choice == 13) return -std::numeric_limits<Real>::infinity();
  if (choice < 20) return input.take<Real>();
  return static_cast<Real>(input.take<std::int16_t>()) / 64;
}

/// A temporary folder for readers that need a file; in memory if the system supports it.
inline const std::filesystem::path& scratch() {
  struct Folder {
    std::filesystem::path path = "/dev/shm";
    Folder() {
      if (!std::filesystem::is_directory(path)) path = std::filesystem::temp_directory_path();
      path /= "dynmesh-fuzz-" + std::to_string(getpid());
      std::filesystem::create_directories(path);
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
  };
  static const Folder folder;
  return folder.path;
}

inline std::string write_scratch(const std::string& name, std::span<const std::uint8_t> bytes) {
  const std::string path = (scratch() / name).string();
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  file.close();
  require(file.good(), "the scratch file is written");
  return path;
}

inline std::vector<std::uint8_t> read_scratch(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  require(file.good(), "the file opens");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace dynmesh::fuzz
