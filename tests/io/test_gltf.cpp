/// glTF in and out: what is read, what is written, and every kind of damage.
#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <io/small_gltf.hpp>
#include <mesh/zoo.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_appearance.hpp>
#include <npt/io/gltf_clip_reader.hpp>
#include <npt/io/gltf_document.hpp>
#include <npt/io/gltf_mesh_reader.hpp>
#include <npt/io/gltf_reader.hpp>
#include <npt/io/gltf_uri.hpp>
#include <npt/io/gltf_writer.hpp>
#include <npt/io/json_tree.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/pose.hpp>

#include <algorithm>
#include <limits>

using scratch::error_of;
using small_gltf::changed;
using small_gltf::floats;
using small_gltf::with_bytes;

namespace {

npt::Mesh mesh_of(const std::string& file) {
  const npt::Scene scene = npt::parse_gltf(file, "x.glb");
  return npt::ScenePoser(scene, "x.glb").mesh();
}
std::string error_in(const std::string& file) {
  return error_of([&] { mesh_of(file); });
}

struct BadCase {
  const char *from, *to, *message;
};

}  // namespace

TEST_CASE("a GLB with everything is read as it is meant") {
  const npt::Scene scene = npt::parse_gltf(small_gltf::file(), "x.glb");
  CHECK(scene.nodes.size() == 3);
  CHECK(scene.nodes[2].parent == 1);
  CHECK(scene.skins.at(0).joints == std::vector<std::size_t>{1, 2});
  REQUIRE(scene.clips.size() == 2);
  CHECK(scene.clips[0].length() == 1);
  REQUIRE(scene.appearance != nullptr);
  CHECK(scene.appearance->materials.at(0).label == "skin");
  CHECK(scene.appearance->materials[0].json ==
        R"({"name":"skin","pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"extras":{"a":1.50}})");
  CHECK(scene.appearance->images.at(0).bytes == "\x89PNG");

  const npt::ScenePoser poser(scene);
  npt::Mesh mesh = poser.mesh();
  CHECK(mesh.positions == std::vector<npt::Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  CHECK(mesh.corners == std::vector<std::uint32_t>{0, 1, 2});
  CHECK(mesh.tags.at(0).value == "part");
  CHECK(mesh.tags.at(1).value == "skin");
  // At its end: the target is fully in (z = 1), the root 2 along x, the tip half a turn about z.
  poser.positions(&npt::find_clip(scene, "Wave", "x.glb"), 1, mesh.coordinates());
  const std::vector<npt::Vec3f> expected{{2, 0, 1}, {2, 0, 1}, {2, -1, 1}};
  for (std::size_t v = 0; v < 3; ++v) CHECK(length(mesh.positions[v] - expected[v]) < 1e-6F);
}

TEST_CASE("what is written reads back equal") {
  const npt::Scene scene = npt::parse_gltf(small_gltf::file(), "x.glb");
  const std::string written = npt::format_gltf(scene, "y.glb");
  const npt::Scene again = npt::parse_gltf(written, "y.glb");
  CHECK(npt::format_gltf(again, "y.glb") == written);
  const npt::VertexBlock &a = scene.meshes[0].blocks[0], &b = again.meshes[0].blocks[0];
  CHECK(a.positions == b.positions);
  CHECK(a.joints == b.joints);
  CHECK(a.weights == b.weights);
  CHECK(a.targets[0].positions == b.targets[0].positions);
  CHECK(scene.meshes[0].primitives[0].triangles == again.meshes[0].primitives[0].triangles);
  CHECK(again.appearance->images[0].bytes == "\x89PNG");
  CHECK(again.appearance->materials[0].json == scene.appearance->materials[0].json);
  CHECK(again.clips.size() == 1);  // one that moves nothing is none to glTF
  CHECK(again.clips[0].channels[1].interpolation == npt::Interpolation::step);
  CHECK(again.clips[0].channels[0].values == scene.clips[0].channels[0].values);
}

