/// What tests/platforms.sh holds results against each other with, on this machine:
///   compare A B     the largest distance of two meshes' vertices, as a share of A's size; status 1 above 1e-5
#include <npt/io/mesh_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>

namespace {

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

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 3) return compare(npt::read_mesh(argv[1]), npt::read_mesh(argv[2]));
    std::fprintf(stderr, "usage: compare A B\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "compare: %s\n", error.what());
    return 1;
  }
}
