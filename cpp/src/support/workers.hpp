/// Threads that share the work of one frame.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <thread>
#include <vector>

namespace dynmesh {

/// How the work of a frame is cut into pieces, and when other threads are woken for them. From
/// which sizes on that is, docs/speed.md and the documentation of the setting `threads` say.
struct Sharing {
  /// Vertices that a thread takes at a time: their part of every array stays in the fastest cache.
  Index chunk = 1024;
  /// The same where each vertex takes long, so that meshes of ten thousand are shared, too.
  Index short_chunk = 256;
  /// The caller does fewer pieces than this by itself, before another thread would be awake.
  Index fewest_pieces = 24;
  /// For tests alone, in which every call is to be shared: the caller lets other threads run up to
  /// so many times until one of them has taken a piece, and every thread does so after each piece.
  Index patience = 0;
};

/// What Workers use that are not told otherwise. Only tests change it, so that the work of small
/// meshes is shared, too; they do so before they make the completers that are to use it.
Sharing& default_sharing();

/// How many pieces threads other than their caller have done so far, in the whole process. Tests
/// make sure by it that work was shared.
std::uint64_t pieces_done_by_others();

/// The caller and `threads - 1` others, which sleep between calls and never hold it up: who comes
/// first takes the next piece, and where nobody else comes, the caller does it all.
class Workers {
 public:
  /// Throws std::system_error if the system has not so many threads left.
  explicit Workers(Index threads, const Sharing& sharing = default_sharing());
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  Workers(Workers&&) = delete;
  Workers& operator=(Workers&&) = delete;

  [[nodiscard]] const Sharing& sharing() const { return sharing_; }

  /// Calls `work(i)` for i = 0 ... count - 1 in any order, from any of the threads, and returns
  /// when all are done; at most a million. `work` must not throw. Allocates nothing.
  template <class Work>
  void for_each(Index count, Work&& work) {
    if (threads_.empty() || count < sharing_.fewest_pieces) {
      for (Index i = 0; i < count; ++i) work(i);
      return;
    }
    run(
        count, [](void* context, Index i) { (*static_cast<Work*>(context))(i); }, &work);
  }

  /// The same for numbers from 0 to `count` - 1, cut into chunks: calls `work(first, last)`,
  /// `last` not included.
  template <class Work>
  void for_each_chunk(Index count, const Work& work) {
    cut(count, sharing_.chunk, work);
  }
  template <class Work>
  void for_each_short_chunk(Index count, const Work& work) {
    cut(count, sharing_.short_chunk, work);
  }

 private:
  template <class Work>
  void cut(Index count, Index length, const Work& work) {
    for_each((count + length - 1) / length,
             [&](Index i) { work(i * length, std::min(count, (i + 1) * length)); });
  }

  using Piece = void (*)(void* context, Index i);

  void run(Index count, Piece piece, void* context);
  void take_pieces(bool as_caller);
  void serve();
  void end();

  Sharing sharing_;
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