TEST_CASE("meshes go to GLB and back, whatever their kind") {
  const scratch::Folder folder;
  const npt::Mesh before = zoo::hard_cube();
  npt::write_mesh(folder / "a.glb", before);
  const npt::Mesh after = npt::read_mesh(folder / "a.glb");
  CHECK(after.corners.size() == 36);  // quads became triangles
  CHECK(after.vertex_count() == 24);  // a vertex for each corner that has its own normal
  npt::write_mesh(folder / "b.glb", after);
  const npt::Mesh again = npt::read_mesh(folder / "b.glb");
  CHECK(again.positions == after.positions);
  CHECK(again.corners == after.corners);
  CHECK(again.texcoords == after.texcoords);
  CHECK(again.normals == after.normals);

  // In OBJ and PLY texture coordinates count from the bottom.
  npt::write_mesh(folder / "c.obj", after);
  const npt::Mesh as_obj = npt::read_mesh(folder / "c.obj");
  for (std::size_t c = 0; c < 6; ++c)
    CHECK(as_obj.texcoords[as_obj.corner_texcoord[c]].y ==
          doctest::Approx(1 - after.texcoords[after.corner_texcoord[c]].y));

  npt::write_mesh(folder / "p.glb", zoo::cloud());
  CHECK(npt::read_mesh(folder / "p.glb").positions == zoo::cloud().positions);
  CHECK(npt::read_mesh(folder / "p.glb").face_count() == 0);
  CHECK(error_of([&] { npt::write_mesh(folder / "a.gltf", before); }).find("expected .glb") != std::string::npos);
}

TEST_CASE("a .gltf reads its files and data URIs, and nothing outside of its folder") {
  const scratch::Folder folder;
  std::filesystem::create_directory(folder / "in");
  npt::write_file(folder / "in/some data.bin", small_gltf::bytes());
  npt::write_file(folder / "secret.bin", small_gltf::bytes());
  const auto with_uri = [&](const std::string& uri) {
    std::string text = small_gltf::json();
    text.replace(text.find(R"("buffers":[{)"), 12, R"("buffers":[{"uri":")" + uri + "\",");
    npt::write_file(folder / "in/a.gltf", text);
    return error_of([&] { npt::read_mesh(folder / "in/a.gltf"); });
  };
  CHECK(with_uri("some%20data.bin") == "no error");
  CHECK(with_uri("./../in/some data.bin") == "no error");
  for (const char* uri : {"../secret.bin", "%2e%2e/secret.bin", "/etc/hostname", "file:///etc/hostname",
                          "http://example.org/x.bin", "..\\\\secret.bin", "x/../../secret.bin", "", "%zz", "a%00b"})
    CHECK_MESSAGE(with_uri(uri).find("buffers[0].uri: found the URI") != std::string::npos, uri);
  std::error_code refused;  // Windows asks for a privilege
  std::filesystem::create_symlink(folder / "secret.bin", folder / "in/link.bin", refused);
  if (!refused) CHECK(with_uri("link.bin").find("expected a file in the document's folder") != std::string::npos);
  CHECK(with_uri("none.bin").find("no such file") != std::string::npos);
  CHECK(with_uri("data:application/octet-stream;base64,AAAA").find("byteLength 344") != std::string::npos);
  CHECK(with_uri("data:;base64,A*AA").find("can't be decoded") != std::string::npos);
  CHECK(with_uri("data:").find("without ','") != std::string::npos);
  // From memory there is no folder.
  std::string text = small_gltf::json();
  text.replace(text.find(R"("buffers":[{)"), 12, R"("buffers":[{"uri":"some data.bin",)");
  CHECK(error_in(text).find("came without a folder") != std::string::npos);
  CHECK(error_of([&] { npt::scene_of_bytes(text, "x.gltf"); }).find("came without a folder") != std::string::npos);
  npt::write_file(folder / "a.glb", small_gltf::file());
  CHECK(npt::scene_of_bytes(small_gltf::file(), "a.glb").nodes.size() ==
        npt::read_scene(folder / "a.glb").nodes.size());
  CHECK(npt::internal::from_base64("aGk=").value() == "hi");
  CHECK(npt::internal::from_base64("aGk").value() == "hi");
  CHECK_FALSE(npt::internal::from_base64("aGkAA"));
}

