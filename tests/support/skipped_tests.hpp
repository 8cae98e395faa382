/// The tests of this program that were skipped for want of something: from support/needs.hpp to main.
#pragma once

#include <string>
#include <vector>

namespace support {

struct SkippedTest {
  std::string name, needs;
};

inline std::vector<SkippedTest>& skipped_tests() {
  static std::vector<SkippedTest> tests;
  return tests;
}

}  // namespace support
