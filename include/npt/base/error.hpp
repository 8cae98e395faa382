/// The one exception of npt: bad files and bad user data. It says where, what was found and what was expected.
#pragma once

#include <npt/config.hpp>

#include <stdexcept>
#include <string>
#include <utility>

namespace npt::inline NPT_ABI {

/// What an Error says. Any part may be empty; the message leaves it out then.
struct ErrorParts {
  std::string file{};      ///< path of the file, or the name of the argument, that is at fault
  std::string place{};     ///< place in it: "line 12", "tensor 'decoder.conv1.weight'", "byte 812"
  std::string found{};     ///< what stands there
  std::string expected{};  ///< what should stand there
};

/// Bad input. what() reads "file: place: found X, expected Y". The parts stay readable by program.
class Error : public std::runtime_error {
 public:
  explicit Error(ErrorParts parts) : std::runtime_error(compose(parts)), parts_(std::move(parts)) {}

  const ErrorParts& parts() const noexcept { return parts_; }

 private:
  static std::string compose(const ErrorParts& p) {
    std::string text;
    const auto add = [&text](const std::string& piece, const char* separator) {
      if (piece.empty()) return;
      if (!text.empty()) text += separator;
      text += piece;
    };
    add(p.file, ": ");
    add(p.place, ": ");
    if (!p.found.empty()) add("found " + p.found, ": ");
    if (!p.expected.empty()) add("expected " + p.expected, p.found.empty() ? ": " : ", ");
    return text;
  }

  ErrorParts parts_;
};

}  // namespace npt::inline NPT_ABI
