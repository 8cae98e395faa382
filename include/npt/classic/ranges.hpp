/// Loops over many small pieces of work on an executor.
#pragma once

#include <npt/config.hpp>
#include <npt/parallel/executor.hpp>

#include <algorithm>
#include <cstddef>

namespace npt::inline NPT_ABI::classic {

/// Runs f(first, last) over ranges of 0 .. count - 1, side by side. The ranges don't depend on the executor.
template <Executor Exec, class F>
void for_ranges(const Exec& executor, std::size_t count, const F& f) {
  constexpr std::size_t range = 512;
  executor.for_each(static_cast<int>((count + range - 1) / range), [&](int i, int) {
    const std::size_t first = static_cast<std::size_t>(i) * range;
    f(first, std::min(count, first + range));
  });
}

}  // namespace npt::inline NPT_ABI::classic
