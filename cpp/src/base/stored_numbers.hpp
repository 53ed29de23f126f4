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

/// Writes numbers one after another.
class Writer {
 public:
  /// Expects as many bytes.
  explicit Writer(std::size_t size = 0) { bytes_.reserve(size); }

  template <class T>
  void write(T value) {
    write(std::span<const T>(&value, 1));
  }
  template <class T>
  void write(std::span<const T> numbers) {
    static_assert(std::is_arithmetic_v<T>);
    const auto bytes = std::as_bytes(numbers);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void write(const std::vector<Vector3>& frame) {
    for (const auto& v : frame) write(std::span<const double>(&v.x, 3));
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
    read(std::span<T>(&value, 1));
    return value;
  }
  template <class T>
  void read(std::span<T> numbers) {
    static_assert(std::is_arithmetic_v<T>);
    if (numbers.empty()) return;
    if (rest_.size() < numbers.size_bytes()) {
      refuse_state("truncated: its " + std::to_string(size_) + " bytes are too few");
    }
    std::memcpy(numbers.data(), rest_.data(), numbers.size_bytes());
    rest_ = rest_.subspan(numbers.size_bytes());
  }
  /// Refuses numbers that are not finite.
  template <class T>
  void read_finite(std::span<T> numbers) {
    read(numbers);
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::ranges::all_of(numbers, [](T x) { return std::isfinite(x); })) {
        refuse_state("holds a number that is not finite");
      }
    }
  }
  void read(std::vector<Vector3>& frame) {
    for (auto& v : frame) read(std::span<double>(&v.x, 3));
  }

 private:
  std::size_t size_;
  std::span<const std::byte> rest_;
};

/// Calls `visit` with spans of the numbers that `visited` consists of: one, or a vector of numbers,
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

/// Writes and reads what `each_number` visits.
class NumberWriter {
 public:
  explicit NumberWriter(Writer& writer) : writer_(writer) {}
  template <class Visited>
  void operator()(const Visited& visited, bool /*is_finite*/ = true) const {
    each_span(visited, [&](auto numbers) {
      writer_.write(
          std::span<const std::remove_const_t<typename decltype(numbers)::value_type>>(numbers));
    });
  }

 private:
  Writer& writer_;
};
class NumberReader {
 public:
  explicit NumberReader(Reader& reader) : reader_(reader) {}
  template <class Visited>
  void operator()(Visited& visited, bool is_finite = true) const {
    if constexpr (std::is_same_v<Visited, bool>) {
      visited = reader_.template read<std::uint8_t>() != 0;
    } else {
      each_span(visited, [&](auto numbers) {
        is_finite ? reader_.read_finite(numbers) : reader_.read(numbers);
      });
    }
  }

 private:
  Reader& reader_;
};

}  // namespace dynmesh
