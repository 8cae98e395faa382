/// What a user can do about an error or a warning: in this program's options, and where the guides say more.
#pragma once

#include <formats/read.hpp>

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

/// The end of a message: the entry of the guide, which is called as the code with '-' for '_' (guides.messages holds
/// that each is there). Nothing without an entry.
inline std::string guide_text(const std::string& entry) {
  return entry.empty() ? "" : ". See docs/troubleshooting.md#" + entry;
}

inline std::string entry_of(npt::WarningCode code) {
  using enum npt::WarningCode;
  switch (code) {
    case not_recognised:
      return "not-recognised";
    case low_confidence:
      return "low-confidence";
    case no_surface:
      return "no-surface";
    case upside_down:
      return "upside-down";
    case lying:
      return "lying";
    case lying_or_z_up:
      return "lying-or-z-up";
    case arms_uncertain:
      return "arms-uncertain";
    case legs_uncertain:
      return "legs-uncertain";
    case unusual_proportions:
      return "unusual-proportions";
    case faces_inward:
      return "faces-inward";
    case unit_assumed:
      return "unit-assumed";
    case part_of_mesh:
      return "part-of-mesh";
  }
  return {};
}

/// None for bad_input, whose message names the place, what stands there and what should, and for what the user asked
/// for; but a file with a clip and no mesh is the usual download.
inline std::string entry_of(const npt::Error& error) {
  using enum npt::ErrorCode;
  switch (error.code()) {
    case not_recognised:
      return "not-recognised";
    case unknown_unit:
      return "unknown-unit";
    case missing_weights:
      return "missing-weights";
    case foreign:
      return "foreign";
    case domains_differ:
      return "domains-differ";
    case needs_recognition:
      return "needs-recognition";
    case stopped:
      return {};
    case bad_input: {
      const npt::ErrorParts& parts = error.parts();
      const bool no_mesh = parts.found == "no mesh" || parts.found == "a scene that shows no mesh";
      return no_mesh && formats::is_scene(parts.file) ? "found-no-mesh" : "";
    }
  }
  return {};
}

/// A sentence for each warning, with what to do about it. identity, pose: what the meshes are called
inline std::vector<std::string> notes_of(const npt::Warnings& warnings, const std::string& identity,
                                         const std::string& pose) {
  std::vector<std::string> notes;
  for (const npt::Warning& warning : warnings) {
    const std::string remedy = remedy_text(warning.remedy);
    notes.push_back(npt::text_of(warning, identity, pose) + (remedy.empty() ? "" : "; " + remedy) +
                    guide_text(entry_of(warning.code)));
  }
  return notes;
}

/// The message of an error, with what to do about it.
inline std::string message_of(const npt::Error& error) {
  const std::string remedy = error.code() == npt::ErrorCode::domains_differ
                                 ? "npt transfer --across tries it all the same, an experiment"
                                 : remedy_text(error.remedy());
  return std::string(error.what()) + (remedy.empty() ? "" : " (" + remedy + ")") + guide_text(entry_of(error));
}

}  // namespace program