TEST_CASE("the container: every truncation and every wrong length is an error") {
  const std::string file = small_gltf::file();
  for (std::size_t size = 4; size < file.size(); ++size) {
    INFO(size);
    CHECK(error_in(file.substr(0, size)).starts_with("x.glb: "));
  }
  const auto with_word = [&](std::size_t at, std::uint32_t value) {
    std::string word, other = file;
    npt::internal::append_little_u32(word, value);
    return error_in(other.replace(at, 4, word));
  };
  CHECK(with_word(4, 1).find("version 1, expected glTF 2") != std::string::npos);
  for (const std::uint32_t length : {0U, 19U, 0xFFFFFFFFU})
    CHECK(with_word(8, length).find("a length of") != std::string::npos);
  for (const std::uint32_t length : {0xFFFFFFFFU, 0xFFFFFFF8U, 0x7FFFFFFFU})
    CHECK(with_word(12, length).find("a chunk of") != std::string::npos);
  CHECK(with_word(12, 0) != "no error");
  CHECK(with_word(16, 0x004E4942).find("another chunk") != std::string::npos);
  CHECK(error_in("glTF") != "no error");
  CHECK(error_in("no glTF at all").find("found no JSON") != std::string::npos);
  CHECK(error_in(npt::internal::format_glb(R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4}]})", "", "x"))
            .find("no uri") != std::string::npos);
}

TEST_CASE("JSON: as deep, as large and as unique as a document may be") {
  CHECK(error_in(std::string(100000, '[')).find("more than 64 levels") != std::string::npos);
  CHECK(error_in(R"({"asset":{"version":"2.0"},"asset":{"version":"2.0"}})").find("\"asset\" twice") !=
        std::string::npos);
  CHECK(error_in("[]").find("no object") != std::string::npos);
  CHECK(error_in("{}").find("no asset") != std::string::npos);
  CHECK(error_in(R"({"asset":{"version":"1.0"}})").find("'1.0'") != std::string::npos);
  CHECK(error_in(R"({"asset":{"version":"2.0"}})") == "x.glb: found a scene that shows no mesh, expected vertices");
  CHECK(error_in(R"({"asset":{"version":"2.0"},"nodes":{}})")
            .find("nodes: found another kind of value, expected a list") != std::string::npos);
  const std::string text = R"({"a":[1,2.50,-3e2],"b":{"c":"x\"\u00e9"},"d":[true,false,null]})";
  std::string again;
  npt::internal::append_json(again, npt::internal::read_json_tree(text, "x"));
  CHECK(again == "{\"a\":[1,2.50,-3e2],\"b\":{\"c\":\"x\\\"\xC3\xA9\"},\"d\":[true,false,null]}");
}

