/// Any bytes to the OBJ reader give a valid mesh or an npt::Error; a mesh written and read again is the same one.
#define TINYOBJLOADER_IMPLEMENTATION  // instrumented too: the installed library is not
#include <npt/io/obj.hpp>

#include <fuzz/seeds.hpp>
#include <mesh/zoo.hpp>

#include <cstring>

namespace {

const std::string everything =
    "# all of it\r\nmtllib a.mtl\no thing\nv 0 0 0 0.5 0.5 1\nv 1 0 0\nv 1 1 0\nv 0 1 0 1\nvt 0 0\nvt 1\nvt 1 1 0\n"
    "vn 0 0 1\nvp 1\ng a b\nusemtl m\ns off\nf 1/1/1 2/2/1 3//1 4\nf -1 -2 -3\nl 1 2\np -1\nf 1 2 \\\n 3 # end";

bool same(const npt::Mesh& a, const npt::Mesh& b) {
  return a.positions.size() == b.positions.size() &&
         std::memcmp(a.positions.data(), b.positions.data(), a.positions.size() * sizeof(npt::Vec3f)) == 0 &&
         a.face_start == b.face_start && a.corners == b.corners && a.corner_normal == b.corner_normal &&
         a.corner_texcoord == b.corner_texcoord && a.tags.size() == b.tags.size();
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fuzz::write_seeds_if_asked(*argc, *argv,
                             {everything, npt::format_obj(zoo::hard_cube(), ""), npt::format_obj(zoo::mixed(), "")});
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  npt::Mesh mesh;
  try {
    mesh = npt::parse_obj({reinterpret_cast<const char*>(data), size}, "input");
  } catch (const npt::Error&) {
    return 0;
  }
  fuzz::expect(same(npt::parse_obj(npt::format_obj(mesh, "copy"), "copy"), mesh), "the mesh survives writing");
  return 0;
}
