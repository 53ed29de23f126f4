/// Refuses concurrent calls on an object that only one thread at a time may use.
#pragma once

#include <atomic>
#include <mutex>
#include <stdexcept>
#include <string>

namespace dynmesh {

/// Thrown if another thread is using the object.
class InUse : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Executes one call at a time. While it runs, other calls are refused immediately instead of
/// waiting. The C interface and the Python package, which make a Completer available to arbitrary
/// threads, keep one beside it.
class OneAtATime {
 public:
  /// `object` is what the message calls the object.
  explicit OneAtATime(const char* object = "completer") : object_(object) {}

  /// Returns what `call` returns. If another call is running, throws InUse without executing
  /// `call`.
  template <class Call>
  decltype(auto) enter(const Call& call) {
    const std::unique_lock inside(inside_, std::try_to_lock);
    if (!inside) {
      throw InUse(std::string("this ") + object_ +
                  " is in use by another thread; give each thread its own, or take turns");
    }
    return call();
  }

 private:
  /// A mutex that also refuses the thread that holds it.
  struct Flag {
    std::atomic_flag is_set;
    bool try_lock() { return !is_set.test_and_set(std::memory_order_acquire); }
    void unlock() { is_set.clear(std::memory_order_release); }
  };

  const char* object_;
  Flag inside_;
};

}  // namespace dynmesh
