/// Counts all allocations of the process and can make one of them fail.
#pragma once

#include <cstddef>

namespace dynmesh::testing {

/// The number of allocations so far, with operator new and, if the linker supports it, with malloc.
std::size_t allocations();

/// The number of allocations that have not been freed.
std::size_t live_allocations();

/// Makes the allocation after `n` others fail, and no other one, during its lifetime.
class FailingAllocation {
 public:
  explicit FailingAllocation(std::size_t n);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;

  /// Whether that allocation was reached.
  [[nodiscard]] bool has_failed() const;
};

}  // namespace dynmesh::testing
