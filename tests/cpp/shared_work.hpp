/// Small meshes whose work threads share all the same.
#pragma once

#include <cstdint>
#include <dynmesh/types.hpp>

#include "support/workers.hpp"

namespace dynmesh::testing {

/// Pieces of a few vertices, which no thread does alone if another can be had.
constexpr Sharing in_small_pieces(Index vertices = 16) {
  return {.chunk = vertices, .short_chunk = vertices, .fewest_pieces = 2, .patience = 100'000};
}

/// As long as it lives, completers are made that share their work in such pieces.
class SharedWork {
 public:
  explicit SharedWork(Index vertices = 16) { default_sharing() = in_small_pieces(vertices); }
  ~SharedWork() { default_sharing() = before_; }
  SharedWork(const SharedWork&) = delete;
  SharedWork& operator=(const SharedWork&) = delete;
  SharedWork(SharedWork&&) = delete;
  SharedWork& operator=(SharedWork&&) = delete;

 private:
  Sharing before_ = default_sharing();
};

/// How many pieces threads other than the caller do in what is called.
template <class Call>
std::uint64_t shared_pieces(const Call& call) {
  const std::uint64_t before = pieces_done_by_others();
  call();
  return pieces_done_by_others() - before;
}

}  // namespace dynmesh::testing
