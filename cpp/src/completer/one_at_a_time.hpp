/// For what one thread at a time may use.
#pragma once

#include <atomic>
#include <memory>
#include <stdexcept>

namespace dynmesh {

/// Another thread is inside.
class InUse : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lets one call in and refuses all others until it returns; nobody waits. What hands a Completer
/// to threads that it knows nothing of, as the C interface and the Python package do, keeps one
/// beside it.
class OneAtATime {
 public:
  /// What `call` returns. Throws InUse, and does not call, while another call is inside.
  template <class Call>
  decltype(auto) enter(const Call& call) {
    if (inside_.test_and_set(std::memory_order_acquire)) {
      throw InUse(
          "this completer is in use by another thread; give each thread its own, or take turns");
    }
    const std::unique_ptr<std::atomic_flag, Clear> leaving(&inside_);
    return call();
  }

 private:
  struct Clear {
    void operator()(std::atomic_flag* flag) const { flag->clear(std::memory_order_release); }
  };

  std::atomic_flag inside_;
};

}  // namespace dynmesh
