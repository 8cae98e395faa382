#include <formats/read.hpp>
#include <host/host.hpp>

#include <npt/base/error.hpp>

namespace formats {

void try_foreign(const std::filesystem::path& path) {
  const host::Apart apart = host::run_apart(
      [&]() -> std::vector<double> {
        try {
          read_foreign(path);
        } catch (const npt::Error&) {  // which this process finds, too
        }
        return {};
      },
      {.seconds = 60, .gigabytes = 4});
  if (!apart.failure.empty())
    throw npt::Error({path.string(),
                      {},
                      "what assimp doesn't survive (" + apart.failure + ")",
                      "a whole " + path.extension().string() + " file: export it anew, or as GLB"});
}

}  // namespace formats
