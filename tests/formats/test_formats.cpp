/// Files of the formats that assimp reads, made here.
#include <formats/read.hpp>

#include <doctest/doctest.h>

#include <npt/io/gltf.hpp>
#include <npt/io/gltf_reader.hpp>
#include <npt/scene/clip_of_motion.hpp>
#include <npt/scene/joined_nodes.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>

#include <io/scratch.hpp>
#include <support/needs.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace {

const support::Needs assimp{formats::reads_foreign(), "assimp (libassimp-dev)"};
const support::Needs assimp_and_knight{
    formats::reads_foreign() && std::filesystem::exists(NPT_SHARED "/data/glb/Knight.glb"),
    "assimp (libassimp-dev) and ../shared/data/glb"};

const support::Needs assimp_and_characters{
    formats::reads_foreign() && std::filesystem::exists(NPT_SHARED "/data/characters/humanoids"),
    "assimp (libassimp-dev) and ../shared/data/characters"};

std::string stl_text() {
  std::string text = "solid square\n";
  for (const char* corners :
       {"vertex 0 0 0\nvertex 2 0 0\nvertex 2 3 0\n", "vertex 0 0 0\nvertex 2 3 0\nvertex 0 3 0\n"})
    text += std::string("facet normal 0 0 1\nouter loop\n") + corners + "endloop\nendfacet\n";
  return text + "endsolid square\n";
}

std::string stl_bytes() {
  std::string bytes(80, ' ');
  const auto append = [&bytes](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(std::uint32_t{2});
  for (const auto& corners :
       {std::vector<float>{0, 0, 0, 2, 0, 0, 2, 3, 0}, std::vector<float>{0, 0, 0, 2, 3, 0, 0, 3, 0}}) {
    for (const float x : {0.0F, 0.0F, 1.0F}) append(x);
    for (const float x : corners) append(x);
    append(std::uint16_t{0});
  }
  return bytes;
}

const char* const off_text = "OFF\n# a square\n4 1 0\n0 0 0\n2 0 0\n2 3 0\n0 3 0\n4 0 1 2 3\n";

/// A tetrahedron of which z points up in the file, in a unit of so many centimetres; or another mesh.
std::string fbx_text(const std::string& centimetres, const std::string& vertices = "0,0,0,100,0,0,0,-100,0,0,0,180",
                     const std::string& corners = "0,1,-4,1,2,-4,2,0,-4,0,2,-2") {
  const auto numbers = [](const std::string& list) {
    return "*" + std::to_string(std::ranges::count(list, ',') + 1) + " {\n      a: " + list + "\n    }\n";
  };
  const auto axis = [](const char* name, int value) {
    return std::string("    P: \"") + name + "\", \"int\", \"Integer\", \"\"," + std::to_string(value) + "\n";
  };
  return "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n  FBXHeaderVersion: 1003\n  FBXVersion: 7400\n}\n"
         "GlobalSettings:  {\n  Version: 1000\n  Properties70:  {\n" +
         axis("UpAxis", 2) + axis("UpAxisSign", 1) + axis("FrontAxis", 1) + axis("FrontAxisSign", -1) +
         axis("CoordAxis", 0) + axis("CoordAxisSign", 1) + "    P: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," +
         centimetres + "\n  }\n}\n" +
         R"(Objects:  {
  Geometry: 1000, "Geometry::tetra", "Mesh" {
    Vertices: )" +
         numbers(vertices) + "    PolygonVertexIndex: " + numbers(corners) + R"(    GeometryVersion: 124
    LayerElementMaterial: 0 {
      Version: 101
      Name: ""
      MappingInformationType: "AllSame"
      ReferenceInformationType: "IndexToDirect"
      Materials: *1 {
        a: 0
      }
    }
    Layer: 0 {
      Version: 100
      LayerElement:  {
        Type: "LayerElementMaterial"
        TypedIndex: 0
      }
    }
  }
  Model: 2000, "Model::tetra", "Mesh" {
    Version: 232
  }
  Material: 3000, "Material::skin", "" {
    Version: 102
    ShadingModel: "phong"
    Properties70:  {
      P: "DiffuseColor", "Color", "", "A",0.5,0.25,1
    }
  }
}
Connections:  {
  C: "OO",2000,0
  C: "OO",1000,2000
  C: "OO",3000,2000
}
)";
}

