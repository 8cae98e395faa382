#include <doctest/doctest.h>

#include <host/host.hpp>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>
#include <vector>

#include "support/needs.hpp"

#if defined(_WIN32)
extern "C" __declspec(dllimport) int __stdcall GenerateConsoleCtrlEvent(unsigned long, unsigned long);
extern "C" __declspec(dllimport) void* __stdcall GetConsoleWindow();
#endif

namespace {

#if defined(_WIN32)
bool has_console() { return GetConsoleWindow() != nullptr; }
bool press_control_c() { return GenerateConsoleCtrlEvent(0, 0) != 0; }
#else
bool has_console() { return true; }
bool press_control_c() { return std::raise(SIGINT) == 0; }
#endif

std::atomic<int> interrupts{0};

}  // namespace

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

#if !defined(_WIN32)
TEST_CASE("work apart that crashes, or takes too long, ends its own process only") {
  const host::Apart crashed = host::run_apart([]() -> std::vector<double> {
    std::raise(SIGKILL);
    return {};
  });
  CHECK_FALSE(crashed.done);
  CHECK(crashed.failure == "a child that was ended by signal 9");
  const host::Apart endless = host::run_apart(
      []() -> std::vector<double> {
        for (std::atomic<int> i = 0; i >= 0;) i = 1;
        return {};
      },
      {.seconds = 1});
  CHECK_FALSE(endless.done);
  CHECK_FALSE(endless.failure.empty());
}
#endif

TEST_CASE("the first Ctrl-C calls the handler instead of ending the program" *
          support::Needs(has_console(), "a console")) {
  host::on_interrupt([] { ++interrupts; });
  REQUIRE(press_control_c());
  for (int i = 0; i < 100 && interrupts == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  CHECK(interrupts == 1);
}
