/// Memory for the arrays of large meshes.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace dynmesh {

/// Requests huge pages for large arrays, which reduces the number of address translations when
/// neighbours are far apart in memory.
template <class T>
class LargeAllocator {
 public:
  using value_type = T;

  LargeAllocator() = default;
  template <class Other>
  LargeAllocator(const LargeAllocator<Other>&) {}  // NOLINT(google-explicit-constructor)

  T* allocate(std::size_t n) {
    const std::size_t size = n * sizeof(T);
    const std::align_val_t alignment = alignment_of(size);
    void* memory = ::operator new(size, alignment);
#ifdef __linux__
    // The system may ignore this advice; pages are then small.
    if (size >= page) ::madvise(memory, size, MADV_HUGEPAGE);
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t n) {
    ::operator delete(memory, alignment_of(n * sizeof(T)));
  }
  friend bool operator==(const LargeAllocator&, const LargeAllocator&) { return true; }

 private:
  static constexpr std::size_t page = std::size_t{1} << 21U;
  static std::align_val_t alignment_of(std::size_t size) {
    return std::align_val_t{size >= page ? page : std::size_t{64}};
  }
};

template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace dynmesh
