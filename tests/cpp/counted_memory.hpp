/// Counts all allocations of the process and can make one of them fail.
#pragma once

#include <cstddef>
#include <new>

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

/// Executes `call` once for each of its allocations, which fails, on a new result of `prepare`, and
/// then calls `check`, or `check_done` if the call has done without that memory. Returns the number
/// of calls that failed.
template <class Prepare, class Call, class Check, class CheckDone>
int fail_everywhere(const Prepare& prepare, const Call& call, const Check& check,
                    const CheckDone& check_done) {
  int failures = 0;
  for (std::size_t n = 0;; ++n) {
    auto subject = prepare();
    bool is_out_of_memory = false;
    bool was_reached = false;
    {
      const FailingAllocation failing(n);
      try {
        call(subject);
      } catch (const std::bad_alloc&) {
        is_out_of_memory = true;
      }
      was_reached = failing.has_failed();
    }
    if (!was_reached) return failures;
    // Algorithms such as std::stable_sort use memory only if it is available.
    if (!is_out_of_memory) {
      check_done(subject);
      continue;
    }
    ++failures;
    check(subject);
  }
}
template <class Prepare, class Call, class Check>
int fail_everywhere(const Prepare& prepare, const Call& call, const Check& check) {
  return fail_everywhere(prepare, call, check, [](auto&&) {});
}

}  // namespace dynmesh::testing
