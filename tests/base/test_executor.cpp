#include <doctest/doctest.h>

#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/host_executor.hpp>
#if NPT_HAS_TBB
#include <npt/base/tbb_executor.hpp>
#include <npt/base/tbb_executor_class.hpp>
#endif
#include <npt/base/thread_executor.hpp>

#include <atomic>
#include <functional>
#include <stdexcept>
#include <thread>
#include <type_traits>
#include <vector>

namespace {
template <class E>
void check_executor(const E& executor) {
  for (const int count : {0, 1, 2, 100}) {
    std::vector<std::atomic<int>> calls(100), busy(static_cast<std::size_t>(executor.slots()));
    std::atomic<bool> overlap{false}, range{true};
    executor.for_each(count, [&](int i, int slot) {
      if (slot < 0 || slot >= executor.slots()) {
        range = false;
        return;
      }
      if (busy[static_cast<std::size_t>(slot)].fetch_add(1) != 0) overlap = true;
      ++calls[static_cast<std::size_t>(i)];
      --busy[static_cast<std::size_t>(slot)];
    });
    CHECK(range);
    CHECK_FALSE(overlap);
    for (int i = 0; i < 100; ++i) CHECK(calls[static_cast<std::size_t>(i)] == (i < count ? 1 : 0));
  }
}

/// A host's loop with a thread for each task.
constexpr auto thread_each = [](int count, auto task) {
  std::vector<std::thread> threads;
  for (int i = 0; i < count; ++i) threads.emplace_back([task, i] { task(i); });
  for (std::thread& thread : threads) thread.join();
};
}  // namespace

TEST_CASE("executors call every index once, and never two at a time in one slot") {
  check_executor(npt::SerialExecutor{});
#if NPT_HAS_TBB
  check_executor(npt::TbbExecutor(1));
  check_executor(npt::TbbExecutor(2));
  check_executor(npt::TbbExecutor(5));
  check_executor(npt::TbbExecutor());
  tbb::task_arena arena(3);
  check_executor(npt::TbbExecutor(arena));
#endif
  check_executor(npt::ThreadExecutor(1));
  check_executor(npt::ThreadExecutor(2));
  check_executor(npt::ThreadExecutor(5));
  check_executor(npt::ThreadExecutor());
  check_executor(npt::HostExecutor(1, thread_each));
  check_executor(npt::HostExecutor(3, thread_each));
}

TEST_CASE("a host's loop may run one task after another, backwards, or take std::function") {
  check_executor(npt::HostExecutor(4, [](int count, auto task) {
    for (int i = count - 1; i >= 0; --i) task(i);
  }));
  check_executor(
      npt::HostExecutor(3, [](int count, const std::function<void(int)>& task) { thread_each(count, task); }));
}

TEST_CASE("executors that can't be are refused") {
  CHECK_THROWS_AS(npt::HostExecutor(0, thread_each), npt::Error);
  CHECK_THROWS_AS(npt::SerialExecutor(2), npt::Error);
  CHECK(npt::SerialExecutor(1).slots() == 1);
  CHECK(npt::SerialExecutor(0).slots() == 1);
#if NPT_HAS_TBB
  static_assert(std::is_same_v<npt::DefaultExecutor, npt::TbbExecutor>);
#endif
}

TEST_CASE("threads: loops inside loops and from several callers run all their tasks") {
  const npt::ThreadExecutor executor(3);
  std::atomic<int> calls{0};
  const auto nested = [&] {
    for (int repeat = 0; repeat < 20; ++repeat)
      executor.for_each(10, [&](int, int) { executor.for_each(10, [&](int, int) { ++calls; }); });
  };
  std::thread other(nested);
  nested();
  other.join();
  CHECK(calls == 2 * 20 * 100);
}

TEST_CASE("threads: an exception of a task reaches the caller, and the next loop runs") {
  const npt::ThreadExecutor executor(3);
  for (int bad = 0; bad < 4; ++bad)
    CHECK_THROWS_AS(executor.for_each(100,
                                      [&](int i, int) {
                                        if (i % 4 == bad) throw std::runtime_error("task");
                                      }),
                    std::runtime_error);
  check_executor(executor);
}
