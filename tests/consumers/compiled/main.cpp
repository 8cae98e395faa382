/// What a project with npt::compiled builds: the umbrella and mesh files; a network that the library holds, with random
/// weights, poses one cloud of points like another, through a file.
#include <npt/io/mesh_file.hpp>
#include <npt/npt.hpp>

#include <cmath>
#include <cstdio>

#ifndef NPT_COMPILED
#error "npt::compiled doesn't say so"
#endif

int main() {
  npt::Mesh identity, pose;
  for (int i = 0; i < 100; ++i) {
    const auto t = static_cast<float>(i);
    identity.positions.push_back({std::sin(t), std::cos(t), t / 100});
    pose.positions.push_back({std::cos(t), t / 100, std::sin(t)});
  }
  npt::write_mesh("identity.obj", identity);
  const npt::DefaultExecutor executor(1);
  const auto transfer =
      npt::PoseTransfer::random(npt::network_type<npt::PoseTransferNet<64>, npt::DefaultExecutor>(), 1, {}, executor);
  const npt::Mesh posed = transfer(npt::read_mesh("identity.obj"), pose);
  for (const float x : posed.coordinates())
    if (!std::isfinite(x)) return 1;
  std::printf("%s, %s, %zu vertices\n", transfer.description().c_str(), npt::compiled_isa(), posed.vertex_count());
  return posed.vertex_count() == 100 ? 0 : 1;
}
