/// What tests/platforms.sh compiles for each platform, with one command: the library's umbrella and readers in one
/// unit.
///   transfer WEIGHTS IDENTITY POSE OUT     a transfer by the network of 256 channels
#include <npt/base/thread_executor.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/npt.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace {

using Networks = npt::NetworkList<npt::PoseTransferNet<256>>;
using Transfer = npt::BasicPoseTransfer<npt::ThreadExecutor>;

int run(const std::vector<std::string>& words) {
  if (words.size() != 4) {
    std::fprintf(stderr, "usage: transfer WEIGHTS IDENTITY POSE OUT\n");
    return 2;
  }
  npt::TransferOptions options;
  options.method = npt::Method::network;
  const auto transfer = Transfer::open<Networks>(words[0], options);
  const npt::Mesh identity = npt::read_mesh(words[1]), pose = npt::read_mesh(words[2]);
  npt::Mesh posed = transfer(identity, pose);
  const auto start = std::chrono::steady_clock::now();
  posed = transfer(identity, pose);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
  npt::write_mesh(words[3], posed);
  std::printf("%s, %s: %zu vertices in %.1f ms\n", npt::compiled_isa(),
              NPT_HAS_XSIMD != 0 ? "xsimd" : "portable registers", posed.vertex_count(), time.count());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "transfer: %s\n", error.what());
    return 1;
  }
}
