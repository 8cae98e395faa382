/// Runs this program again with other arguments: one command is composed of others, each of which a user can give
/// alone.
#pragma once

#include <string>
#include <vector>

namespace reproduce {

/// As it would be typed: "npt train --body human.safetensors".
std::string command_line(const std::vector<std::string>& arguments);

/// Runs the program with these arguments and gives what it printed; its messages and progress appear as always.
/// `program`  empty: the running program
/// Errors     npt::Error that names the command if it can't be started or fails. After Ctrl-C, of which the child hears
///            too, it gives `interrupted` instead
struct ChildResult {
  std::string output;
  bool interrupted = false;
};
ChildResult run_child(const std::vector<std::string>& arguments, const std::string& program = {});

}  // namespace reproduce
