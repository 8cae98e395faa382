/// Any bytes to the BVH reader give a valid motion or an npt::Error; a file written and read again is the same one.
#include <npt/io/bvh.hpp>

#include <fuzz/seeds.hpp>

namespace {

const std::string everything =
    "HIERARCHY\r\nROOT a b\r\n{\r\nOFFSET 0 -1.5 2e-3\r\nCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation "
    "Xrotation\r\nJOINT c {\r\nOFFSET 1 2 3\r\nCHANNELS 2 Xrotation Zposition\r\nEnd Site\r\n{\r\nOFFSET 0 1 "
    "0\r\n}\r\n}"
    "\r\nJOINT\r\n{\r\nOFFSET 0 0 0\r\n}\r\n}\r\nMOTION\r\nFrames: 2\r\nFrame Time: 0.008333\r\n1 2 3 4 5 6 7 8\r\n"
    "-1 -2 -3 -4 90 6 7 1e-9\r\n";

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fuzz::write_seeds_if_asked(*argc, *argv, {everything});
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  npt::Bvh bvh;
  try {
    bvh = npt::parse_bvh({reinterpret_cast<const char*>(data), size}, "input");
  } catch (const npt::Error&) {
    return 0;
  }
  fuzz::expect(npt::parse_bvh(npt::format_bvh(bvh), "copy") == bvh, "the motion survives writing");
  const npt::Motion motion = npt::motion_of(bvh, "input");
  for (const npt::Affine& world : npt::joint_worlds(motion, 0.5 * motion.clip.length()))
    fuzz::expect(npt::is_finite(world.shift), "joints have places");
  return 0;
}
