#include "support/workers.hpp"

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#endif

namespace dynmesh {

#ifdef _WIN32

// On systems other than Linux, the library of GCC 12 (bits/atomic_wait.h) implements
// std::atomic::wait with a condition variable that is notified without its mutex. A notification
// between the comparison and the sleep is lost, and all threads wait for each other.
void wait_while(const std::atomic<std::uint32_t>& number, std::uint32_t old) {
  static_assert(sizeof number == sizeof old && std::atomic<std::uint32_t>::is_always_lock_free);
  void* address = const_cast<std::atomic<std::uint32_t>*>(&number);
  // WaitOnAddress also returns without a change.
  while (number.load(std::memory_order_acquire) == old) {
    WaitOnAddress(address, &old, sizeof old, INFINITE);
  }
}

void wake_one(std::atomic<std::uint32_t>& number) { WakeByAddressSingle(&number); }

void wake_all(std::atomic<std::uint32_t>& number) { WakeByAddressAll(&number); }

#else

void wait_while(const std::atomic<std::uint32_t>& number, std::uint32_t old) {
  number.wait(old, std::memory_order_acquire);
}

void wake_one(std::atomic<std::uint32_t>& number) { number.notify_one(); }

void wake_all(std::atomic<std::uint32_t>& number) { number.notify_all(); }

#endif

}  // namespace dynmesh
