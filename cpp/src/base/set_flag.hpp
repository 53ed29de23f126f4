/// A flag that is set for as long as a scope lasts.
#pragma once

#include <atomic>

namespace dynmesh {

/// Clears a flag that this thread has set, when the scope ends, also by an exception.
class SetFlag {
 public:
  explicit SetFlag(std::atomic_flag& flag) : flag_(flag) {}
  ~SetFlag() { flag_.clear(std::memory_order_release); }
  SetFlag(const SetFlag&) = delete;
  SetFlag& operator=(const SetFlag&) = delete;
  SetFlag(SetFlag&&) = delete;
  SetFlag& operator=(SetFlag&&) = delete;

 private:
  std::atomic_flag& flag_;
};

}  // namespace dynmesh
