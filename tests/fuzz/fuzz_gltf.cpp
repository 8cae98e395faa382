/// Any bytes to the glTF reader give a scene that can be posed and written, or an npt::Error; a scene written and read
/// again has the same vertices.
#include <npt/body/roles/joint_roles.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_patch.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/transfer/retarget.hpp>

#include <fuzz/seeds.hpp>
#include <io/small_gltf.hpp>
#include <mesh/zoo.hpp>

#ifdef NPT_WITH_DRACO
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#endif

#include <string>
#include <string_view>
#include <vector>

namespace {

#ifdef NPT_WITH_DRACO
/// Two triangles with normals, by one of Draco's methods.
std::string compressed(bool edgebreaker) {
  const float xyz[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, up[] = {0, 0, 1};
  const std::size_t corners[2][3] = {{0, 1, 2}, {2, 1, 3}};
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int normal = builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
  for (std::uint32_t f = 0; f < 2; ++f) {
    const auto& c = corners[f];
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(f), xyz[c[0]], xyz[c[1]], xyz[c[2]]);
    builder.SetAttributeValuesForFace(normal, draco::FaceIndex(f), up, up, up);
  }
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(edgebreaker ? draco::MESH_EDGEBREAKER_ENCODING : draco::MESH_SEQUENTIAL_ENCODING);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 11);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(*mesh, &buffer).ok()) return {};
  const std::string bytes(buffer.data(), buffer.size());
  return small_gltf::file(
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{)"
      R"("attributes":{"POSITION":0,"NORMAL":1},"indices":2,"extensions":{"KHR_draco_mesh_compression":{)"
      R"("bufferView":0,"attributes":{"POSITION":0,"NORMAL":1}}}}]}],)"
      R"("extensionsUsed":["KHR_draco_mesh_compression"],"extensionsRequired":["KHR_draco_mesh_compression"],)"
      R"("accessors":[{"componentType":5126,"count":4,"type":"VEC3"},{"componentType":5126,"count":4,"type":"VEC3"},)"
      R"({"componentType":5123,"count":6,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":)" +
          std::to_string(bytes.size()) + R"(}],"buffers":[{"byteLength":)" + std::to_string(bytes.size()) + "}]}",
      bytes);
}
#endif

std::vector<std::string> seeds() {
  std::vector<std::string> result{small_gltf::file(), small_gltf::json()};
  for (const npt::Mesh& mesh : {zoo::mixed(), zoo::hard_cube(), zoo::cloud()})
    result.push_back(npt::format_gltf(npt::scene_from(mesh).scene, "seed"));
  result.push_back(small_gltf::changed(
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3")",
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":3,)"
      R"("componentType":5121},"values":{"bufferView":1}})"));
  result.push_back(small_gltf::packed_file());
  result.push_back(small_gltf::changed(R"({"POSITION":0,)", R"({"POSITION":0,"_OWN":1,"COLOR_1":2,)"));
  result.push_back(
      small_gltf::changed(R"({"input":6,"output":7})", R"({"input":6,"output":7,"interpolation":"CUBICSPLINE"})"));
#ifdef NPT_WITH_DRACO
  for (const bool edgebreaker : {false, true}) result.push_back(compressed(edgebreaker));
#endif
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fuzz::write_seeds_if_asked(*argc, *argv, seeds());
  return 0;
}

/// A clip and a pose put into a file: what was read of it before is read of it again.
void patch(std::string_view file, const npt::Scene& scene, const npt::Motion& motion) {
  for (const bool apply : {false, true}) {
    std::string patched;
    try {
      patched = npt::with_motion(file, motion, {.name = "new", .apply = apply, .time = 0.3}, "input");
    } catch (const npt::Error&) {  // no curves, a matrix that shears, a value that isn't looked at elsewhere
      continue;
    }
    const npt::Scene again = npt::parse_gltf(patched, "copy");
    fuzz::expect(again.clips.size() == scene.clips.size() + (apply ? 0 : 1), "one clip more, or none");
    fuzz::expect(again.nodes.size() == scene.nodes.size() && again.meshes.size() == scene.meshes.size(), "the same");
  }
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
    if (npt::has_skeleton(scene)) {
      const npt::Motion motion = npt::motion_of(scene, scene.clips.empty() ? nullptr : &scene.clips[0], "input");
      const npt::JointRoles roles = npt::joint_roles(motion);
      npt::retarget(motion, roles, motion, roles);
      patch({reinterpret_cast<const char*>(data), size}, scene, motion);
    }
    const std::string written = npt::format_gltf(scene, "copy");
    const npt::Scene again = npt::parse_gltf(written, "copy");
    fuzz::expect(npt::ScenePoser(again, "copy").vertex_count() == mesh.vertex_count(), "all vertices survive writing");
    npt::format_gltf(npt::scene_from(mesh).scene, "mesh");
  } catch (const npt::Error& error) {
    fuzz::expect(!std::string_view(error.what()).starts_with("copy"), error.what());
  }
  return 0;
}
