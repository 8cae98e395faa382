/// The executor on the host application's own parallel loop, so that npt brings no threads of its own.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <atomic>
#include <string>
#include <utility>

namespace npt::inline NPT_ABI {

namespace parallel::internal {

/// What the host's loop gets to call: copyable and one pointer large, so that a std::function made of it allocates
/// nothing. Call number `slot` takes indices until none is left.
template <class F>
class HostTask {
 public:
  struct Shared {
    const F& f;
    int count;
    std::atomic<int> next{0};
  };
  explicit HostTask(Shared& shared) : shared_(&shared) {}

  void operator()(int slot) const {
    for (int i; (i = shared_->next.fetch_add(1, std::memory_order_relaxed)) < shared_->count;) shared_->f(i, slot);
  }

 private:
  Shared* shared_;
};

}  // namespace parallel::internal

/// `parallel_for(n, task)` calls task(0), ..., task(n - 1), each once, in whatever threads and order it likes (one
/// after another will do), and returns when all are done. n is never more than `slots`. `task` may be taken by a
/// template parameter or as std::function<void(int)>.
///
/// Thread safety  `parallel_for` is called from every thread that calls the engine, so it must be callable as const by
///                several at a time if they are several.
/// Errors         npt::Error for fewer than one slot. What a task throws (std::bad_alloc) goes to the host's loop; one
///                that passes exceptions on passes it to whoever called the engine.
template <class ParallelFor>
class HostExecutor {
 public:
  HostExecutor(int slots, ParallelFor parallel_for) : slots_(slots), parallel_for_(std::move(parallel_for)) {
    if (slots < 1)
      throw Error(
          {.file = "slots", .found = std::to_string(slots), .expected = "at least 1: threads of the host's loop"});
  }

  int slots() const { return slots_; }

  template <class F>
  void for_each(int count, const F& f) const {
    const int tasks = std::min(slots_, count);
    if (tasks <= 1) {
      for (int i = 0; i < count; ++i) f(i, 0);
      return;
    }
    using Task = parallel::internal::HostTask<F>;
    typename Task::Shared shared{f, count};
    parallel_for_(tasks, Task(shared));
  }

 private:
  int slots_;
  ParallelFor parallel_for_;
};

}  // namespace npt::inline NPT_ABI