TEST_CASE("each broken number and reference is an error that names its place") {
  const BadCase cases[] = {
      {R"("buffers":[{"byteLength":344})", R"("buffers":[{"byteLength":345})", "buffers[0]: found byteLength 345"},
      {R"("buffers":[{"byteLength":344})", R"("buffers":[{"byteLength":-1})", "buffers[0].byteLength: found '-1'"},
      {R"("byteOffset":340,"byteLength":4)", R"("byteOffset":341,"byteLength":4)", "bufferViews[9]: found bytes 341"},
      {R"("byteOffset":340,"byteLength":4)", R"("byteOffset":18446744073709551612,"byteLength":8)", "bufferViews[9]"},
      {R"("byteOffset":340,"byteLength":4)", R"("byteOffset":340,"byteLength":4,"byteStride":3)", "byteStride 3"},
      {R"({"buffer":0,"byteLength":36})", R"({"buffer":1,"byteLength":36})", "bufferViews[0].buffer: found 1"},
      {R"("count":3,"type":"VEC3"},{"bufferView":1)", R"("count":4,"type":"VEC3"},{"bufferView":1)",
       "accessors[0]: found 4 elements, 12 bytes apart"},
      {R"("count":3,"type":"VEC3"},{"bufferView":1)", R"("count":1431655766,"type":"VEC3"},{"bufferView":1)",
       "accessors[0]: found 1431655766 elements"},
      {R"("count":3,"type":"VEC3"},{"bufferView":1)", R"("count":18446744073709551615,"type":"VEC3"},{"bufferView":1)",
       "accessors[0]: found count"},
      {R"("count":3,"type":"VEC3"},{"bufferView":1)", R"("count":0,"type":"VEC3"},{"bufferView":1)", "found count 0"},
      {R"({"bufferView":0,"componentType":5126)", R"({"bufferView":0,"byteOffset":4,"componentType":5126)",
       "accessors[0]: found 3 elements"},
      {R"({"bufferView":0,"componentType":5126)", R"({"componentType":5126)", "no error"},  // zeros
      {R"({"bufferView":0,"componentType":5126,"count":3)", R"({"componentType":5126,"count":4000000000)",
       "more numbers than a file of this size"},
      {R"({"bufferView":0,"componentType":5126)", R"({"bufferView":0,"componentType":5124)", "componentType 5124"},
      {R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3")",
       R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC2")", "type 'VEC2' for POSITION, expected VEC3"},
      {R"({"bufferView":4,"componentType":5123)", R"({"bufferView":4,"componentType":5122)", "5122 for indices"},
      {R"("POSITION":0,)", "", "no POSITION"},
      {R"("POSITION":0,)", R"("POSITION":99,)", "attributes.POSITION: found 99, expected one of 10 accessors"},
      {R"(,"WEIGHTS_0":2)", "", "JOINTS_0 without WEIGHTS_0"},
      {R"("targets":[{"POSITION":1}])", R"("targets":[{"POSITION":8}])", "targets[0].POSITION: found 2 elements"},
      {R"("weights":[0]}],)", R"("weights":[0,1]}],)", "weights[0]: found 2 numbers, expected 1"},
      {R"("indices":4,)", R"("indices":4,"mode":7,)", "mode 7"},
      {R"("material":0)", R"("material":1)", "material: found 1, expected one of 1 materials"},
      {R"("children":[2])", R"("children":[1])", "a node that is its own ancestor"},
      {R"("children":[2])", R"("children":[2,2])", "a child of two nodes"},
      {R"({"name":"tip"})", R"({"name":"tip","children":[1]})", "a node that is its own ancestor"},
      {R"({"name":"tip"})", R"({"name":"tip","children":[1.5]})", "children[0]: found '1.5', expected a whole number"},
      {R"({"name":"tip"})", R"({"name":"tip","rotation":[0,0,0,0]})", "a quaternion of length 0"},
      {R"({"name":"tip"})", R"({"name":"tip","translation":[0,0]})", "2 numbers, expected 3"},
      {R"({"name":"tip"})", R"({"name":"tip","matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]})", "a node with a matrix"},
      {R"({"name":"root")", R"({"name":"root","translation":[1e99,0,0])", "vertex 0: found inf"},
      {R"("joints":[1,2])", R"("joints":[1])", "joint 1 at vertex 1, expected one of the skin's 1 joints"},
      {R"("joints":[1,2])", R"("joints":[1,3])", "skins[0].joints[1]: found 3, expected one of 3 nodes"},
      {R"("joints":[1,2])", R"("joints":[])", "no joints"},
      {R"("joints":[1,2])", R"("joints":[1,2,2])", "2 inverse bind matrices"},
      {R"("scene":0)", R"("scene":1)", "scene: found 1, expected one of 1 scenes"},
      {R"("scenes":[{"nodes":[0,1]}])", R"("scenes":[{"nodes":[0,3]}])", "scenes[0].nodes[1]: found 3"},
      {R"({"node":2,"path":"rotation"})", R"({"node":3,"path":"rotation"})", "target.node: found 3"},
      {R"({"node":2,"path":"rotation"})", R"({"node":2,"path":"translation"})", "type 'VEC4' for translation"},
      {R"({"node":2,"path":"rotation"})", R"({"node":2,"path":"weights"})", "a node without morph targets"},
      {R"({"node":2,"path":"rotation"})", R"({"path":"pointer"})", "no error"},
      {R"({"input":6,"output":7})", R"({"input":6,"output":7,"interpolation":"CUBICSPLINE"})",
       "8 numbers for 2 keys, expected 24"},
      {R"({"input":6,"output":7})", R"({"input":6,"output":7,"interpolation":"SOFT"})", "'SOFT'"},
      {R"({"input":6,"output":7})", R"({"input":6})", "no output"},
      {R"("bufferView":9,"mimeType")", R"("bufferView":10,"mimeType")", "images[0].bufferView: found 10"},
      {R"("source":0)", R"("source":1)", "textures[0].source: found 1"},
      {R"("baseColorTexture":{"index":0})", R"("baseColorTexture":{"index":7})", "baseColorTexture.index: found 7"},
      {R"({"asset")", R"({"extensionsRequired":["ACME_shape"],"asset")", "found 'ACME_shape'"},
      {R"({"asset")", R"({"extensionsRequired":["KHR_mesh_quantization","KHR_materials_unlit"],"asset")", "no error"},
      {R"({"buffer":0,"byteLength":36})",
       R"({"buffer":0,"byteLength":36,"extensions":{"EXT_meshopt_compression":{"buffer":0}}})",
       "bufferViews[0].extensions.EXT_meshopt_compression: found no count"},
      {R"("source":0)", R"("source":0,"extensions":{"KHR_texture_basisu":{"source":1}})",
       "textures[0].extensions.KHR_texture_basisu.source: found 1"},
  };
  CHECK(error_in(small_gltf::file()) == "no error");
  for (const BadCase& bad : cases) {
    INFO(bad.from << " -> " << bad.to);
    const std::string message = error_in(changed(bad.from, bad.to));
    CHECK_MESSAGE(message.find(bad.message) != std::string::npos, message);
  }
}

