/// What the program asks of the operating system: the only place of it that names one (posix.cpp, windows.cpp). The
/// library's own few calls stand in <npt/base/platform.hpp>.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace host {

/// Before anything else: arguments and file names are UTF-8, also what is printed, writing to a closed pipe is an error
/// instead of the end, and freed memory stays with the process. The arguments, that of the program's own name first.
std::vector<std::string> begin(int argc, char** argv);

/// Calls `handler` at the first Ctrl-C (SIGINT, SIGTERM), from a signal or another thread; the second ends the program.
void on_interrupt(void (*handler)());

bool error_output_is_terminal();

/// The running program; nothing where the system doesn't say.
std::optional<std::filesystem::path> program_file();

/// A finished process.
struct Finished {
  std::string output;        ///< what it printed
  std::string failure;       ///< empty after exit status 0
  bool interrupted = false;  ///< ended by Ctrl-C, of which a child hears, too
};
/// Runs a program (empty: the running one) to its end. Its error output and terminal are this process's.
Finished run(const std::filesystem::path& program, const std::vector<std::string>& arguments);

/// Work in a process of its own, whose memory is its own, where the system can split one (fork); else in this one.
struct Apart {
  bool done = false;           ///< it came to its end
  std::string failure;         ///< how it ended else, where a process of its own did: by what signal
  std::vector<double> values;  ///< what the work returned
  double memory_mb = 0;        ///< its largest resident set
};
struct ApartLimits {
  unsigned seconds = 0;  ///< of processor time; 0: any
  double gigabytes = 0;  ///< of memory beyond this process's; 0: any
};
/// The work may ask nothing of threads that this process has started. An error of the child's is printed by it, and
/// `done` is false.
Apart run_apart(const std::function<std::vector<double>()>& work, const ApartLimits& limits = {});

/// This process's largest resident set.
double peak_memory_mb();

std::string processor_name();
/// That this process may run on.
int allowed_processors();
/// The number of processors whose time this process is granted, or nothing where no limit is set.
std::optional<double> processor_quota();
/// Bytes of memory that this process may use.
double memory_limit();

}  // namespace host
