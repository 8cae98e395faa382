/// Where the weights that come with the project lie: beside an installed program (../share/npt/weights), or in the
/// source tree that the program was built in (examples/weights).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

namespace program {

/// The shipped weights for a feature ("per-vertex" or "pooled"), or nothing.
inline std::optional<std::filesystem::path> shipped_weights(const std::string& feature) {
  const char* name = feature == "pooled" ? "human-pooled.safetensors" : "human.safetensors";
  std::error_code code;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", code);
  if (code) return {};
  const std::filesystem::path folder = program.parent_path();
  for (const char* place : {"../share/npt/weights", "../../../examples/weights", "../../examples/weights"})
    if (const std::filesystem::path file = folder / place / name; std::filesystem::is_regular_file(file, code))
      return file.lexically_normal();
  return {};
}

}  // namespace program