TEST_CASE("broken numbers in buffers are errors, rounded weights are not") {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  CHECK(error_in(with_bytes(16, floats({nan}))).find("accessors[0]: found") != std::string::npos);
  CHECK(error_in(with_bytes(16, floats({nan}))).find("in element 1, expected finite numbers") != std::string::npos);
  CHECK(error_in(with_bytes(144, floats({inf}))).find("accessors[5]") != std::string::npos);
  CHECK(error_in(with_bytes(152, floats({1}))).find("expected 0 0 0 1") != std::string::npos);
  CHECK(error_in(with_bytes(72, floats({-1}))).find("weights that are not negative") != std::string::npos);
  CHECK(error_in(with_bytes(121, "\7")).find("no error") != std::string::npos);  // a joint without weight
  CHECK(error_in(with_bytes(125, "\7")).find("joint 7 at vertex 1") != std::string::npos);
  CHECK(error_in(with_bytes(132, "\3")).find("indices: found vertex 3 at 0, expected a vertex below 3") !=
        std::string::npos);
  CHECK(error_in(with_bytes(268, floats({1, 0}))).find("key 1 at 0.000000 s") != std::string::npos);
  CHECK(error_in(with_bytes(268, floats({-1, 0}))).find("key 0") != std::string::npos);
  CHECK(error_in(with_bytes(268, floats({0, 1e9F}))).find("expected four hours at most") != std::string::npos);
  // Weights that sum to 2, and none at all.
  const npt::Scene scene = npt::parse_gltf(with_bytes(72, floats({0, 0, 0, 0, 1, 1})), "x.glb");
  CHECK(scene.meshes[0].blocks[0].weights == std::vector<float>{1, 0, 0, 0, 0.5F, 0.5F, 0, 0, 0, 1, 0, 0});
}

TEST_CASE("an inverse bind matrix whose last row is zeros is taken for an affine map, with a note") {
  std::vector<std::string> notes;
  const npt::Scene whole = npt::parse_gltf(small_gltf::file(), "x.glb", {}, &notes);
  CHECK(notes.empty());
  const npt::Scene scene = npt::parse_gltf(with_bytes(200, floats({0})), "x.glb", {}, &notes);
  CHECK(scene.skins.at(0).inverse_binds == whole.skins.at(0).inverse_binds);
  CHECK(notes == std::vector<std::string>{"x.glb: skins[0].inverseBindMatrices, joint 0: the last row is 0 0 0 0, "
                                          "taken as 0 0 0 1"});
  CHECK(error_in(with_bytes(200, floats({2}))).find("expected 0 0 0 1") != std::string::npos);
}

