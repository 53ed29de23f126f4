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
  void write(const std::vector<Vector3<double>>& frame) {
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
  void read(std::vector<Vector3<double>>& frame) {
    for (auto& v : frame) read(std::span<double>(&v.x, 3));
  }

 private:
  std::size_t size_;
  std::span<const std::byte> rest_;
};

/// What a state keeps of an object: `T::fields(object, visit)` calls `visit` with each number, or
/// with several side by side.
template <class Visited>
auto numbers_of(Visited& visited) {
  if constexpr (std::is_arithmetic_v<Visited>) {
    return std::span(&visited, 1);
  } else {
    return std::span(visited.data(), visited.size());
  }
}
template <class T>
void write_fields(Writer& writer, const T& object) {
  T::fields(object, [&](const auto& visited) {
    const auto numbers = numbers_of(visited);
    writer.write(std::span<const typename decltype(numbers)::value_type>(numbers));
  });
}
template <class T>
void read_fields(Reader& reader, T& object) {
  T::fields(object, [&](auto&& visited) { reader.read_finite(numbers_of(visited)); });
}

}  // namespace dynmesh