/// fbx_text() with a joint, named as the mesh is, that moves vertices 0 and 1; the mesh stands in the file twice.
std::string skinned_fbx_text() {
  std::string text = fbx_text("1");
  const std::string matrix = " *16 {\n      a: 1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n    }\n";
  text.insert(text.find("}\nConnections"), R"(  Model: 2001, "Model::copy", "Mesh" {
    Version: 232
  }
  Model: 6000, "Model::tetra", "LimbNode" {
    Version: 232
  }
  Deformer: 5000, "Deformer::skin", "Skin" {
    Version: 101
    Link_DeformAcuracy: 50
  }
  Deformer: 7000, "SubDeformer::tetra", "Cluster" {
    Version: 100
    UserData: "", ""
    Indexes: *2 {
      a: 0,1
    }
    Weights: *2 {
      a: 1,0.5
    }
    Transform:)" + matrix +
                                               "    TransformLink:" + matrix + "  }\n");
  const std::string joined =
      "  C: \"OO\",2001,0\n  C: \"OO\",1000,2001\n  C: \"OO\",3000,2001\n  C: \"OO\",6000,0\n"
      "  C: \"OO\",5000,1000\n  C: \"OO\",7000,5000\n  C: \"OO\",6000,7000\n";
  return text.insert(text.rfind('}'), joined);
}

/// A triangle in centimetres, z up, whose vertex 2 is the second joint's; a clip turns that joint about x by 90
/// degrees in half a second.
std::string dae_text() {
  const auto source = [](const std::string& id, int count, int stride, const std::string& numbers,
                         const std::string& params, const std::string& array = "float_array") {
    return "<source id=\"" + id + "\"><" + array + " id=\"" + id + "-a\" count=\"" + std::to_string(count * stride) +
           "\">" + numbers + "</" + array + "><technique_common><accessor source=\"#" + id + "-a\" count=\"" +
           std::to_string(count) + "\" stride=\"" + std::to_string(stride) + "\">" + params +
           "</accessor></technique_common></source>";
  };
  const std::string xyz =
      "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/>";
  const std::string matrix = "<param type=\"float4x4\"/>", number = "<param type=\"float\"/>";
  return R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh>)" +
         source("p", 3, 3, "0 0 0 100 0 0 0 0 200", xyz) +
         R"(<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries>
<library_controllers><controller id="c"><skin source="#g">
<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>)" +
         source("j", 2, 1, "lower upper", "<param name=\"JOINT\" type=\"name\"/>", "Name_array") +
         source("b", 2, 16, "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 0 1 0 0 0 0 1 -100 0 0 0 1", matrix) +
         source("w", 1, 1, "1", number) +
         R"(<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#b"/></joints>
<vertex_weights count="3"><input semantic="JOINT" source="#j" offset="0"/>
<input semantic="WEIGHT" source="#w" offset="1"/><vcount>1 1 1</vcount><v>0 0 0 0 1 0</v></vertex_weights>
</skin></controller></library_controllers>
<library_animations><animation id="a">)" +
         source("t", 2, 1, "1 1.5", number) +
         source("m", 2, 16, "1 0 0 0 0 1 0 0 0 0 1 100 0 0 0 1 1 0 0 0 0 0 -1 0 0 1 0 100 0 0 0 1", matrix) +
         source("i", 2, 1, "LINEAR LINEAR", "<param type=\"name\"/>", "Name_array") +
         R"(<sampler id="s"><input semantic="INPUT" source="#t"/><input semantic="OUTPUT" source="#m"/>
<input semantic="INTERPOLATION" source="#i"/></sampler><channel source="#s" target="upper/transform"/></animation>
</library_animations>
<library_visual_scenes><visual_scene id="scene">
<node id="lower" name="lower" sid="lower" type="JOINT"><matrix sid="transform">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
<node id="upper" name="upper" sid="upper" type="JOINT"><matrix sid="transform">1 0 0 0 0 1 0 0 0 0 1 100 0 0 0 1</matrix>
</node></node>
<node id="body" name="body"><instance_controller url="#c"><skeleton>#lower</skeleton></instance_controller></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>
)";
}

