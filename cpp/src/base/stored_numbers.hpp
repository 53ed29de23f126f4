/// Converts numbers to and from the bytes of a state, little-endian and packed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <dynmesh/types.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/geometry.hpp"

namespace dynmesh {

[[noreturn]] inline void refuse_state(const std::string& why) {
  throw std::invalid_argument("state: " + why);
}

/// A hash like FNV-1a, but of eight bytes at a time, the last ones filled up with zeros.
inline std::uint64_t hash_of(std::span<const std::byte> bytes) {
  std::uint64_t hash = 14695981039346656037ULL ^ bytes.size();
  for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), sizeof hash))) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), std::min(bytes.size(), sizeof word));
    hash = (hash ^ word) * 1099511628211ULL;
    hash ^= hash >> 32U;  // the product carries upwards only
  }
  return hash;
}

/// Refuses positions that are not finite, or too large.
inline void check_stored_frame(Field frame, double largest) {
  const auto wrong =
      std::ranges::find_if_not(frame, [&](const auto& v) { return is_in_range(v, largest); });
  if (wrong == frame.end()) return;
  refuse_state("holds a position of vertex " + std::to_string(wrong - frame.begin()) +
               " that is not finite, or too large");
}

/// Calls `visit` with spans of the numbers that `visited` consists of: one, or an array of numbers,
/// of Vector3 or of Quaternion.
template <class Visited, class Visit>
void each_span(Visited& visited, const Visit& visit) {
  if constexpr (std::is_arithmetic_v<Visited>) {
    visit(std::span(&visited, 1));
  } else if constexpr (requires { visited.w; }) {
    visit(std::span(&visited.w, 4));
  } else if constexpr (requires { visited.x; }) {
    visit(std::span(&visited.x, 3));
  } else if constexpr (std::is_arithmetic_v<typename Visited::value_type>) {
    visit(std::span(visited.data(), visited.size()));
  } else {
    for (auto& part : visited) each_span(part, visit);
  }
}

/// Writes numbers one after another.
class Writer {
 public:
  /// Expects as many bytes.
  explicit Writer(std::size_t size = 0) { bytes_.reserve(size); }

  template <class Visited>
  void write(const Visited& visited) {
    each_span(visited, [&](auto numbers) {
      const auto bytes = std::as_bytes(numbers);
      bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    });
  }
  /// Appends a hash of everything written, and returns the bytes.
  std::vector<std::byte> take_sealed() {
    write(hash_of(bytes_));
    return std::move(bytes_);
  }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads numbers from bytes. Refuses to read past their end.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : size_(bytes.size()), rest_(bytes) {}

  template <class T>
  T read() {
    T value{};
    read(value);
    return value;
  }
  /// Refuses numbers that are not finite, unless they may be.
  template <class Visited>
  void read(Visited& visited, bool is_finite = true) {
    if constexpr (std::is_same_v<Visited, bool>) {
      visited = read<std::uint8_t>() != 0;
    } else {
      each_span(visited, [&](auto numbers) { read_span(numbers, is_finite); });
    }
  }

 private:
  template <class T>
  void read_span(std::span<T> numbers, bool is_finite) {
    if (numbers.empty()) return;
    if (rest_.size() < numbers.size_bytes()) {
      refuse_state("truncated: its " + std::to_string(size_) + " bytes are too few");
    }
    std::memcpy(numbers.data(), rest_.data(), numbers.size_bytes());
    rest_ = rest_.subspan(numbers.size_bytes());
    if constexpr (std::is_floating_point_v<T>) {
      if (is_finite && !std::ranges::all_of(numbers, [](T x) { return std::isfinite(x); })) {
        refuse_state("holds a number that is not finite");
      }
    }
  }

  std::size_t size_;
  std::span<const std::byte> rest_;
};

}  // namespace dynmesh