TEST_CASE("KTX2 and WebP pictures ride along as bytes") {
  for (const auto& [extension, type] :
       {std::pair("KHR_texture_basisu", "image/ktx2"), std::pair("EXT_texture_webp", "image/webp")}) {
    std::string json = small_gltf::json();
    const auto replace = [&json](const std::string& from, const std::string& to) {
      json.replace(json.find(from), from.size(), to);
    };
    const std::string name = extension;
    replace(R"({"source":0})", R"({"extensions":{")" + name + R"(":{"source":0}}})");
    replace("image/png", type);
    replace(R"({"asset")", R"({"extensionsUsed":[")" + name + R"("],"extensionsRequired":[")" + name + R"("],"asset")");
    const std::string written = npt::format_gltf(npt::parse_gltf(small_gltf::file(json), "x.glb"), "y.glb");
    CHECK(written.find(R"("extensionsRequired":[")" + name + "\"]") != std::string::npos);
    const npt::Scene again = npt::parse_gltf(written, "y.glb");
    CHECK(again.appearance->images.at(0).mime_type == type);
    CHECK(again.appearance->images[0].bytes == "\x89PNG");
    CHECK(again.appearance->textures.at(0) == R"({"extensions":{")" + name + R"(":{"source":0}}})");
  }
}

TEST_CASE("attributes of somebody's own and further colours are kept, by scenes and by meshes") {
  const std::string file =
      changed(R"({"POSITION":0,)", R"({"POSITION":0,"_PAINT":1,"_AGE":9,"COLOR_1":2,"_WIDE":5,"UNKNOWN":1,)");
  CHECK(error_in(file) == "x.glb: meshes[0].primitives[0].attributes._AGE: found 2 elements, expected 3, as positions");
  const std::string good =
      changed(R"({"POSITION":0,)", R"({"POSITION":0,"_PAINT":1,"COLOR_1":2,"_WIDE":5,"UNKNOWN":1,)");
  const npt::Scene scene = npt::parse_gltf(good, "x.glb");
  const auto check = [](const std::vector<npt::VertexAttribute>& others) {
    REQUIRE(others.size() == 2);
    CHECK(others[0].name == "_PAINT");
    CHECK(others[0].values == std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1});
    CHECK(others[1].name == "COLOR_1");
    CHECK(others[1].width == 4);
  };
  check(scene.meshes[0].blocks[0].others);
  check(npt::parse_gltf(npt::format_gltf(scene, "y.glb"), "y.glb").meshes[0].blocks[0].others);
  const npt::Mesh mesh = mesh_of(good);
  CHECK(std::ranges::count(mesh.properties, "_PAINT.z", &npt::VertexProperty::name) == 1);
  check(npt::scene_from(mesh).scene.meshes[0].blocks[0].others);

  npt::Mesh own = zoo::hard_cube();
  own.properties = {
      {"_age", "float", std::vector<double>(own.vertex_count(), 1)},
      {"_bad", "double", std::vector<double>(own.vertex_count(), std::numeric_limits<double>::infinity())},
      {"quality", "float", std::vector<double>(own.vertex_count(), 2)}};
  const std::string written = npt::format_gltf(npt::scene_from(own).scene, "z.glb");
  const npt::Scene again = npt::parse_gltf(written, "z.glb");
  REQUIRE(again.meshes[0].blocks[0].others.size() == 2);
  CHECK(again.meshes[0].blocks[0].others[0].values.front() == 1);
  CHECK(again.meshes[0].blocks[0].others[1].values.front() == 0);
}

