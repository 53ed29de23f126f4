/// The checksum of a state of a completer, for tests that construct states.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "base/stored_numbers.hpp"

namespace dynmesh::testing {

/// Sets the last eight bytes to the checksum of the preceding ones.
inline void seal(std::span<std::byte> state) {
  const std::uint64_t hash = hash_of(state.first(state.size() - sizeof(std::uint64_t)));
  std::memcpy(&state[state.size() - sizeof hash], &hash, sizeof hash);
}

}  // namespace dynmesh::testing
