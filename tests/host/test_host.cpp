#include <doctest/doctest.h>

#include <host/host.hpp>

#include <filesystem>

TEST_CASE("the system tells where the program is and what it may use") {
  REQUIRE(host::program_file());
  CHECK(std::filesystem::exists(*host::program_file()));
  CHECK(host::program_file()->stem() == "test_host");
  CHECK(host::allowed_processors() >= 1);
  CHECK(host::memory_limit() > 1e7);
  CHECK(host::peak_memory_mb() > 0.1);
  CHECK_FALSE(host::processor_name().empty());
  if (const auto quota = host::processor_quota()) CHECK(*quota > 0);
}

TEST_CASE("a program that is run gives its output, or says why not") {
  const host::Finished listed = host::run({}, {"--list-test-cases"});
  CHECK(listed.failure.empty());
  CHECK(listed.output.find("the system tells where the program is") != std::string::npos);
  CHECK_FALSE(listed.interrupted);
  CHECK_FALSE(host::run("/no/such/program", {}).failure.empty());
}

TEST_CASE("work apart gives its numbers, or says that it failed") {
  const host::Apart good = host::run_apart([] { return std::vector<double>{1, 2.5}; });
  CHECK(good.done);
  CHECK(good.values == std::vector<double>{1, 2.5});
  CHECK(good.memory_mb > 0.1);
}