/// The tetrahedron with a blend shape that moves its vertex 3, a picture that isn't there, and a camera's place.
std::string fbx_with_shape() {
  std::string text = fbx_text("1");
  const auto put = [&text](const std::string& before, const std::string& more) {
    const std::size_t at = text.find(before);
    REQUIRE(at != std::string::npos);
    text.insert(at, more);
  };
  put("  Model: 2000", R"(  Geometry: 1001, "Geometry::smile", "Shape" {
    Version: 100
    Indexes: *1 {
      a: 3
    }
    Vertices: *3 {
      a: 0,50,0
    }
    Normals: *3 {
      a: 0,0,0
    }
  }
  Deformer: 4000, "Deformer::shapes", "BlendShape" {
    Version: 100
  }
  Deformer: 4001, "SubDeformer::smile", "BlendShapeChannel" {
    Version: 100
    DeformPercent: 0
    FullWeights: *1 {
      a: 100
    }
  }
  Texture: 5000, "Texture::t", "" {
    Type: "TextureVideoClip"
    Version: 202
    TextureName: "Texture::t"
    RelativeFilename: "gone.png"
    FileName: "gone.png"
  }
)");
  const std::size_t end = text.rfind('}');
  return text.insert(end,
                     "  C: \"OO\",4000,1000\n  C: \"OO\",4001,4000\n  C: \"OO\",1001,4001\n"
                     "  C: \"OP\",5000,3000, \"DiffuseColor\"\n");
}

/// Vertices of a scene's meshes at a time of one of its clips, by name.
npt::Mesh shown(const npt::Scene& scene, const std::string& clip, double time) {
  const npt::ScenePoser poser(scene);
  npt::Mesh mesh = poser.mesh();
  poser.positions(&npt::find_clip(scene, clip, "x"), time, mesh.coordinates());
  return mesh;
}
double farthest(const npt::Mesh& a, const npt::Mesh& b) {
  REQUIRE(a.vertex_count() == b.vertex_count());
  double worst = 0;
  for (std::size_t v = 0; v < a.vertex_count(); ++v)
    worst = std::max(worst, static_cast<double>(length(a.positions[v] - b.positions[v])));
  return worst;
}

void check_near(npt::Vec3f found, npt::Vec3f expected) {
  CHECK(found.x == doctest::Approx(expected.x).epsilon(1e-5));
  CHECK(found.y == doctest::Approx(expected.y).epsilon(1e-5));
  CHECK(found.z == doctest::Approx(expected.z).epsilon(1e-5));
}

}  // namespace

