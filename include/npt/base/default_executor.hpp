/// The executor of engines that name none: oneTBB's where it is there (NPT_HAS_TBB), else the serial one, or threads of
/// its own where NPT_DEFAULT_THREADS is defined.
#pragma once

#include <npt/config.hpp>
#if NPT_HAS_TBB && defined(NPT_COMPILED)
#include <npt/base/tbb_executor_class.hpp>
#elif NPT_HAS_TBB
#include <npt/base/tbb_executor.hpp>
#elif defined(NPT_DEFAULT_THREADS)
#include <npt/base/thread_executor.hpp>
#else
#include <npt/base/executor.hpp>
#endif

namespace npt::inline NPT_ABI {

#if NPT_HAS_TBB
using DefaultExecutor = TbbExecutor;
#elif defined(NPT_DEFAULT_THREADS)
using DefaultExecutor = ThreadExecutor;
#else
using DefaultExecutor = SerialExecutor;
#endif

}  // namespace npt::inline NPT_ABI
