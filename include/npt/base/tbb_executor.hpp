/// The executor on oneTBB: an arena of its own with a given number of threads, or the host's arena.
#pragma once

#include <npt/base/executor.hpp>
#include <npt/config.hpp>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <memory>

namespace npt::inline NPT_ABI {

class TbbExecutor {
 public:
  /// An arena of its own. 0: as many threads as the process may use. A library sets no global limits: containers that
  /// see more processors than they may use give the number.
  explicit TbbExecutor(int threads = 0)
      : own_(std::make_shared<tbb::task_arena>(threads > 0 ? threads : int{tbb::task_arena::automatic})),
        arena_(own_.get()) {
    own_->initialize();
  }
  /// The host's arena, which must outlive the executor.
  explicit TbbExecutor(tbb::task_arena& arena) : arena_(&arena) { arena.initialize(); }

  int slots() const { return arena_->max_concurrency(); }

  template <class F>
  void for_each(int count, const F& f) const {
    if (slots() == 1 || count == 1) {
      // In the calling thread, but holding a slot of the arena only if it is already inside: nothing runs beside it.
      for (int i = 0; i < count; ++i) f(i, 0);
      return;
    }
    arena_->execute([&] {
      // Isolated: while it waits, a thread must not pick up the host's own tasks, which may call the engine again.
      tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(
            tbb::blocked_range<int>(0, count),
            [&f](const tbb::blocked_range<int>& range) {
              const int slot = tbb::this_task_arena::current_thread_index();
              for (int i = range.begin(); i < range.end(); ++i) f(i, slot);
            },
            tbb::simple_partitioner());
      });
    });
  }

 private:
  std::shared_ptr<tbb::task_arena> own_;
  tbb::task_arena* arena_;
};
static_assert(Executor<TbbExecutor>);

}  // namespace npt::inline NPT_ABI
