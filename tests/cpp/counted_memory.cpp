#include "counted_memory.hpp"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>

namespace {

std::atomic<std::size_t> n_allocated = 0;
std::atomic<std::size_t> n_freed = 0;

constexpr std::size_t never = std::numeric_limits<std::size_t>::max();
std::atomic<std::size_t> failing = never;  // the number of the allocation that fails

bool fails() {
  const bool fails_now = n_allocated++ == failing;
  if (fails_now) ++n_freed;
  return fails_now;
}

}  // namespace

// Eigen allocates memory with malloc, which a C++ program cannot replace as it can operator new. If
// the linker can redirect the calls of this program and of the static library in it to the
// functions below (see CMakeLists.txt), they are counted as well.
#ifdef DYNMESH_WRAPPED_MALLOC
extern "C" {
void* real_malloc(std::size_t size) asm("__real_malloc");
void* real_calloc(std::size_t count, std::size_t size) asm("__real_calloc");
void* real_realloc(void* memory, std::size_t size) asm("__real_realloc");
void* real_aligned_alloc(std::size_t alignment, std::size_t size) asm("__real_aligned_alloc");
void real_free(void* memory) asm("__real_free");
void* counted_malloc(std::size_t size) asm("__wrap_malloc");
void* counted_calloc(std::size_t count, std::size_t size) asm("__wrap_calloc");
void* counted_realloc(void* memory, std::size_t size) asm("__wrap_realloc");
void* counted_aligned_alloc(std::size_t alignment, std::size_t size) asm("__wrap_aligned_alloc");
void counted_free(void* memory) asm("__wrap_free");

void* counted_calloc(std::size_t count, std::size_t size) {
  return fails() ? nullptr : real_calloc(count, size);
}
void* counted_realloc(void* memory, std::size_t size) {
  if (fails()) return nullptr;
  if (memory != nullptr) ++n_freed;
  return real_realloc(memory, size);
}
}
#else
namespace {
void* real_malloc(std::size_t size) { return std::malloc(size); }
void* real_aligned_alloc(std::size_t alignment, std::size_t size) {
  return std::aligned_alloc(alignment, size);
}
void real_free(void* memory) { std::free(memory); }
}  // namespace
void* counted_malloc(std::size_t size);
void* counted_aligned_alloc(std::size_t alignment, std::size_t size);
void counted_free(void* memory);
#endif

void* counted_malloc(std::size_t size) { return fails() ? nullptr : real_malloc(size); }
void* counted_aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails() ? nullptr : real_aligned_alloc(alignment, size);
}
void counted_free(void* memory) {
  if (memory != nullptr) ++n_freed;
  real_free(memory);
}

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return counted_malloc(size == 0 ? 1 : size);
}
void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto align = static_cast<std::size_t>(alignment);
  const std::size_t whole = (size + align - 1) / align * align;
  if (void* memory = counted_aligned_alloc(align, whole)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { counted_free(memory); }
void operator delete(void* memory, std::size_t) noexcept { counted_free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { counted_free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { counted_free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { counted_free(memory); }

namespace dynmesh::testing {

std::size_t allocations() { return n_allocated; }

std::size_t live_allocations() { return n_allocated - n_freed; }

FailingAllocation::FailingAllocation(std::size_t n) { failing = n_allocated + n; }

FailingAllocation::~FailingAllocation() { failing = never; }

bool FailingAllocation::has_failed() const { return n_allocated > failing; }

}  // namespace dynmesh::testing
