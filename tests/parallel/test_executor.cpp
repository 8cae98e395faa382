#include <doctest/doctest.h>

#include <npt/parallel/executor.hpp>
#include <npt/parallel/tbb_executor.hpp>

#include <atomic>
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
}  // namespace

TEST_CASE("executors call every index once, and never two at a time in one slot") {
  check_executor(npt::SerialExecutor{});
  check_executor(npt::TbbExecutor(1));
  check_executor(npt::TbbExecutor(2));
  check_executor(npt::TbbExecutor(5));
  check_executor(npt::TbbExecutor());
  tbb::task_arena arena(3);
  check_executor(npt::TbbExecutor(arena));
}
