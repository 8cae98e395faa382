#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <reproduce/child.hpp>

#include <string>

TEST_CASE("a command line can be typed") {
  CHECK(reproduce::command_line({"train", "--body", "a b.safetensors"}) == "npt train --body 'a b.safetensors'");
}

#if defined(_WIN32)
TEST_CASE("what a child prints comes back, its failure is an error that names it") {
  const std::string shell = "C:\\windows\\system32\\cmd.exe";
  CHECK(reproduce::run_child({"/c", "echo", "one"}, shell).output == "one\r\n");
  CHECK_THROWS_WITH_AS(reproduce::run_child({"/c", "exit", "3"}, shell), doctest::Contains("exit status 3"),
                       npt::Error);
  CHECK_THROWS_AS(reproduce::run_child({"x"}, "/nonexistent/program"), npt::Error);
  CHECK(reproduce::run_child({"/c", "exit", "130"}, shell).interrupted);
}
#else
TEST_CASE("what a child prints comes back, its failure is an error that names it") {
  CHECK(reproduce::run_child({"-c", "echo one; echo two"}, "/bin/sh").output == "one\ntwo\n");
  CHECK_THROWS_WITH_AS(reproduce::run_child({"-c", "exit 3"}, "/bin/sh"), doctest::Contains("exit status 3"),
                       npt::Error);
  CHECK_THROWS_WITH_AS(reproduce::run_child({"-c", "kill -9 $$"}, "/bin/sh"), doctest::Contains("signal 9"),
                       npt::Error);
  CHECK_THROWS_AS(reproduce::run_child({"x"}, "/nonexistent/program"), npt::Error);
}

TEST_CASE("an interrupted child is no failure") {
  CHECK(reproduce::run_child({"-c", "exit 130"}, "/bin/sh").interrupted);
  CHECK(reproduce::run_child({"-c", "kill -INT $$"}, "/bin/sh").interrupted);
  CHECK_FALSE(reproduce::run_child({"-c", "true"}, "/bin/sh").interrupted);
}
#endif
