/// What tests/platforms.sh compiles for each platform, with one command: the library's umbrella and readers in one
/// unit.
///   transfer WEIGHTS IDENTITY POSE OUT     a transfer by the network of 256 channels
///   transfer compare A B                   the largest distance of two meshes' vertices, as a share of A's size; status
///                                          1 above 1e-5
#include <npt/base/thread_executor.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/npt.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace {

using Networks = npt::NetworkList<npt::PoseTransferNet<256>>;
using Transfer = npt::BasicPoseTransfer<npt::ThreadExecutor>;

int compare(const npt::Mesh& a, const npt::Mesh& b) {
  if (a.vertex_count() != b.vertex_count()) {
    std::printf("%zu and %zu vertices\n", a.vertex_count(), b.vertex_count());
    return 1;
  }
  float size = 0, distance = 0;
  for (std::size_t v = 0; v < a.positions.size(); ++v) {
    const npt::Vec3f p = a.positions[v], q = b.positions[v];
    size = std::max(size, std::abs(p.y - a.positions[0].y));
    for (const float d : {p.x - q.x, p.y - q.y, p.z - q.z})
      distance = !(std::abs(d) <= distance) ? std::abs(d) : distance;  // NaN stays
  }
  const float share = distance / size;
  std::printf("largest difference %.2g of the mesh's height\n", static_cast<double>(share));
  return share <= 1e-5F ? 0 : 1;
}

int run(const std::vector<std::string>& words) {
  if (words.size() == 3 && words[0] == "compare") return compare(npt::read_mesh(words[1]), npt::read_mesh(words[2]));
  if (words.size() != 4) {
    std::fprintf(stderr, "usage: transfer WEIGHTS IDENTITY POSE OUT, or transfer compare A B\n");
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
