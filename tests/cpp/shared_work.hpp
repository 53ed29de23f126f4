/// Makes threads share the work of small meshes.
#pragma once

#include <cstdint>
#include <dynmesh/types.hpp>

#include "base/workers.hpp"

namespace dynmesh::testing {

/// Pieces of a few vertices and small steps, with a caller that waits for other threads to take
/// some.
constexpr TaskSharing in_small_pieces(Index vertices = 16) {
  return {.chunk = vertices, .fewest_pieces = 2, .patience = 1'000'000};
}

/// Completers that are constructed during its lifetime share their work in such pieces.
class SharedWork {
 public:
  explicit SharedWork(Index vertices = 16) { default_task_sharing() = in_small_pieces(vertices); }
  ~SharedWork() { default_task_sharing() = before_; }
  SharedWork(const SharedWork&) = delete;
  SharedWork& operator=(const SharedWork&) = delete;
  SharedWork(SharedWork&&) = delete;
  SharedWork& operator=(SharedWork&&) = delete;

 private:
  TaskSharing before_ = default_task_sharing();
};

/// The number of pieces of `call` that threads other than the caller execute.
template <class Call>
std::uint64_t shared_pieces(const Call& call) {
  const std::uint64_t before = pieces_done_by_others();
  call();
  return pieces_done_by_others() - before;
}

}  // namespace dynmesh::testing
