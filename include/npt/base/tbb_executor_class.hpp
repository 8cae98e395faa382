/// The executor on oneTBB: an arena of its own with a given number of threads, or the host's arena. oneTBB itself is
/// in tbb_executor.hpp alone.
#pragma once

#include <npt/base/executor.hpp>
#include <npt/config.hpp>

#include <memory>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, TbbExecutor);
template <class>
class BasicTbbExecutor {
 public:
  /// An arena of its own. 0: as many threads as the process may use. A library sets no global limits: containers that
  /// see more processors than they may use give the number.
  explicit BasicTbbExecutor(int threads = 0);
  /// The host's tbb::task_arena, which must outlive the executor.
  template <class Arena>
  requires requires(Arena& arena) { arena.max_concurrency(); }
  explicit BasicTbbExecutor(Arena& arena) : arena_(&arena) { arena.initialize(); }

  int slots() const;

  template <class F>
  void for_each(int count, const F& f) const {
    run(
        count, [](const void* task, int i, int slot) { (*static_cast<const F*>(task))(i, slot); }, &f);
  }

 private:
  /// One function for all tasks: an index costs a call through a pointer, a task's type no code of oneTBB's.
  void run(int count, void (*call)(const void* task, int i, int slot), const void* task) const;

  std::shared_ptr<void> own_;
  void* arena_;  ///< tbb::task_arena
};
static_assert(Executor<TbbExecutor>);

#ifdef NPT_COMPILED
extern template class BasicTbbExecutor<>;
#endif

}  // namespace npt::inline NPT_ABI
