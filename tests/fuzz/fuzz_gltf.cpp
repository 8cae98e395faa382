/// Any bytes to the glTF reader give a scene that can be posed and written, or an npt::Error; a scene written and read
/// again has the same vertices.
#include <npt/io/gltf.hpp>

#include <fuzz/seeds.hpp>
#include <io/small_gltf.hpp>
#include <mesh/zoo.hpp>

#include <string>
#include <vector>

namespace {

std::vector<std::string> seeds() {
  std::vector<std::string> result{small_gltf::file(), small_gltf::json()};
  for (const npt::Mesh& mesh : {zoo::mixed(), zoo::hard_cube(), zoo::cloud()})
    result.push_back(npt::format_gltf(npt::scene_from(mesh).scene, "seed"));
  result.push_back(small_gltf::changed(
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3")",
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":3,)"
      R"("componentType":5121},"values":{"bufferView":1}})"));
  result.push_back(
      small_gltf::changed(R"({"input":6,"output":7})", R"({"input":6,"output":7,"interpolation":"CUBICSPLINE"})"));
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fuzz::write_seeds_if_asked(*argc, *argv, seeds());
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    const npt::Scene scene = npt::parse_gltf({reinterpret_cast<const char*>(data), size}, "input");
    const npt::ScenePoser poser(scene, "input");
    npt::Mesh mesh = poser.mesh();
    for (const npt::Clip& clip : scene.clips) {
      std::vector<float> xyz(3 * mesh.vertex_count());
      try {
        poser.positions(&clip, 0.4 * clip.length(), xyz);
      } catch (const npt::Error&) {  // moved out of the floats' range
      }
    }
    const std::string written = npt::format_gltf(scene, "copy");
    const npt::Scene again = npt::parse_gltf(written, "copy");
    fuzz::expect(npt::ScenePoser(again, "copy").vertex_count() == mesh.vertex_count(), "all vertices survive writing");
    npt::format_gltf(npt::scene_from(mesh).scene, "mesh");
  } catch (const npt::Error& error) {
    fuzz::expect(std::string_view(error.what()).find("copy") == std::string_view::npos, error.what());
  }
  return 0;
}
