#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <cstdio>
#include <string_view>

#include "support/skipped_tests.hpp"

#if defined(__SANITIZE_ADDRESS__)
// Debian 12's libassimp loses tokens of FBX files that end early: not this project's memory.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp"; }
#endif

/// doctest's main, which also names the tests that were skipped for want of something (support/needs.hpp). If only
/// those were asked for (-ts=needs) and none failed, the status is 77, which ctest knows as "Skipped".
int main(int argc, char** argv) {
  doctest::Context context(argc, argv);
  const int status = context.run();
  if (context.shouldExit()) return status;
  bool only_needs = false, without_needs = false;
  for (int i = 1; i < argc; ++i) {
    only_needs = only_needs || std::string_view(argv[i]) == "-ts=needs";
    without_needs = without_needs || std::string_view(argv[i]) == "-tse=needs";
  }
  if (without_needs) return status;
  for (const support::SkippedTest& test : support::skipped_tests())
    std::printf("SKIPPED: %s: needs %s\n", test.name.c_str(), test.needs.c_str());
  return status == 0 && only_needs && !support::skipped_tests().empty() ? 77 : status;
}
