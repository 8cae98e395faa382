/// What a user can do about an error or a warning, in this program's options.
#pragma once

#include <npt/base/error.hpp>
#include <npt/transfer/warning.hpp>

#include <string>
#include <vector>

namespace program {

/// Empty where there is nothing to do.
inline std::string remedy_text(npt::Remedy remedy) {
  switch (remedy) {
    case npt::Remedy::choose_method:
      return "--method network gives the network's result all the same, --method body that of body estimation";
    case npt::Remedy::give_unit:
      return "--unit says another one";
    case npt::Remedy::give_weights:
      return "put them beside the others, or use --method network";
    default:
      return npt::text_of(remedy);
  }
}

/// A sentence for each warning, with what to do about it. identity, pose: what the meshes are called
inline std::vector<std::string> notes_of(const npt::Warnings& warnings, const std::string& identity,
                                         const std::string& pose) {
  std::vector<std::string> notes;
  for (const npt::Warning& warning : warnings) {
    const std::string remedy = remedy_text(warning.remedy);
    notes.push_back(npt::text_of(warning, identity, pose) + (remedy.empty() ? "" : "; " + remedy));
  }
  return notes;
}

/// The message of an error, with what to do about it.
inline std::string message_of(const npt::Error& error) {
  const std::string remedy = remedy_text(error.remedy());
  return std::string(error.what()) + (remedy.empty() ? "" : " (" + remedy + ")");
}

}  // namespace program
