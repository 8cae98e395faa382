/// Tests that need what not every machine has say so, and are reported as skipped where it is missing:
///   TEST_CASE("the shared bodies load" * support::needs_shared("data/human_6890.safetensors"))
/// They make up the suite "needs", which ctest runs apart as MODULE.needs (tests/CMakeLists.txt): "Skipped" there where
/// one was skipped and none failed.
#pragma once

#include <doctest/doctest.h>

#include <npt/nn/simd/amx.hpp>

#include <filesystem>
#include <string>
#include <utility>

#include "support/skipped_tests.hpp"

namespace support {

/// A decorator of doctest's.
class Needs {
 public:
  Needs(bool met, std::string what) : met_(met), what_(std::move(what)) {}
  void fill(doctest::detail::TestCase& test) const {
    test.m_test_suite = "needs";
    test.m_skip = !met_;
    if (!met_) skipped_tests().push_back({test.m_name, what_});
  }

 private:
  bool met_;
  std::string what_;
};

inline Needs needs_matrix_registers() { return {npt::simd::has_matrix_registers(), "matrix registers (AMX)"}; }

#if defined(NPT_SHARED)
/// A file or folder beside the repository, in ../shared.
inline Needs needs_shared(const std::string& path) {
  return {std::filesystem::exists(std::filesystem::path(NPT_SHARED) / path), "../shared/" + path};
}
#endif

}  // namespace support
