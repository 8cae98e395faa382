/// How the engine runs its tasks. An executor is any type with
///   int slots() const                           the most tasks that ever run at the same time
///   void for_each(int count, const F& f) const  calls f(i, slot) once for each i in 0 .. count - 1 and returns when
///                                               all are done; slot < slots(), and no two running calls share a slot
/// Results never depend on the executor: every sum over vertices has a fixed order.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <string>

namespace npt::inline NPT_ABI {

namespace parallel::internal {
struct Probe {
  void operator()(int, int) const {}
};
}  // namespace parallel::internal

template <class E>
concept Executor = requires(const E& executor, const parallel::internal::Probe& f) {
  { executor.slots() } -> std::convertible_to<int>;
  executor.for_each(1, f);
};

/// Runs everything in the calling thread.
class SerialExecutor {
 public:
  /// An engine's thread count means the same with every executor: 0 or 1 here.
  /// Errors  npt::Error for more, since an engine that was promised four threads would else run on one in silence
  explicit SerialExecutor(int threads = 0) {
    if (threads > 1)
      throw Error(
          {.file = "threads",
           .found = std::to_string(threads),
           .expected = "0 or 1: this engine is serial (npt::ThreadExecutor, npt::HostExecutor or oneTBB give more)"});
  }

  int slots() const { return 1; }

  template <class F>
  void for_each(int count, const F& f) const {
    for (int i = 0; i < count; ++i) f(i, 0);
  }
};
static_assert(Executor<SerialExecutor>);

/// Runs f(first, last) over ranges of 0 .. count - 1, side by side. The ranges don't depend on the executor.
template <Executor Exec, class F>
void for_ranges(const Exec& executor, std::size_t count, const F& f) {
  constexpr std::size_t range = 512;
  executor.for_each(static_cast<int>((count + range - 1) / range), [&](int i, int) {
    const std::size_t first = static_cast<std::size_t>(i) * range;
    f(first, std::min(count, first + range));
  });
}

}  // namespace npt::inline NPT_ABI