TEST_CASE("Corners of an STL become shared vertices" * assimp) {
  const scratch::Folder folder;
  for (const auto& [name, text] : {std::pair("a.stl", stl_text()), std::pair("b.STL", stl_bytes())}) {
    npt::write_file(folder / name, text);
    const npt::Mesh mesh = formats::read_mesh(folder / name);
    CHECK(mesh.vertex_count() == 4);
    CHECK(mesh.face_count() == 2);
    CHECK(mesh.corners == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    CHECK(mesh.positions[2] == npt::Vec3f{2, 3, 0});
  }
}

TEST_CASE("An OFF keeps its vertices and polygons") {
  const scratch::Folder folder;
  npt::write_file(folder / "a.off", off_text);
  const npt::Mesh mesh = formats::read_mesh(folder / "a.off");
  CHECK(mesh.vertex_count() == 4);
  CHECK(mesh.face_count() == 1);
  CHECK(mesh.corners == std::vector<std::uint32_t>{0, 1, 2, 3});
  CHECK(mesh.positions[1] == npt::Vec3f{2, 0, 0});
  npt::write_file(folder / "b.off", "COFF 3 1 3\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n3 0 1 2 10 10 10\n");
  CHECK(formats::read_mesh(folder / "b.off").face_count() == 1);
  const auto error = [&](const std::string& text) {
    npt::write_file(folder / "c.off", text);
    return scratch::error_of([&] { formats::read_mesh(folder / "c.off"); }).substr((folder / "c.off").string().size());
  };
  CHECK(error("") == ": the end: found no more lines, expected OFF, or COFF or NOFF, in a text file");
  CHECK(error("PLY\n") == ": line 1: found 'PLY', expected OFF, or COFF or NOFF, in a text file");
  CHECK(error("OFF\n3 1 0\n0 0 0\n1 0 nan\n") == ": line 4: found 'nan', expected a finite number");
  CHECK(error("OFF\n3 1 0\n0 0 0\n1 0\n") == ": line 4: found the end of the line, expected a finite number");
  CHECK(error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n") == ": line 6: found '7', expected a vertex below 3");
  CHECK(error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n") == ": line 6: found '2', expected three corners at least");
  CHECK(error("OFF\n99999999999 1 0\n").starts_with(": line 2: found '99999999999', expected the number of vertices"));
  for (std::size_t n = 0; n + 3 < std::string(off_text).size(); ++n)
    CHECK(error(std::string(off_text, n)).starts_with(": "));
}

TEST_CASE("An FBX comes in metres, y up, with its materials' names and colours" * assimp) {
  const scratch::Folder folder;
  for (const auto& [centimetres, metre] : {std::pair("1", 0.01F), std::pair("2.54", 0.0254F)}) {
    npt::write_file(folder / "a.fbx", fbx_text(centimetres));
    const npt::Mesh mesh = formats::read_mesh(folder / "a.fbx");
    REQUIRE(mesh.face_count() == 4);
    float most = 0, front = 0, side = 0;
    for (const npt::Vec3f p : mesh.positions)
      most = std::max(most, p.y), front = std::max(front, p.z), side = std::max(side, p.x);
    CHECK(most == doctest::Approx(180 * metre));
    CHECK(front == doctest::Approx(100 * metre));
    CHECK(side == doctest::Approx(100 * metre));
    REQUIRE(mesh.appearance != nullptr);
    REQUIRE(mesh.appearance->materials.size() == 1);
    CHECK(mesh.appearance->materials[0].label == "skin");
    CHECK(mesh.appearance->materials[0].json.find("[0.5,0.25,1.0,1]") != std::string::npos);
    CHECK(std::ranges::any_of(mesh.tags,
                              [](const npt::MeshTag& tag) { return tag.keyword == "usemtl" && tag.value == "skin"; }));
  }
}

TEST_CASE("Meshes of an FBX that are skinned in part, and stand there twice, are read" * assimp) {
  const scratch::Folder folder;
  npt::write_file(folder / "a.fbx", skinned_fbx_text());
  const npt::Scene scene = formats::read_scene(folder / "a.fbx");
  REQUIRE(scene.skins.size() == 2);
  REQUIRE(scene.shown.size() == 2);
  const npt::Skin& skin = scene.skins[0];
  REQUIRE(skin.joints.size() == 2);
  CHECK(scene.nodes[skin.joints[0]].mesh == npt::no_item);  // the joint, though the mesh has its name
  CHECK(skin.joints[1] == scene.shown[0]);                  // what no joint moves follows the mesh's node
  const npt::VertexBlock& block = scene.meshes[0].blocks[0];
  for (std::size_t v = 0; v < block.positions.size(); ++v) {
    const bool with_joint = block.positions[v] == npt::Vec3f{0, 0, 0} || block.positions[v] == npt::Vec3f{100, 0, 0};
    CHECK(block.joints[v * block.influences] == (with_joint ? 0 : 1));
    CHECK(block.weights[v * block.influences] == 1);
  }
  CHECK(formats::read_mesh(folder / "a.fbx").vertex_count() == 2 * block.positions.size());
}

TEST_CASE("An FBX before 2011 is refused with the names of converters" * assimp) {
  const scratch::Folder folder;
  std::string text = fbx_text("1");
  text.replace(text.find("FBXVersion: 7400"), 16, "FBXVersion: 6100");
  std::string binary = "Kaydara FBX Binary  ";
  binary += std::string("\0\x1A\0\xD4\x17\0\0", 7) + std::string(100, '\0');
  for (const std::string& bytes : {text, binary}) {
    npt::write_file(folder / "old.fbx", bytes);
    CHECK(scratch::error_of([&] { formats::read_mesh(folder / "old.fbx"); }) ==
          (folder / "old.fbx").string() +
              ": found an FBX of version 6.1, expected 7.1 (2011) or later: FBX2glTF makes a GLB of it, Autodesk's FBX "
              "Converter an FBX of 2013");
  }
}

TEST_CASE("An FBX keeps all vertices of a polygon, also of one that crosses itself" * assimp) {
  const scratch::Folder folder;
  const auto read = [&](bool crossed, std::vector<std::string>& notes) {
    // Eighteen corners around a circle: in order, or each five steps from the one before it.
    std::string vertices, corners;
    for (int i = 0; i < 18; ++i) {
      const double angle = 0.3490658503988659 * (crossed ? 5 * i : i);
      vertices += (i == 0 ? "" : ",") + std::to_string((100 + i) * std::cos(angle)) + "," +
                  std::to_string((100 + i) * std::sin(angle)) + ",0";
      corners += i == 17 ? ",-18" : (i == 0 ? "" : ",") + std::to_string(i);
    }
    npt::write_file(folder / "a.fbx", fbx_text("1", vertices, corners));
    return formats::read_mesh(folder / "a.fbx", &notes);
  };
  std::vector<std::string> notes;
  const npt::Mesh whole = read(false, notes);
  CHECK(whole.vertex_count() == 18);
  CHECK(whole.face_count() == 16);
  CHECK(notes.empty());
  const npt::Mesh crossed = read(true, notes);
  CHECK(crossed.vertex_count() == 18);
  CHECK(crossed.face_count() == 16);
  CHECK(notes == std::vector<std::string>{(folder / "a.fbx").string() +
                                          ": 1 polygon that crosses itself: cut into triangles from the first corner"});
}

TEST_CASE("A Collada file's skin and clip move its mesh" * assimp) {
  const scratch::Folder folder;
  npt::write_file(folder / "a.dae", dae_text());
  const npt::Scene scene = formats::read_scene(folder / "a.dae");
  const npt::ScenePoser poser(scene);
  npt::Mesh mesh = poser.mesh();
  REQUIRE(mesh.vertex_count() == 3);
  check_near(mesh.positions[1], {1, 0, 0});
  check_near(mesh.positions[2], {0, 2, 0});
  REQUIRE(scene.clips.size() == 1);
  CHECK(scene.clips[0].length() == doctest::Approx(0.5));  // from its first key on
  poser.positions(&scene.clips[0], 0.5, mesh.coordinates());
  check_near(mesh.positions[1], {1, 0, 0});
  check_near(mesh.positions[2], {0, 1, 1});  // z in the file, which turns to -y: forwards
}

TEST_CASE("A blend shape is a morph target, and what is lost is told" * assimp) {
  const scratch::Folder folder;
  npt::write_file(folder / "a.fbx", fbx_with_shape());
  std::vector<std::string> lost;
  const npt::Scene scene = formats::read_foreign(folder / "a.fbx", &lost);
  REQUIRE(scene.meshes.size() == 1);
  CHECK(scene.meshes[0].weights == std::vector<double>{0});
  REQUIRE(scene.meshes[0].blocks.at(0).targets.size() == 1);
  const npt::VertexBlock& block = scene.meshes[0].blocks[0];
  REQUIRE(block.targets[0].positions.size() == block.positions.size());
  std::size_t moved = 0;
  for (std::size_t v = 0; v < block.positions.size(); ++v) {
    const bool top = block.positions[v].z > 100;
    CHECK(length(block.targets[0].positions[v] - (top ? npt::Vec3f{0, 50, 0} : npt::Vec3f{})) < 1e-4F);
    moved += top ? 1 : 0;
  }
  CHECK(moved == 1);
  CHECK(std::ranges::find(lost, "the picture 'gone.png', which isn't in the file or beside it") != lost.end());
  CHECK(lost.back().starts_with("polygons, as triangles"));
  const npt::Scene again = npt::parse_gltf(npt::glb_bytes(scene, "x"), "x");
  CHECK(again.meshes[0].blocks[0].targets[0].positions == block.targets[0].positions);
  CHECK(again.meshes[0].weights == std::vector<double>{0});
}

TEST_CASE("What is written of a Collada file has its skin, joints and clips, and one more" * assimp) {
  const scratch::Folder folder;
  npt::write_file(folder / "a.dae", dae_text());
  npt::Scene scene = npt::with_joined_nodes(formats::read_foreign(folder / "a.dae"));
  const npt::Motion own = npt::motion_of(scene, &scene.clips.at(0), "a.dae");
  const std::string first = scene.clips[0].name;
  CHECK(npt::add_clip(scene, own, first) == first + "_2");
  const npt::Scene again = npt::parse_gltf(npt::glb_bytes(scene, "x"), "x");
  REQUIRE(again.clips.size() == 2);
  REQUIRE(again.skins.size() == 1);
  CHECK(again.nodes.at(again.skins[0].joints.at(0)).name == "lower");
  CHECK(again.nodes.at(again.skins[0].joints.at(1)).name == "upper");
  for (const double time : {0.0, 0.2, 0.5}) {
    const npt::Mesh expected = shown(scene, first, time);
    CHECK(farthest(shown(again, first, time), expected) < 1e-6);
    CHECK(farthest(shown(again, first + "_2", time), expected) < 1e-6);
  }
}

TEST_CASE("Rigged files of others keep joints, skins, pictures and clips as GLB" * assimp_and_characters) {
  std::size_t files = 0, clips = 0;
  double worst = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(NPT_SHARED "/data/characters/humanoids")) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() != ".fbx") continue;
    INFO(path.string());
    const npt::Scene read = formats::read_foreign(path);
    if (read.skins.empty()) continue;
    ++files;
    const npt::Scene scene = npt::with_joined_nodes(read), again = npt::parse_gltf(npt::glb_bytes(scene, "x"), "x");
    REQUIRE(again.nodes.size() == scene.nodes.size());
    for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
      CHECK(again.nodes[n].name == scene.nodes[n].name);
      CHECK(again.nodes[n].name.find("$AssimpFbx$") == std::string::npos);
    }
    REQUIRE(again.skins.size() == read.skins.size());
    for (std::size_t s = 0; s < read.skins.size(); ++s)
      for (std::size_t j = 0; j < read.skins[s].joints.size(); ++j)
        CHECK(again.nodes[again.skins[s].joints.at(j)].name == read.nodes[read.skins[s].joints[j]].name);
    CHECK((again.appearance == nullptr) == (read.appearance == nullptr));
    if (read.appearance != nullptr) {
      REQUIRE(again.appearance->images.size() == read.appearance->images.size());
      for (std::size_t i = 0; i < read.appearance->images.size(); ++i)
        CHECK(again.appearance->images[i].bytes == read.appearance->images[i].bytes);
      for (std::size_t i = 0; i < read.appearance->materials.size(); ++i)
        CHECK(again.appearance->materials[i].json == read.appearance->materials[i].json);
    }
    REQUIRE(again.clips.size() == read.clips.size());
    for (const npt::Clip& clip : read.clips) {
      ++clips;
      for (const double part : {0.0, 0.31, 1.0}) {
        const double time = part * clip.length();
        worst = std::max(worst, farthest(shown(again, clip.name, time), shown(read, clip.name, time)));
      }
    }
  }
  MESSAGE(files << " files, " << clips << " clips, vertices at most " << worst << " m off");
  CHECK(files > 0);
  CHECK(worst < 1e-5);
}

