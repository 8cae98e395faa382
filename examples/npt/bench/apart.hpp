/// Work in a process of its own, whose memory is its own.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <iostream>
#include <vector>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bench {

/// What became of it.
struct Apart {
  bool done = false;           ///< it came to its end
  std::vector<double> values;  ///< what the work returned
  double memory_mb = 0;        ///< its largest resident set
};

/// Runs `work` in a child process. To be called before this process has started threads. An error of the child's is
/// printed by it, and `done` is false.
inline Apart run_apart(const std::function<std::vector<double>()>& work) {
  Apart result;
  int ends[2];
  if (pipe(ends) != 0) return result;
  std::cout.flush();
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    try {
      const std::vector<double> values = work();
      const auto size = static_cast<ssize_t>(values.size() * sizeof(double));
      _exit(write(ends[1], values.data(), static_cast<std::size_t>(size)) == size ? 0 : 1);
    } catch (const std::exception& error) {
      std::cerr << "npt: " << error.what() << std::endl;
      _exit(1);
    } catch (...) {
      _exit(1);
    }
  }
  close(ends[1]);
  double value = 0;
  while (child > 0 && read(ends[0], &value, sizeof value) == static_cast<ssize_t>(sizeof value))
    result.values.push_back(value);
  close(ends[0]);
  int status = 0;
  rusage usage{};
  if (child < 0 || wait4(child, &status, 0, &usage) != child) return result;
  result.done = status == 0;
  result.memory_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  return result;
}

}  // namespace bench
