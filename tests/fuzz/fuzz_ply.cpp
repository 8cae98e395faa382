/// Any bytes to the PLY reader give a valid mesh or an npt::Error; a mesh written in a format and read again is the
/// same one.
#include <npt/io/ply.hpp>

#include <fuzz/seeds.hpp>
#include <mesh/zoo.hpp>

#include <cstring>

namespace {

constexpr npt::PlyFormat formats[] = {npt::PlyFormat::ascii, npt::PlyFormat::binary_little_endian,
                                      npt::PlyFormat::binary_big_endian};

bool same(const npt::Mesh& a, const npt::Mesh& b) {
  return a.positions.size() == b.positions.size() &&
         std::memcmp(a.positions.data(), b.positions.data(), a.positions.size() * sizeof(npt::Vec3f)) == 0 &&
         a.face_start == b.face_start && a.corners == b.corners && a.normals == b.normals &&
         a.corner_texcoord == b.corner_texcoord && a.properties.size() == b.properties.size();
}

std::vector<std::string> seeds() {
  npt::Mesh rich = zoo::mixed();
  rich.normals.assign(9, {0, 0, 1});
  rich.tags = {{0, "comment", "c"}};
  for (const char* type : {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"})
    rich.properties.push_back({type, type, {1, 2, 3, 4, 5, 6, 7, 8, 9}});
  std::vector<std::string> result;
  for (const npt::PlyFormat format : formats)
    for (const npt::Mesh& mesh : {rich, zoo::hard_cube(), zoo::cloud()})
      result.push_back(npt::format_ply(mesh, "", format));
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fuzz::write_seeds_if_asked(*argc, *argv, seeds());
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  npt::Mesh mesh;
  try {
    mesh = npt::parse_ply({reinterpret_cast<const char*>(data), size}, "input");
  } catch (const npt::Error&) {
    return 0;
  }
  for (const npt::PlyFormat format : formats)
    fuzz::expect(same(npt::parse_ply(npt::format_ply(mesh, "copy", format), "copy"), mesh),
                 "the mesh survives writing");
  return 0;
}
