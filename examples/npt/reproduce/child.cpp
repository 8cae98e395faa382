#include "reproduce/child.hpp"

#include <npt/core/error.hpp>

#include <cerrno>
#include <csignal>
#include <cstring>

#include <sys/wait.h>
#include <unistd.h>

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
  const auto fail = [&](const std::string& found) {
    throw npt::Error({.file = command_line(arguments), .found = found, .expected = "a command that succeeds"});
  };
  int ends[2] = {};
  if (pipe(ends) != 0) fail(std::strerror(errno));
  std::string name = program.empty() ? "/proc/self/exe" : program;
  std::vector<std::string> words{"npt"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& w : words) pointers.push_back(w.data());
  pointers.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) {
    close(ends[0]);
    close(ends[1]);
    fail(std::strerror(errno));
  }
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    execv(name.c_str(), pointers.data());
    _exit(127);
  }
  close(ends[1]);
  ChildResult result;
  char buffer[4096];
  for (;;) {
    const ssize_t n = read(ends[0], buffer, sizeof buffer);
    if (n > 0)
      result.output.append(buffer, static_cast<std::size_t>(n));
    else if (n == 0 || errno != EINTR)
      break;
  }
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  constexpr int status_of_interrupted = 130;
  if (WIFEXITED(status) && WEXITSTATUS(status) == status_of_interrupted) result.interrupted = true;
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGINT || WTERMSIG(status) == SIGTERM)) result.interrupted = true;
  if (result.interrupted) return result;
  if (WIFSIGNALED(status)) fail("a child that was ended by signal " + std::to_string(WTERMSIG(status)));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail("exit status " + std::to_string(WEXITSTATUS(status)));
  return result;
}

}  // namespace reproduce