TEST_CASE("a second set of joints and weights belongs to the first") {
  // Weights 72: the first set's; the second set is the first one again, so that all of them become halves.
  const npt::Scene scene =
      npt::parse_gltf(changed(R"("WEIGHTS_0":2})", R"("WEIGHTS_0":2,"JOINTS_1":3,"WEIGHTS_1":2})"), "x.glb");
  const npt::VertexBlock& block = scene.meshes[0].blocks[0];
  CHECK(block.influences == 8);
  CHECK(std::vector<float>(block.weights.begin(), block.weights.begin() + 8) ==
        std::vector<float>{0.5F, 0, 0, 0, 0.5F, 0, 0, 0});
  CHECK(mesh_of(npt::format_gltf(scene, "y.glb")).positions == mesh_of(small_gltf::file()).positions);
  CHECK(error_in(changed(R"("WEIGHTS_0":2})", R"("WEIGHTS_0":2,"JOINTS_1":3})")).find("JOINTS_1 without WEIGHTS_1") !=
        std::string::npos);
}

TEST_CASE("names: doubled, empty and wild ones stay tags of one line") {
  const std::string file =
      changed(R"("materials":[{"name":"skin",)", R"("materials":[{"name":" a\nb "},{"name":"a_b"},{},{"name":"skin",)");
  const npt::Scene scene = npt::parse_gltf(file, "x.glb");
  CHECK(scene.appearance->materials[0].label == "a_b");
  CHECK(scene.appearance->materials[1].label == "a_b.1");
  CHECK(scene.appearance->materials[2].label == "material_2");
  CHECK(error_in(changed(R"("name":"part")", R"("name":"a\r\nb")")) == "no error");
}

TEST_CASE("clips that aren't there are told with those that are") {
  const npt::Scene scene = npt::parse_gltf(small_gltf::file(), "x.glb");
  CHECK(&npt::find_clip(scene, "Rest", "x.glb") == &scene.clips[1]);
  CHECK(&npt::find_clip(scene, "Wave", "x.glb") == &scene.clips[0]);
  CHECK(error_of([&] { npt::find_clip(scene, "Run", "x.glb"); }) ==
        "x.glb: found no clip 'Run', expected one of 'Armature|Wave', 'Rest'");
}

TEST_CASE("Draco: numbers that stand in the file a second time are taken, others need libdraco") {
  const std::string extension =
      R"("extensions":{"KHR_draco_mesh_compression":{"bufferView":9,"attributes":{"POSITION":0}}})";
  const auto with = [&](std::string text) {
    const std::string targets = R"("targets":[{"POSITION":1}])";
    text.replace(text.find(targets), targets.size(), extension);
    const std::string weights = R"(,{"sampler":2,"target":{"node":0,"path":"weights"}})";
    text.replace(text.find(weights), weights.size(), "");
    text.replace(text.find(R"(,"weights":[0])"), 14, "");
    return text;
  };
  std::string alone = with(small_gltf::json());
  alone.replace(alone.find(R"("bufferView":0,)"), 15, "");
  const std::string message = error_in(small_gltf::file(alone));
  if (npt::internal::with_draco) {
    CHECK_MESSAGE(message.find("a mesh that libdraco can read") != std::string::npos, message);
  } else {
    CHECK_MESSAGE(message.find("Debian: libdraco-dev") != std::string::npos, message);
    CHECK(error_in(small_gltf::file(with(small_gltf::json()))) == "no error");
  }
}

TEST_CASE("a VRM file's names of joints are read in both versions, and what isn't right about them is passed over") {
  const auto read = [](const std::string& extension) {
    return npt::parse_gltf(
        R"({"asset":{"version":"2.0"},"nodes":[{"name":"a"},{"name":"b"}],"extensions":{)" + extension + "}}", "a.vrm");
  };
  const npt::Scene one =
      read(R"("VRMC_vrm":{"humanoid":{"humanBones":{"hips":{"node":1},"head":{"node":7},"neck":3}}})");
  CHECK(one.nodes[1].bone == "hips");
  CHECK(one.nodes[0].bone.empty());
  const npt::Scene zero =
      read(R"("VRM":{"humanoid":{"humanBones":[{"bone":"spine","node":0},{"bone":"jaw","node":-1},4]}})");
  CHECK(zero.nodes[0].bone == "spine");
  CHECK(read(R"("VRM":[1])").nodes[0].bone.empty());
}
