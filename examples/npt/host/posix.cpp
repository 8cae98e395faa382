#include "host/host.hpp"

#if !defined(_WIN32)

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <sstream>
#include <system_error>
#include <thread>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif
#if defined(__linux__)
#include <sched.h>
#elif defined(__APPLE__)
#include <mach-o/dyld.h>
#endif

namespace host {

namespace {

double megabytes(const rusage& usage) {
#if defined(__APPLE__)
  return static_cast<double>(usage.ru_maxrss) / (1024 * 1024);  // in bytes there
#else
  return static_cast<double>(usage.ru_maxrss) / 1024;
#endif
}

/// How a process ended that waitpid() tells of.
std::string ended_by(int status) {
  if (WIFSIGNALED(status)) return "a child that was ended by signal " + std::to_string(WTERMSIG(status));
  return "exit status " + std::to_string(WEXITSTATUS(status));
}

// Sanitizers reserve more memory than there is.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitized = true;
#elif defined(__has_feature)
constexpr bool sanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool sanitized = false;
#endif

/// Limits of the process that this is; of memory where the system says how much it uses.
void keep_to(const ApartLimits& limits) {
  if (limits.seconds > 0) {
    const rlimit time{.rlim_cur = limits.seconds, .rlim_max = limits.seconds};
    setrlimit(RLIMIT_CPU, &time);
  }
  rlim_t pages = 0;
  if (sanitized || !(limits.gigabytes > 0) || !(std::ifstream("/proc/self/statm") >> pages)) return;
  const rlim_t most = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + static_cast<rlim_t>(limits.gigabytes * 1e9);
  const rlimit memory{.rlim_cur = most, .rlim_max = most};
  setrlimit(RLIMIT_AS, &memory);
}

std::optional<std::string> first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) return std::nullopt;
  return line;
}

/// This process's folders in the control group tree, from its own up to the root.
std::vector<std::string> control_groups() {
  std::vector<std::string> folders;
  std::string path;
  std::ifstream file("/proc/self/cgroup");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("0::/")) path = line.substr(3);
  for (;;) {
    folders.push_back("/sys/fs/cgroup" + (path == "/" ? "" : path));
    if (path.size() <= 1) return folders;
    path.resize(path.rfind('/'));
  }
}

}  // namespace

std::vector<std::string> begin(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
#if defined(__GLIBC__)
  // Freed memory is used again: what returns to the system comes back page by page, which took a fifth of a transfer.
  constexpr int kept = 1 << 25;  // the most that glibc takes for the first
  mallopt(M_MMAP_THRESHOLD, kept);
  mallopt(M_TRIM_THRESHOLD, kept);
#endif
  return {argv, argv + argc};
}

void on_interrupt(void (*handler)()) {
  static void (*called)() = nullptr;
  called = handler;
  struct sigaction action {};
  action.sa_handler = [](int) { called(); };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool error_output_is_terminal() { return isatty(STDERR_FILENO) != 0; }

std::optional<std::filesystem::path> program_file() {
  std::error_code code;
#if defined(__APPLE__)
  char name[4096];
  std::uint32_t size = sizeof name;
  if (_NSGetExecutablePath(name, &size) != 0) return std::nullopt;
  const std::filesystem::path program = std::filesystem::canonical(name, code);
#else
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", code);
#endif
  if (code) return std::nullopt;
  return program;
}

Finished run(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  Finished result;
#if defined(__linux__)
  const std::string name = program.empty() ? "/proc/self/exe" : program.string();  // also if the file has been replaced
#else
  const std::string name = program.empty() ? program_file().value_or("npt").string() : program.string();
#endif
  int ends[2] = {};
  if (pipe(ends) != 0) {
    result.failure = std::strerror(errno);
    return result;
  }
  std::vector<std::string> words{program.empty() ? "npt" : name};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& w : words) pointers.push_back(w.data());
  pointers.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) {
    result.failure = std::strerror(errno);
    close(ends[0]);
    close(ends[1]);
    return result;
  }
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    execv(name.c_str(), pointers.data());
    _exit(127);
  }
  close(ends[1]);
  char buffer[4096];
  for (;;) {
    const ssize_t n = read(ends[0], buffer, sizeof buffer);
    if (n > 0)
      result.output.append(buffer, static_cast<std::size_t>(n));
    else if (n == 0 || errno != EINTR)
      break;
  }
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  constexpr int status_of_interrupted = 130;
  if (WIFEXITED(status) && WEXITSTATUS(status) == status_of_interrupted) result.interrupted = true;
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGINT || WTERMSIG(status) == SIGTERM)) result.interrupted = true;
  if (result.interrupted) return result;
  if (status != 0) result.failure = ended_by(status);
  return result;
}

Apart run_apart(const std::function<std::vector<double>()>& work, const ApartLimits& limits) {
  Apart result;
  int ends[2];
  if (pipe(ends) != 0) return result;
  std::cout.flush();
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    keep_to(limits);
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
  if (!result.done) result.failure = ended_by(status);
  result.memory_mb = megabytes(usage);
  return result;
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return megabytes(usage);
}

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.size(), line.find(':') + 2));
  return "unknown";
}

int allowed_processors() {
#if defined(__linux__)
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0) return CPU_COUNT(&set);
#endif
  return static_cast<int>(std::thread::hardware_concurrency());
}

std::optional<double> processor_quota() {
  std::optional<double> quota;
  const auto take = [&quota](double granted) { quota = std::min(quota.value_or(granted), granted); };
  for (const std::string& folder : control_groups()) {
    std::istringstream text(first_line(folder + "/cpu.max").value_or(""));
    double time = 0, period = 0;
    if (text >> time >> period && period > 0) take(time / period);
  }
  const std::string old = "/sys/fs/cgroup/cpu/cpu.cfs_";
  const double time = std::atof(first_line(old + "quota_us").value_or("-1").c_str());
  const double period = std::atof(first_line(old + "period_us").value_or("0").c_str());
  if (time > 0 && period > 0) take(time / period);
  return quota;
}

double memory_limit() {
  double limit = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  for (const std::string& folder : control_groups()) {
    const double granted = std::atof(first_line(folder + "/memory.max").value_or("").c_str());  // "max" reads as 0
    if (granted > 0) limit = std::min(limit, granted);
  }
  return limit;
}

}  // namespace host

#endif
