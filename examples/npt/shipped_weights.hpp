/// Where the weights that come with the project lie: in a folder that the environment names (NPT_WEIGHTS), beside an
/// installed program (share/npt/weights), or in the source tree that the program was built in (examples/weights).
#pragma once

#include "host/host.hpp"

#include <npt/base/error.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace program {

/// Folders in which shipped weights are looked for, in this order, each once.
inline std::vector<std::filesystem::path> weights_folders() {
  std::vector<std::filesystem::path> folders;
  if (const char* named = std::getenv("NPT_WEIGHTS"); named != nullptr && *named != '\0') folders.emplace_back(named);
  if (const std::optional<std::filesystem::path> program = host::program_file())
    for (const char* place :
         {"../share/npt/weights", "../../share/npt/weights", "../../../examples/weights", "../../examples/weights"})
      if (std::filesystem::path folder = (program->parent_path() / place).lexically_normal();
          std::ranges::find(folders, folder) == folders.end())
        folders.push_back(std::move(folder));
  return folders;
}

/// A file that ships in one of these folders: the first that is there.
inline std::optional<std::filesystem::path> find_shipped(const char* name) {
  for (const std::filesystem::path& folder : weights_folders()) {
    std::error_code code;
    if (std::filesystem::path file = folder / name; std::filesystem::is_regular_file(file, code)) return file;
  }
  return std::nullopt;
}

/// The shipped weights of people for a feature ("per-vertex" or "pooled").
/// can_be_random: whether the program that asks has an option --random-weights, beside --weights
/// Errors    npt::Error that names every folder that was looked in
inline std::filesystem::path shipped_weights(const std::string& feature, bool can_be_random = false) {
  const char* name = feature == "pooled" ? "human-pooled.safetensors" : "human.safetensors";
  if (const auto file = find_shipped(name)) return *file;
  std::string looked;
  for (const std::filesystem::path& folder : weights_folders())
    looked += (looked.empty() ? "" : ", ") + folder.string();
  throw npt::Error({.file = name,
                    .found = "no such file in " + (looked.empty() ? "any folder that is known" : looked),
                    .expected = std::string("the weights that npt ships; NPT_WEIGHTS names their folder, --weights "
                                            "other ones") +
                                (can_be_random ? ", --random-weights draws some for tests" : ""),
                    .code = npt::ErrorCode::missing_weights});
}

}  // namespace program
