/// The one exception of npt: bad files and bad user data. It says where, what was found and what was expected.
#pragma once

#include <npt/config.hpp>

#include <stdexcept>
#include <string>
#include <utility>

namespace npt::inline NPT_ABI {

/// What kind of fault an Error is, for programs that act on it.
enum class ErrorCode {
  bad_input,          ///< a file, a mesh or an argument that can't be used; what() says why
  not_recognised,     ///< a mesh isn't recognised in the domain of the weights
  unknown_unit,       ///< the network needs the mesh's unit, and its size doesn't tell it
  missing_weights,    ///< weights that the opened ones go with are missing
  foreign,            ///< something that another transfer, or no transfer, prepared
  domains_differ,     ///< a character of one domain and a pose of another
  needs_recognition,  ///< what is asked for exists for recognised meshes only
  stopped             ///< the caller asked to stop
};

/// What a user can do about an error or a warning. The library knows no options of programs: each says it in its own.
enum class Remedy {
  none,
  look_at_result,  ///< look at the result before using it
  choose_method,   ///< ask for one method: the body method or the network, whatever the meshes are
  give_unit,       ///< say the meshes' unit
  give_weights     ///< say where the missing weights are, or use the network alone
};

/// What an Error says. Any part may be empty; the message leaves it out then.
struct ErrorParts {
  std::string file{};      ///< path of the file, or the name of the argument, that is at fault
  std::string place{};     ///< place in it: "line 12", "tensor 'decoder.conv1.weight'", "byte 812"
  std::string found{};     ///< what stands there
  std::string expected{};  ///< what should stand there
  ErrorCode code = ErrorCode::bad_input;
  Remedy remedy = Remedy::none;
};

/// Bad input. what() reads "file: place: found X, expected Y". The parts stay readable by program.
class Error : public std::runtime_error {
 public:
  explicit Error(ErrorParts parts) : std::runtime_error(compose(parts)), parts_(std::move(parts)) {}

  const ErrorParts& parts() const noexcept { return parts_; }
  ErrorCode code() const noexcept { return parts_.code; }
  Remedy remedy() const noexcept { return parts_.remedy; }

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
