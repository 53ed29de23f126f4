/// Threads that sleep until a number changes.
#pragma once

#include <atomic>
#include <cstdint>

namespace dynmesh {

/// Returns when `number` is not `old`, which it may be from the beginning. Sleeps meanwhile.
void wait_while(const std::atomic<std::uint32_t>& number, std::uint32_t old);

/// Wakes one or all of the threads that wait for a change of `number`. To be called after it.
void wake_one(std::atomic<std::uint32_t>& number);
void wake_all(std::atomic<std::uint32_t>& number);

}  // namespace dynmesh
