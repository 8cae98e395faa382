/// The program npt: finds the subcommand, runs it, and turns what goes wrong into a message and an exit status:
/// 0 done, 1 bad input or a failure, 2 bad arguments, 130 interrupted.
#include "help_format.hpp"
#include "host/host.hpp"
#include "interrupt.hpp"
#include "remedies.hpp"
#include "subcommand.hpp"

#include <npt/base/error.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace {

enum ExitStatus : int { done = 0, failed = 1, bad_arguments = 2, interrupted = 130 };

std::vector<const program::Subcommand*> subcommands() {
  std::vector<const program::Subcommand*> list = program::Subcommand::all();
  std::ranges::sort(list, {}, &program::Subcommand::name);
  return list;
}

/// CLI11 would call it an unexpected argument.
void check_subcommand(const std::vector<std::string>& arguments) {
  if (arguments.size() < 2 || arguments[1].starts_with('-')) return;
  std::string known;
  for (const program::Subcommand* subcommand : subcommands()) {
    if (subcommand->name == arguments[1]) return;
    known += (known.empty() ? "" : ", ") + subcommand->name;
  }
  throw CLI::ArgumentMismatch("unknown subcommand '" + arguments[1] + "', expected one of: " + known);
}

int complain(const std::string& message, int status) {
  std::cout.flush();
  std::cerr << "npt: error: " << message << '\n';
  return status;
}

int complain_about_arguments(const CLI::App& app, const CLI::ParseError& error) {
  std::string name = "npt";
  for (const CLI::App* used : app.get_subcommands()) name += " " + used->get_name();
  return complain(error.what() + std::string("\nRun '") + name + " --help' for the arguments.", bad_arguments);
}

/// What `npt` alone prints: commands to paste, which need no files, and where more stands.
constexpr const char* first_steps =
    "npt " NPT_VERSION
    ": put a pose or an animation on any character mesh.\n"
    "\n"
    "Try it on two meshes that npt makes, and open result.html in a browser:\n"
    "  npt generate --shape-seed 41 --proportions --pose rest --out character.ply\n"
    "  npt generate --seed 8 --pose natural --out pose.ply\n"
    "  npt transfer --identity character.ply --pose pose.ply --out result.ply --view result.html\n"
    "\n"
    "Then with your own (.glb, .fbx, .obj, .ply ...), here with a clip:\n"
    "  npt transfer --identity character.glb --pose walker.glb --clip Walk --out result.glb\n"
    "\n"
    "npt --help lists the commands, npt COMMAND --help the options of one.\n"
    "Guides: docs/quickstart-artist.md, docs/quickstart-research.md, docs/program.md.\n";

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 2) {
    std::cout << first_steps;
    return done;
  }
  CLI::App app("Put a pose or an animation on any character mesh.", "npt");
  app.formatter(std::make_shared<program::HelpFormat>());
  app.set_help_flag("-h,--help", "Print this help");
  app.set_version_flag("--version", std::string("npt " NPT_VERSION), "Print the version");
  app.require_subcommand(1);
  for (const program::Subcommand* subcommand : subcommands())
    subcommand->add(*app.add_subcommand(subcommand->name, subcommand->description));
  app.footer("npt COMMAND --help lists the options of one. npt alone prints what to do first.");  // of no subcommand
  try {
    check_subcommand(arguments);
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend() - 1));  // the last first
  } catch (const CLI::CallForHelp&) {
    const auto used = app.get_subcommands();
    std::cout << (used.empty() ? app.help() : used.front()->help("npt"));
  } catch (const CLI::CallForVersion& version) {
    std::cout << version.what() << '\n';
  } catch (const CLI::ParseError& error) {
    return complain_about_arguments(app, error);
  }
  return done;
}

/// What was printed may not have arrived: a full disk is an error, a reader that has seen enough (head) is not.
int finish_output(int status) {
  errno = 0;
  std::cout.flush();
  if (std::cout || status != done) return status;
  if (errno == EPIPE) return done;
  return complain(std::string("standard output: ") + (errno != 0 ? std::strerror(errno) : "can't be written"), failed);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return finish_output(run(host::begin(argc, argv)));
  } catch (const program::Interrupted&) {
    return complain("interrupted", interrupted);
  } catch (const std::bad_alloc&) {
    return complain("out of memory", failed);
  } catch (const npt::Error& error) {
    return complain(program::message_of(error), failed);
  } catch (const std::exception& error) {
    return complain(error.what(), failed);
  } catch (...) {
    return complain("unknown failure", failed);
  }
}
