#include "reproduce/child.hpp"

#include "host/host.hpp"

#include <npt/base/error.hpp>

#include <utility>

namespace reproduce {

namespace {

/// As a shell takes it for one word.
std::string quoted(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \n\\'\"$&|;()<>*?#") == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? "'\\''" : std::string(1, c);
  return text + "'";
}

}  // namespace

std::string command_line(const std::vector<std::string>& arguments) {
  std::string text = "npt";
  for (const std::string& a : arguments) text += ' ' + quoted(a);
  return text;
}

ChildResult run_child(const std::vector<std::string>& arguments, const std::string& program) {
  host::Finished finished = host::run(program, arguments);
  if (!finished.failure.empty())
    throw npt::Error(
        {.file = command_line(arguments), .found = finished.failure, .expected = "a command that succeeds"});
  return {std::move(finished.output), finished.interrupted};
}

}  // namespace reproduce
