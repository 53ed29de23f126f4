/// The checksum of a state of a completer, for tests that construct states.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace dynmesh::testing {

/// Sets the last eight bytes to the FNV-1a hash of the preceding ones.
inline void seal(std::span<std::byte> state) {
  std::uint64_t hash = 14695981039346656037ULL;
  const std::size_t n = state.size() - sizeof hash;
  for (const std::byte byte : state.first(n)) {
    hash = (hash ^ static_cast<std::uint64_t>(byte)) * 1099511628211ULL;
  }
  std::memcpy(&state[n], &hash, sizeof hash);
}

}  // namespace dynmesh::testing
