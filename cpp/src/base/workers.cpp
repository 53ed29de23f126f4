#include "base/workers.hpp"

#include <chrono>
#include <string>
#include <system_error>
#include <utility>

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#endif

namespace dynmesh {

namespace {

#ifdef _WIN32
// On systems other than Linux, the library of GCC 12 (bits/atomic_wait.h) implements
// std::atomic::wait with a condition variable that is notified without its mutex. A notification
// between the comparison and the sleep is lost, and all threads wait for each other.
/// Returns when `number` is not `old`, which it may be from the beginning. Sleeps meanwhile.
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

constexpr unsigned counter_bits = 20;  // in each of the two counters of a ticket
constexpr std::uint64_t counter_mask = (std::uint64_t{1} << counter_bits) - 1;
// Each thread that finds nothing left counts on by one.
constexpr Index most_pieces = 1'000'000;

/// A thread that has nothing to do stays awake for this long. Waking it takes about 50 us, and the
/// parts of a frame that are not shared, which it has to wait for, take up to 1 ms.
constexpr std::chrono::milliseconds awake{1};

std::atomic<std::uint64_t> done_by_others{0};

/// Returns when the number is no longer `old`.
void await_change(const std::atomic<std::uint32_t>& number, std::uint32_t old) {
  const auto end = std::chrono::steady_clock::now() + awake;
  while (number.load(std::memory_order_acquire) == old) {
    if (std::chrono::steady_clock::now() > end) return wait_while(number, old);
    std::this_thread::yield();  // the thread that is waited for may be on the same processor
  }
}

}  // namespace

TaskSharing& default_task_sharing() {
  static TaskSharing task_sharing;
  return task_sharing;
}

TaskSharing task_sharing_of_tracking() {
  TaskSharing task_sharing = default_task_sharing();
  task_sharing.fewest_pieces = std::max(task_sharing.fewest_pieces / 12, Index{1});
  return task_sharing;
}

std::uint64_t pieces_done_by_others() { return done_by_others; }

Workers::Workers(Index threads, const TaskSharing& sharing) : sharing_(sharing) {
  try {
    for (Index i = 1; i < threads; ++i) threads_.emplace_back([this] { serve(); });
  } catch (const std::system_error& error) {
    const std::size_t started = threads_.size() + 1;
    end();
    throw std::system_error(error.code(), "threads: could start only " + std::to_string(started) +
                                              " of " + std::to_string(threads) + " threads");
  } catch (...) {
    end();
    throw;
  }
}

Workers::~Workers() { end(); }

void Workers::end() {
  ending_ = true;
  ++call_;
  wake_all(call_);
  for (std::thread& thread : threads_) thread.join();
}

void Workers::run(Index count, Piece piece, void* context) {
  for (Index first = 0; first < count;) {
    const Index some = std::min(count - first, most_pieces);
    run_some(first, some, piece, context);
    first += some;
  }
}

void Workers::run_some(Index first, Index count, Piece piece, void* context) {
  // These are read only by threads that hold a ticket of this call.
  piece_ = piece;
  context_ = context;
  first_ = first;
  done_.store(0, std::memory_order_relaxed);
  const auto pieces = static_cast<std::uint64_t>(count);
  ticket_.store((++calls_ << (2 * counter_bits)) | (pieces << counter_bits),
                std::memory_order_release);
  ++call_;
  wake_all(call_);
  for (Index i = 0; i < sharing_.patience && (ticket_.load() & counter_mask) == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(10));
  }
  take_pieces(true);
  // Other threads may still be executing their last piece.
  for (std::uint32_t done = done_.load(std::memory_order_acquire); done < pieces;
       done = done_.load(std::memory_order_acquire)) {
    await_change(done_, done);
  }
  if (has_failed_.exchange(false)) std::rethrow_exception(std::exchange(failure_, nullptr));
}

/// Executes a piece of the current call, unless one of them has failed.
void Workers::execute(Index i) noexcept {
  if (has_failed_.load(std::memory_order_relaxed)) return;
  try {
    piece_(context_, first_ + i);
  } catch (...) {
    if (!has_failed_.exchange(true)) failure_ = std::current_exception();
  }
}

void Workers::take_pieces(bool as_caller) {
  while (true) {
    const std::uint64_t ticket = ticket_.fetch_add(1, std::memory_order_acq_rel);
    const std::uint64_t pieces = (ticket >> counter_bits) & counter_mask;
    const std::uint64_t i = ticket & counter_mask;
    if (i >= pieces) return;
    execute(static_cast<Index>(i));
    if (!as_caller) done_by_others.fetch_add(1, std::memory_order_relaxed);
    if (done_.fetch_add(1, std::memory_order_acq_rel) + 1 == pieces) wake_one(done_);
  }
}

void Workers::serve() {
  std::uint32_t seen = 0;
  while (true) {
    await_change(call_, seen);
    seen = call_.load(std::memory_order_acquire);
    if (ending_) return;
    take_pieces(false);
  }
}

}  // namespace dynmesh
