# To be sourced: how many compilers and tests run at a time, where the environment doesn't say so already. One for each processor that
# this process may use, and at most one for each 3 GB of memory that is free: g++ takes 2.3 GB for the largest units.
if [ -z "${CMAKE_BUILD_PARALLEL_LEVEL:-}" ]; then
  CMAKE_BUILD_PARALLEL_LEVEL=$(nproc 2> /dev/null || echo 2)
  npt_memory_jobs=$(awk '/^MemAvailable:/ { print int($2 / 3000000) }' /proc/meminfo 2> /dev/null || true)
  [ -z "$npt_memory_jobs" ] || [ "$npt_memory_jobs" -ge "$CMAKE_BUILD_PARALLEL_LEVEL" ] || CMAKE_BUILD_PARALLEL_LEVEL=$((npt_memory_jobs > 0 ? npt_memory_jobs : 1))
  export CMAKE_BUILD_PARALLEL_LEVEL
fi
export CTEST_PARALLEL_LEVEL="${CTEST_PARALLEL_LEVEL:-$CMAKE_BUILD_PARALLEL_LEVEL}"
