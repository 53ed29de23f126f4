/// Counts every allocation of the process, and makes one of them fail where a test says so.
#pragma once

#include <cstddef>

namespace dynmesh::testing {

/// How many allocations there have been, by operator new and, where the linker can tell, by malloc.
std::size_t allocations();

/// How many of them have not been freed.
std::size_t live_allocations();

/// While it lives, the allocation after `n` others fails, and no other one does.
class FailingAllocation {
 public:
  explicit FailingAllocation(std::size_t n);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;

  /// Whether there were so many allocations.
  [[nodiscard]] bool has_failed() const;
};

}  // namespace dynmesh::testing
