#include <formats/read.hpp>

#include <npt/base/error.hpp>

namespace formats {

bool reads_foreign() { return false; }

void try_foreign(const std::filesystem::path&) {}

npt::Scene read_foreign(const std::filesystem::path& path, std::vector<std::string>*, std::vector<std::string>*) {
  throw npt::Error({path.string(),
                    {},
                    "extension " + path.extension().string(),
                    "an npt that was built with assimp (Debian: libassimp-dev), or .ply, .obj or .glb"});
}

}  // namespace formats
