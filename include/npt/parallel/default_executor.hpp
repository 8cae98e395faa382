/// The executor of engines that name none: oneTBB's where it is there (NPT_HAS_TBB), else the serial one.
#pragma once

#include <npt/config.hpp>
#if NPT_HAS_TBB
#include <npt/parallel/tbb_executor.hpp>
#else
#include <npt/parallel/executor.hpp>
#endif

namespace npt::inline NPT_ABI {

#if NPT_HAS_TBB
using DefaultExecutor = TbbExecutor;
#else
using DefaultExecutor = SerialExecutor;
#endif

}  // namespace npt::inline NPT_ABI
