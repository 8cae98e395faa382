/// Runs before anything else of the program: on a processor that lacks instructions which the program was compiled for,
/// it ends with a message instead of by SIGILL at the first of them.
#include "processor/features.hpp"

#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace {

// 101: the first priority that is the program's own, before the constructors of every other unit.
__attribute__((constructor(101))) void check_processor() {
  char line[512];
  const std::size_t length = program::complain_of_missing(program::compiled_features, program::processor_features(),
                                                          program::compiled_for, line, sizeof line);
  if (length == 0) return;
  std::fwrite(line, 1, length, stderr);
  std::_Exit(1);
}

}  // namespace
