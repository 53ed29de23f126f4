/// Threads that share the work of one frame.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <thread>
#include <vector>

namespace dynmesh {

/// Vertices that a thread takes at a time: their part of every array stays in the fastest cache.
constexpr Index stretch = 1024;
/// The same where each takes long, so that meshes of ten thousand are shared, too.
constexpr Index short_stretch = 256;

/// The caller and `threads - 1` others, which sleep between calls and never hold it up: who comes
/// first takes the next piece, and where nobody else comes, the caller does it all.
class Workers {
 public:
  /// Throws std::system_error if the system has not so many threads left.
  explicit Workers(Index threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  Workers(Workers&&) = delete;
  Workers& operator=(Workers&&) = delete;

  /// Calls `work(i)` for i = 0 ... count - 1 in any order, from any of the threads, and returns
  /// when all are done; at most a million. `work` must not throw. Allocates nothing.
  template <class Work>
  void for_each(Index count, Work&& work) {
    if (threads_.empty() || count < fewest_shared) {
      for (Index i = 0; i < count; ++i) work(i);
      return;
    }
    run(
        count, [](void* context, Index i) { (*static_cast<Work*>(context))(i); }, &work);
  }

  /// The same for numbers from 0 to `count` - 1, cut into stretches of `length`: calls
  /// `work(first, last)`, `last` not included.
  template <class Work>
  void for_each_stretch(Index count, Index length, const Work& work) {
    for_each((count + length - 1) / length,
             [&](Index i) { work(i * length, std::min(count, (i + 1) * length)); });
  }

 private:
  /// Fewer are done alone before others are awake.
  static constexpr Index fewest_shared = 24;

  using Piece = void (*)(void* context, Index i);

  void run(Index count, Piece piece, void* context);
  void take_pieces();
  void serve();
  void end();

  Piece piece_ = nullptr;
  void* context_ = nullptr;
  std::uint64_t calls_ = 0;
  // Of the present call: its number, how many pieces it has, and the next one. All in one, so that
  // a thread that comes late cannot take a piece of another call.
  std::atomic<std::uint64_t> ticket_{0};
  std::atomic<std::uint32_t> done_{0};
  std::atomic<std::uint32_t> call_{0};  // what the others wait for
  std::atomic<bool> ending_{false};
  std::vector<std::thread> threads_;
};

}  // namespace dynmesh
