/// The executor on oneTBB, whole.
#pragma once

#include <npt/base/tbb_executor_class.hpp>
#include <npt/config.hpp>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <memory>

namespace npt::inline NPT_ABI {

template <class X>
BasicTbbExecutor<X>::BasicTbbExecutor(int threads) {
  const auto arena = std::make_shared<tbb::task_arena>(threads > 0 ? threads : int{tbb::task_arena::automatic});
  arena->initialize();
  own_ = arena;
  arena_ = arena.get();
}

template <class X>
int BasicTbbExecutor<X>::slots() const {
  return static_cast<tbb::task_arena*>(arena_)->max_concurrency();
}

template <class X>
void BasicTbbExecutor<X>::run(int count, void (*call)(const void* task, int i, int slot), const void* task) const {
  if (slots() == 1 || count == 1) {
    // In the calling thread, but holding a slot of the arena only if it is already inside: nothing runs beside it.
    for (int i = 0; i < count; ++i) call(task, i, 0);
    return;
  }
  static_cast<tbb::task_arena*>(arena_)->execute([&] {
    // Isolated: while it waits, a thread must not pick up the host's own tasks, which may call the engine again.
    tbb::this_task_arena::isolate([&] {
      tbb::parallel_for(
          tbb::blocked_range<int>(0, count),
          [&](const tbb::blocked_range<int>& range) {
            const int slot = tbb::this_task_arena::current_thread_index();
            for (int i = range.begin(); i < range.end(); ++i) call(task, i, slot);
          },
          tbb::simple_partitioner());
    });
  });
}

}  // namespace npt::inline NPT_ABI
