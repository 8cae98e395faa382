/// The seeds of a fuzzer, written by the fuzzer itself: `fuzz_obj --seeds FOLDER`. No example files are kept for it.
#pragma once

#include <npt/io/file.hpp>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace fuzz {

/// Called by LLVMFuzzerInitialize: writes the seeds and ends the program when the arguments ask for it.
inline void write_seeds_if_asked(int argc, char** argv, const std::vector<std::string>& seeds) {
  if (argc != 3 || std::string_view(argv[1]) != "--seeds") return;
  for (std::size_t i = 0; i < seeds.size(); ++i)
    npt::write_file(std::string(argv[2]) + "/seed-" + std::to_string(i), seeds[i]);
  std::printf("%zu seeds\n", seeds.size());
  std::exit(0);
}

/// A finding: the input makes something happen that must not.
inline void expect(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

}  // namespace fuzz
