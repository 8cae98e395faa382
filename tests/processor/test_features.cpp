// What the program says on a processor that lacks what it was compiled for.
#include <doctest/doctest.h>

#include "processor/features.hpp"
#include "support/needs.hpp"

#if defined(NPT_GUARDED)
#include <sys/wait.h>
#endif

#include <cstdio>
#include <string>

namespace {

std::string complaint(program::FeatureSet needed, program::FeatureSet has, std::size_t size = 512) {
  std::string line(size, '\0');
  line.resize(program::complain_of_missing(needed, has, "avx512", line.data(), line.size()));
  return line;
}

}  // namespace

TEST_CASE("a processor that has what is needed, or more, is no reason to complain") {
  CHECK(complaint(0, 0).empty());
  CHECK(complaint(1U << program::avx2, 1U << program::avx2 | 1U << program::fma).empty());
  CHECK(complaint(program::compiled_features, program::processor_features()).empty());
}

TEST_CASE("what is missing is named, all of it and nothing else") {
  const program::FeatureSet old = 1U << program::sse3 | 1U << program::avx;
  CHECK(
      complaint(old | 1U << program::avx512f | 1U << program::avx512bf16, old) ==
      "npt: error: this program was compiled for avx512, and this processor lacks avx512f avx512bf16: build it on this "
      "machine, or with cmake -DNPT_NATIVE=OFF for every x86-64 processor\n");
  const std::string all = complaint((1U << program::feature_count) - 1, 0);
  CHECK(all.find(" sse3 ssse3 sse4.1 sse4.2 popcnt avx avx2 fma ") != std::string::npos);
  CHECK(all.ends_with("processor\n"));
}

TEST_CASE("a line that is too short is cut") { CHECK(complaint(1, 0, 10) == "npt: error"); }

#if defined(NPT_GUARDED)
TEST_CASE("a program that needs what the processor lacks ends with a message before it begins" *
          support::Needs((program::processor_features() >> program::avx512er & 1U) == 0,
                         "a processor without AVX512ER")) {
  std::FILE* pipe = ::popen("'" NPT_GUARDED "' 2>&1", "r");
  REQUIRE(pipe != nullptr);
  std::string text(1000, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), pipe));
  const int status = ::pclose(pipe);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 1);
  CHECK(text.starts_with("npt: error: this program was compiled for "));
  CHECK(text.find(" avx512er") != std::string::npos);
}
#endif
