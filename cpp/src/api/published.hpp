/// A value that any thread may read at any time.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace dynmesh {

/// A value that one thread at a time replaces, and that others read meanwhile: they get the last
/// whole value, without waiting. There is no lock that a forked process could inherit.
template <class Value>
class Published {
  static_assert(std::is_trivially_copyable_v<Value>);

 public:
  void set(const Value& value) noexcept {
    Words words{};
    std::memcpy(words.data(), &value, sizeof value);
    const std::uint64_t number = number_.load(std::memory_order_relaxed) + 1;
    Slot& slot = slots_[number % 2];
    // With release, a reader that gets a word of this value does not see the number of the value
    // before the last one, which was in this slot.
    for (std::size_t i = 0; i < n_words; ++i) slot[i].store(words[i], std::memory_order_release);
    number_.store(number, std::memory_order_release);
  }

  [[nodiscard]] Value get() const noexcept {
    Words words;
    std::uint64_t number = 0;
    do {
      number = number_.load(std::memory_order_acquire);
      const Slot& slot = slots_[number % 2];
      for (std::size_t i = 0; i < n_words; ++i) words[i] = slot[i].load(std::memory_order_acquire);
    } while (number_.load(std::memory_order_relaxed) != number);
    Value value;
    std::memcpy(static_cast<void*>(&value), words.data(), sizeof value);
    return value;
  }

 private:
  static constexpr std::size_t n_words = (sizeof(Value) + 7) / 8;
  using Words = std::array<std::uint64_t, n_words>;
  using Slot = std::array<std::atomic<std::uint64_t>, n_words>;

  std::array<Slot, 2> slots_{};
  std::atomic<std::uint64_t> number_{0};  // of the last value, which is in one of the slots
};

}  // namespace dynmesh
