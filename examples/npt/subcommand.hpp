/// The program's subcommands. Each has a file of its own, which registers it:
///
///   void add(CLI::App& command) {
///     auto options = std::make_shared<Options>();
///     command.add_option("FILE", options->files, "...")->required();
///     command.callback([options] { run(*options); });
///   }
///   const program::Subcommand registered("info", "Says what a file holds", add);
///
/// A subcommand that fails throws: npt::Error for what the user can mend, anything else for the rest; main.cpp turns
/// both into a message and an exit status.
#pragma once

#include "path_option.hpp"

#include <CLI/CLI.hpp>

#include <charconv>
#include <cstdint>
#include <string>
#include <system_error>
#include <vector>

namespace program {

class Subcommand {
 public:
  using Add = void (*)(CLI::App& command);

  Subcommand(std::string name_, std::string description_, Add add_)
      : name(std::move(name_)), description(std::move(description_)), add(add_) {
    all().push_back(this);
  }
  Subcommand(const Subcommand&) = delete;
  Subcommand& operator=(const Subcommand&) = delete;

  /// In the order in which the linker placed them: sort before use.
  static std::vector<const Subcommand*>& all() {
    static std::vector<const Subcommand*> subcommands;
    return subcommands;
  }

  const std::string name;
  const std::string description;
  const Add add;
};

/// For seeds. CLI11 2.1 by itself wraps negative numbers around and cuts off what is too large.
inline CLI::Validator whole_number() {
  const auto complaint = [](const std::string& text) {
    std::uint64_t value = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool good = result.ec == std::errc() && result.ptr == text.data() + text.size();
    return good ? std::string() : "'" + text + "' is not a whole number from 0 to 18446744073709551615";
  };
  return CLI::Validator(complaint, "");
}

}  // namespace program