TEST_CASE("Files that end early, or aren't what they say, are errors" * assimp) {
  const scratch::Folder folder;
  const std::vector<std::pair<std::string, std::string>> whole{
      {"a.stl", stl_text()}, {"b.stl", stl_bytes()}, {"a.fbx", fbx_text("1")}, {"a.dae", dae_text()}};
  for (const auto& file : whole)
    for (const double part : {0.0, 0.02, 0.3, 0.6, 0.8}) {
      const std::string &name = file.first, &text = file.second;
      CAPTURE(name);
      CAPTURE(part);
      npt::write_file(folder / name, text.substr(0, static_cast<std::size_t>(part * static_cast<double>(text.size()))));
      CHECK(scratch::error_of([&] { formats::read_mesh(folder / name); }).starts_with((folder / name).string() + ": "));
    }
  CHECK(scratch::error_of([&] { formats::read_mesh(folder / "none.fbx"); }).find("none.fbx: ") != std::string::npos);
}

TEST_CASE("Skins and clips through assimp are those of npt's own reader" * assimp_and_knight) {
  const std::filesystem::path file = NPT_SHARED "/data/glb/Knight.glb";
  const npt::Scene foreign = formats::read_foreign(file), own = npt::read_scene(file);
  const npt::ScenePoser a(foreign), b(own);
  npt::Mesh x = a.mesh(), y = b.mesh();
  REQUIRE(x.corners == y.corners);
  REQUIRE(foreign.clips.size() == own.clips.size());
  for (const npt::Clip& clip : own.clips)
    for (const double part : {0.0, 0.3, 0.71, 1.0}) {
      double begin = clip.length();
      for (const npt::ClipChannel& channel : clip.channels) begin = std::min(begin, double{channel.times.front()});
      const double time = begin + part * (clip.length() - begin);
      a.positions(&npt::find_clip(foreign, clip.name, "assimp"), time - begin, x.coordinates());
      b.positions(&clip, time, y.coordinates());
      double worst = 0;
      for (std::size_t v = 0; v < x.vertex_count(); ++v)
        worst = std::max(worst, static_cast<double>(length(x.positions[v] - y.positions[v])));
      CHECK(worst < 1e-5);
    }
}

TEST_CASE("Without assimp the message names its package") {
  if (!formats::reads_foreign())
    CHECK(scratch::error_of([] { formats::read_mesh("a.fbx"); }) ==
          "a.fbx: found extension .fbx, expected an npt that was built with assimp (Debian: libassimp-dev), or .ply, "
          ".obj or "
          ".glb");
  CHECK(formats::is_scene("A.FBX"));
  CHECK(!formats::is_scene("a.stl"));
}
