/// Distributes the work of one frame among threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <exception>
#include <thread>
#include <type_traits>
#include <vector>

namespace dynmesh {

/// How the work of a frame is divided into pieces, and from which number of pieces on other threads
/// are woken. docs/speed.md and the documentation of the setting `threads` state the resulting
/// mesh sizes.
struct TaskSharing {
  /// The number of vertices in a chunk, whose part of every array fits into the first-level cache.
  /// Short chunks, for more work per vertex, have a quarter of it.
  Index chunk = 1024;
  /// If there are fewer pieces, of chunks that are not short, the calling thread executes them all,
  /// since it would be done about as soon as another thread has woken up.
  Index fewest_pieces = 24;
  /// For tests, in which every call must be shared: the calling thread sleeps up to this many times
  /// for ten microseconds until another thread has taken a piece.
  Index patience = 0;
  /// For tests: a thread that is alone executes the pieces from the last to the first, which must
  /// not change any result.
  bool backwards = false;
};

/// The default of Workers. Only tests change it, before they construct completers, so that the work
/// of small meshes is shared as well.
TaskSharing& default_task_sharing();

/// That of trackers and registrations, whose frames take ten times as long as those of a completer,
/// in longer parts: it shares from a twelfth of the pieces on.
TaskSharing task_sharing_of_tracking();

/// The number of pieces in this process that were executed by threads other than the caller's.
/// Tests use it to verify that work was shared.
std::uint64_t pieces_done_by_others();

/// The calling thread and `threads - 1` others, which sleep between calls, though not at once: the
/// next call usually follows soon. Each thread takes the next piece when it is free. The calling
/// thread does not wait for others to start; it executes all pieces if no other thread is
/// available.
class Workers {
 public:
  /// Throws std::system_error if the system cannot start as many threads.
  explicit Workers(Index threads, const TaskSharing& task_sharing = default_task_sharing());
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  Workers(Workers&&) = delete;
  Workers& operator=(Workers&&) = delete;

  [[nodiscard]] const TaskSharing& task_sharing() const { return sharing_; }

  /// The number of threads, the calling one included.
  [[nodiscard]] Index threads() const { return static_cast<Index>(threads_.size()) + 1; }

  /// Whether other threads take part in work on so many vertices, or on what takes as long.
  [[nodiscard]] bool are_worth_it(Index vertices) const {
    return (vertices + sharing_.chunk - 1) / sharing_.chunk >= sharing_.fewest_pieces;
  }

  /// Calls `work(i)` for i = 0 ... count - 1 in any order, on any of the threads, and returns when
  /// all calls are done. If calls throw, one of their exceptions is thrown when no thread uses
  /// `work` any more, and others may not have been made. Allocates no memory.
  template <class Work>
  void for_each(Index count, Work&& work) {
    share(count, count >= sharing_.fewest_pieces, work);
  }

  /// Calls `work(i)` as `for_each` does; the caller decides whether other threads take part.
  template <class Work>
  void share(Index count, bool is_worth_it, Work&& work) {
    if (threads_.empty() || count < 2 || !is_worth_it) {
      for (Index i = 0; i < count; ++i) work(sharing_.backwards ? count - 1 - i : i);
      return;
    }
    run(
        count,
        [](void* context, Index i) { (*static_cast<std::remove_reference_t<Work>*>(context))(i); },
        &work);
  }

  /// Divides the numbers from 0 to `count` - 1 into chunks and calls `work(first, last)` for each
  /// of them, `last` not included.
  template <class Work>
  void for_each_chunk(Index count, const Work& work) {
    for_each((count + sharing_.chunk - 1) / sharing_.chunk,
             [&](Index i) { work(i * sharing_.chunk, std::min(count, (i + 1) * sharing_.chunk)); });
  }
  /// Divides the numbers as `for_each_chunk` does, into short chunks, of which a thread may take
  /// several at a time. Chunks begin at multiples of four, since kernels take four numbers at once,
  /// which may affect each other's rounding. `weight` is the work of a number, in that of a vertex.
  template <class Work>
  void for_each_short_chunk(Index count, const Work& work, Index weight = 1) {
    const Index length = (std::max(sharing_.chunk / 4 / weight, Index{1}) + 3) / 4 * 4;
    const Index chunks = (count + length - 1) / length;
    const Index together = length * std::max(chunks / (pieces_of_thread * threads()), Index{1});
    share((count + together - 1) / together, are_worth_it(count * weight),
          [&](Index i) { work(i * together, std::min(count, (i + 1) * together)); });
  }
  /// Calls `work(i)` for i = 0 ... count - 1, in short chunks.
  template <class Work>
  void for_each_in_chunks(std::size_t count, const Work& work, Index weight = 1) {
    const auto of_chunk = [&](Index first, Index last) {
      for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(last); ++i)
        work(i);
    };
    for_each_short_chunk(static_cast<Index>(count), of_chunk, weight);
  }

 private:
  static constexpr Index pieces_of_thread = 8;  // so that none waits long for the last one

  using Piece = void (*)(void* context, Index i);

  void run(Index count, Piece piece, void* context);
  void run_some(Index first, Index count, Piece piece, void* context);
  void take_pieces(bool as_caller);
  void execute(Index i) noexcept;
  void serve();
  void end();

  TaskSharing sharing_;
  Piece piece_ = nullptr;
  void* context_ = nullptr;
  Index first_ = 0;
  std::uint64_t calls_ = 0;
  // Of the current call: its number, its number of pieces, and the next piece. They are stored in
  // one variable, so that a thread that is late cannot take a piece of another call.
  std::atomic<std::uint64_t> ticket_{0};
  std::atomic<std::uint32_t> done_{0};
  std::atomic<bool> has_failed_{false};
  std::exception_ptr failure_;  // the first one; written by the thread that sets `has_failed_`
  std::atomic<std::uint32_t> call_{0};  // the variable on which the other threads wait
  std::atomic<bool> ending_{false};
  std::vector<std::thread> threads_;
};

}  // namespace dynmesh
