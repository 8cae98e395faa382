/// Errors of motions on other skeletons: a clip of one file on the joints of another.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace program {

/// Prints a line for each clip of `source`, or the one that is named: errors where `target` has a clip of that name,
/// and slide, depth and penetration; plain: without corrections of feet and arms.
void evaluate_motions(const std::filesystem::path& source, const std::filesystem::path& target,
                      const std::optional<std::string>& clip, bool plain, bool json);

}  // namespace program
