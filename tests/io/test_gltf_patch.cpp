/// Clips and poses put into glTF files: what is put in, that all else stays, and every kind of damage.
#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <io/small_gltf.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/glb_patch.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_added.hpp>
#include <npt/io/gltf_curves.hpp>
#include <npt/io/gltf_pack.hpp>
#include <npt/io/gltf_patch.hpp>
#include <npt/io/gltf_patcher.hpp>
#include <npt/io/gltf_reader.hpp>
#include <npt/io/gltf_text.hpp>
#include <npt/io/gltf_uri.hpp>
#include <npt/io/json_tree.hpp>
#include <npt/io/text_edits.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace patch_test {

using scratch::error_of;

/// The small file's own clip, on its joints.
npt::Motion wave(const std::string& file = small_gltf::file()) {
  const npt::Scene scene = npt::parse_gltf(file, "x.glb");
  return npt::motion_of(scene, scene.clips.empty() ? nullptr : &scene.clips.front(), "x.glb");
}
/// A pose of one key: the joint turned half about z, and put at 0 3 0.
npt::Motion one_pose(const npt::Motion& motion, std::size_t joint) {
  npt::Motion pose = motion;
  pose.clip = {"Pose", {}};
  pose.clip.channels.push_back(
      {.node = joint, .path = npt::ChannelPath::rotation, .width = 4, .times = {0}, .values = {0, 0, 1, 0}});
  pose.clip.channels.push_back({.node = joint, .times = {0}, .values = {0, 3, 0}});
  return pose;
}
std::string patched(const std::string& file, const npt::Motion& motion, const npt::GltfPatch& options = {},
                    std::vector<std::string>* notes = nullptr) {
  return npt::with_motion(file, motion, options, "x.glb", notes);
}
std::string_view json_of(std::string_view file) { return npt::internal::read_glb(file, "x.glb").json; }
std::string_view chunk_of(std::string_view file) {
  return npt::internal::read_glb(file, "x.glb").bytes.value_or(std::string_view());
}
std::string without_blanks_behind(std::string_view text) {
  while (text.ends_with(' ')) text.remove_suffix(1);
  return std::string(text);
}
std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  REQUIRE_MESSAGE(at != std::string::npos, std::string(from));
  return text.replace(at, from.size(), to);
}

/// What a patched document is without what was put into it, in the spelling of the tree.
std::string as_before(std::string_view patched_json, const npt::internal::JsonValue& original) {
  using npt::internal::JsonValue;
  JsonValue tree = npt::internal::read_json_tree(patched_json, "x");
  for (const char* key : {"accessors", "bufferViews", "animations", "buffers"}) {
    JsonValue* list = const_cast<JsonValue*>(tree.find(key));
    const JsonValue* old = original.find(key);
    if (list == nullptr) continue;
    if (old == nullptr) {
      const auto i = list - tree.items.data();
      tree.items.erase(tree.items.begin() + i);
      tree.keys.erase(tree.keys.begin() + i);
    } else {
      list->items.resize(old->items.size());
      if (std::string_view(key) == "buffers" && !old->items.empty())
        const_cast<JsonValue*>(list->items[0].find("byteLength"))->text = old->items[0].find("byteLength")->text;
    }
  }
  std::string text;
  npt::internal::append_json(text, tree);
  return text;
}
std::string as_tree(const npt::internal::JsonValue& value) {
  std::string text;
  npt::internal::append_json(text, value);
  return text;
}

double farthest_joints(const npt::Motion& a, const npt::Motion& b) {
  REQUIRE(a.joints.size() == b.joints.size());
  double worst = 0;
  for (const double part : {0.0, 0.21, 0.5, 0.77, 1.0}) {
    const double time = part * a.clip.length();
    const std::vector<npt::Vec3d> p = npt::joint_positions(a, time), q = npt::joint_positions(b, time);
    for (std::size_t j = 0; j < p.size(); ++j) worst = std::max(worst, length(p[j] - q[j]));
  }
  return worst;
}

}  // namespace patch_test

TEST_CASE("a clip is put in behind what a GLB has, which stays to the byte") {
  using namespace patch_test;
  const std::string file = small_gltf::file(), result = patched(file, wave(), {.name = "New \"clip\""});
  CHECK(chunk_of(result).starts_with(chunk_of(file)));
  // times 0 1; the tip's two rotations; the root's two translations
  CHECK(chunk_of(result).substr(344) == small_gltf::floats({0, 1}) + small_gltf::floats({0, 0, 0, 2, 0, 0}) +
                                            small_gltf::floats({0, 0, 0, 1, 0, 0, 1, 0}));
  std::string expected = small_gltf::json();
  expected =
      replaced(expected, R"("count":2,"type":"SCALAR"}],"bufferViews")",
               R"("count":2,"type":"SCALAR"},)"
               R"({"bufferView":10,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]},)"
               R"({"bufferView":10,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC3"},)"
               R"({"bufferView":10,"byteOffset":32,"componentType":5126,"count":2,"type":"VEC4"}],"bufferViews")");
  expected = replaced(expected, R"({"buffer":0,"byteOffset":340,"byteLength":4})",
                      R"({"buffer":0,"byteOffset":340,"byteLength":4},)"
                      R"({"buffer":0,"byteOffset":344,"byteLength":64})");
  expected = replaced(expected, R"({"byteLength":344})", R"({"byteLength":408})");
  expected = replaced(expected, R"({"name":"Rest","samplers":[],"channels":[]})",
                      R"({"name":"Rest","samplers":[],"channels":[]},{"name":"New \"clip\"","samplers":[)"
                      R"({"input":10,"output":11,"interpolation":"STEP"},)"
                      R"({"input":10,"output":12,"interpolation":"LINEAR"}],"channels":[)"
                      R"({"sampler":0,"target":{"node":1,"path":"translation"}},)"
                      R"({"sampler":1,"target":{"node":2,"path":"rotation"}}]})");
  CHECK(without_blanks_behind(json_of(result)) == expected);
  CHECK(result.size() == npt::internal::little_u32(result, 8));

  const npt::Scene scene = npt::parse_gltf(result, "x.glb");
  REQUIRE(scene.clips.size() == 3);
  CHECK(scene.clips[2].name == "New \"clip\"");
  CHECK(farthest_joints(wave(), npt::motion_of(scene, &scene.clips[2], "x.glb")) == 0);
}

TEST_CASE("what other clips move and a new one doesn't gets its rest") {
  using namespace patch_test;
  const std::string file = small_gltf::changed(R"("name":"root",)", R"("name":"root","translation":[0,0.5,0],)");
  npt::Motion part = wave(file);
  std::erase_if(part.clip.channels, [](const auto& c) { return c.path == npt::ChannelPath::translation; });
  const npt::Scene scene = npt::parse_gltf(patched(file, part), "x.glb");
  const std::vector<npt::ClipChannel>& channels = scene.clips.back().channels;
  REQUIRE(channels.size() == 2);
  CHECK(channels[1].node == 1);
  CHECK(channels[1].path == npt::ChannelPath::translation);
  CHECK(channels[1].values == std::vector<float>{0, 0.5F, 0});
}

TEST_CASE("a clip's name that a file has gets a number") {
  using namespace patch_test;
  std::vector<std::string> notes;
  std::string file = small_gltf::file();
  for (int i = 0; i < 3; ++i) file = patched(file, wave(), {.name = "Rest"}, &notes);
  file = patched(file, wave(), {}, &notes);
  const npt::Scene scene = npt::parse_gltf(file, "x.glb");
  std::vector<std::string> names;
  for (const npt::Clip& clip : scene.clips) names.push_back(clip.name);
  CHECK(names == std::vector<std::string>{"Armature|Wave", "Rest", "Rest_2", "Rest_3", "Rest_4", "Armature|Wave_2"});
  REQUIRE(notes.size() == 4);
  CHECK(notes[0] == "x.glb: has a clip 'Rest', the new one is 'Rest_2'");

  npt::Motion nameless = wave();
  nameless.clip.name.clear();
  CHECK(npt::parse_gltf(patched(small_gltf::file(), nameless), "x.glb").clips.back().name == "motion");
  // One without a name is "clip_1" to npt.
  const std::string other = small_gltf::changed(R"({"name":"Rest","samplers")", R"({"samplers")");
  CHECK(npt::parse_gltf(patched(other, wave(), {.name = "clip_1"}), "x.glb").clips.back().name == "clip_1_2");
}

TEST_CASE("curves are written as glTF wants them") {
  using namespace patch_test;
  npt::Motion motion = wave();
  motion.clip.channels.clear();
  // The same all the time, by all kinds of keys; one end of 3 s is kept.
  motion.clip.channels.push_back({.node = 0, .times = {0, 1, 3}, .values = {1, 2, 3, 1, 2, 3, 1, 2, 3}});
  motion.clip.channels.push_back({.node = 0,
                                  .path = npt::ChannelPath::scale,
                                  .interpolation = npt::Interpolation::cubic,
                                  .times = {0, 1},
                                  .values = {0, 0, 0, 2, 2, 2, 0, 0, 0, 0, 0, 0, 2, 2, 2, 0, 0, 0}});
  // Two keys at one time: a jump; and rotations that are twice as long.
  motion.clip.channels.push_back({.node = 1,
                                  .path = npt::ChannelPath::rotation,
                                  .width = 4,
                                  .times = {0, 1, 1, 1, 2},
                                  .values = {0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 9, 0, 0, 2, 0, 0, 0, 2, 0}});
  const npt::Scene scene = npt::parse_gltf(patched(small_gltf::file(), motion, {.name = "c"}), "x.glb");
  const npt::Clip& clip = scene.clips.back();
  REQUIRE(clip.channels.size() == 3);
  CHECK(clip.length() == 3);
  CHECK(clip.channels[0].times == std::vector<float>{0, 3});
  CHECK(clip.channels[0].values == std::vector<float>{1, 2, 3, 1, 2, 3});
  CHECK(clip.channels[1].times == std::vector<float>{0});
  CHECK(clip.channels[1].values == std::vector<float>{2, 2, 2});
  CHECK(clip.channels[1].interpolation == npt::Interpolation::linear);
  CHECK(clip.channels[2].times == std::vector<float>{0, std::nextafter(1.0F, 0.0F), 1, 2});
  CHECK(clip.channels[2].values == std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0});
}

TEST_CASE("files without buffers, without a chunk, and as text get what they lack") {
  using namespace patch_test;
  const std::string bare = R"({ "asset" : {"version":"2.0"}, "nodes":[{"name":"a","children":[1]},{"name":"b"}] })";
  npt::Motion motion{.joints = {{.name = "a", .node = 0}, {.name = "b", .parent = 0, .node = 1}}};
  motion.clip = {"Go", {{.node = 1, .times = {0, 1}, .values = {0, 0, 0, 0, 0, 1}}}};
  const auto end_of = [&](const std::string& file) {
    const npt::Scene scene = npt::parse_gltf(file, "x");
    std::vector<double> value(3);
    scene.clips.at(0).channels.at(0).sample(1, value);
    return value[2];
  };
  const std::string in_chunk = patched(npt::internal::format_glb(bare, "", "x"), motion);
  CHECK(chunk_of(in_chunk).size() == 32);
  CHECK(json_of(in_chunk).find(R"("buffers":[{"byteLength":32}])") != std::string::npos);
  CHECK(json_of(in_chunk).starts_with(bare.substr(0, bare.size() - 2)));
  CHECK(end_of(in_chunk) == 1);

  // A GLB whose first buffer is another file's bytes, and a chunk that nobody uses.
  const std::string other = R"({"asset":{"version":"2.0"},"nodes":[{"name":"a"},{"name":"b"}],)"
                            R"("buffers":[{"byteLength":3,"uri":"data:;base64,AAAA"}]})";
  const std::string own_buffer = patched(npt::internal::format_glb(other, "four", "x"), motion);
  CHECK(chunk_of(own_buffer) == "four");
  CHECK(json_of(own_buffer).find(R"({"byteLength":3,"uri":"data:;base64,AAAA"},{"byteLength":32,)") !=
        std::string::npos);
  CHECK(end_of(own_buffer) == 1);

  for (const std::string& text : {bare, other, "\xEF\xBB\xBF" + bare}) {
    const std::string as_text = patched(text, motion);
    CHECK(as_text.starts_with(text.substr(0, 30)));
    CHECK(as_text.find("data:application/octet-stream;base64,") != std::string::npos);
    CHECK(end_of(as_text) == 1);
  }
}

TEST_CASE("a GLB's further chunks and padding stay") {
  using namespace patch_test;
  std::string file = npt::internal::format_glb(small_gltf::json() + "  ", small_gltf::bytes() + "12345", "x");
  const std::string more = std::string("\4\0\0\0XYZ\0abcd", 12), behind = "behind";
  npt::internal::append_little_u32(file, 4);
  file += more.substr(4);
  std::string size;
  npt::internal::append_little_u32(size, static_cast<std::uint32_t>(file.size()));
  file.replace(8, 4, size);
  const std::string result = patched(file + behind, wave());
  CHECK(result.ends_with(more + behind));
  CHECK(chunk_of(result).starts_with(small_gltf::bytes() + "12345" + std::string(3, '\0')));
  CHECK(chunk_of(result).size() == 352 + 64);
  CHECK(farthest_joints(wave(), wave(result)) == 0);
  CHECK(npt::internal::little_u32(result, 8) == result.size() - behind.size());
}

TEST_CASE("a pose becomes the rest, and clips keep what they showed") {
  using namespace patch_test;
  const std::string file = small_gltf::changed(R"({"name":"tip"})", R"({"name":"tip","translation":[0,1.50,0]})");
  const npt::Motion before = wave(file), pose = one_pose(before, 1);
  const std::string result = patched(file, pose, {.apply = true});
  CHECK(json_of(result).find(R"({"name":"tip","translation":[0,3,0],"rotation":[0,0,1,0]})") != std::string::npos);
  CHECK(json_of(result).find(R"("name":"Pose")") == std::string::npos);
  const npt::Scene scene = npt::parse_gltf(result, "x.glb");
  CHECK(scene.nodes[2].place.translation == npt::Vec3d{0, 3, 0});
  // "Wave" turned the tip and didn't place it; "Rest" did neither.
  REQUIRE(scene.clips.size() == 2);
  REQUIRE(scene.clips[0].channels.size() == 4);
  CHECK(scene.clips[0].channels[3].path == npt::ChannelPath::translation);
  CHECK(scene.clips[0].channels[3].values == std::vector<float>{0, 1.5F, 0});
  CHECK(scene.clips[1].channels.size() == 2);
  CHECK(farthest_joints(before, npt::motion_of(scene, &scene.clips[0], "x.glb")) == 0);
  CHECK(chunk_of(result).starts_with(chunk_of(file)));

  // Numbers of nodes as some writers put them.
  const std::string real = npt::internal::format_glb(
      replaced(std::string(json_of(file)), R"("node":2,"path")", R"("node":2.0,"path")"), chunk_of(file), "x");
  CHECK(npt::parse_gltf(patched(real, pose, {.apply = true}), "x").clips[0].channels.size() == 4);

  // The rest as it is changes nothing, and so does a time of a clip at which it is the rest.
  CHECK(patched(file, npt::motion_of(npt::parse_gltf(file, "x"), nullptr, "x"), {.apply = true}) == file);
  npt::Motion same = pose;
  same.clip.channels[0].values = {0, 0, 0, -1};
  same.clip.channels[1].values = {0, 1.5F, 0};
  CHECK(patched(file, same, {.apply = true}) == file);

  // In the middle of the wave the tip is turned by a right angle.
  const npt::Scene middle = npt::parse_gltf(patched(file, before, {.apply = true, .time = 0.5}), "x.glb");
  CHECK(std::abs(middle.nodes[2].place.rotation.z - std::sqrt(0.5)) < 1e-6);
  CHECK(middle.nodes[1].place.translation == npt::Vec3d{});
}

TEST_CASE("matrices give way to places") {
  using namespace patch_test;
  const std::string matrix = R"("matrix":[0,2,0,0,-2,0,0,0,0,0,2,0,5,6,7,1])";
  const std::string file =
      small_gltf::changed(R"("name":"root","children":[2])", R"("name":"root",)" + matrix + R"(,"children":[2])");
  const std::string moving = R"({"sampler":1,"target":{"node":1,"path":"translation"}})";
  const std::string text = replaced(std::string(json_of(file)), "," + moving, "");
  const std::string own = npt::internal::format_glb(text, small_gltf::bytes(), "x");
  npt::Motion motion = wave(own);
  const std::size_t root = motion.joints[0].name == "root" ? 0 : 1;
  REQUIRE(motion.joints[root].name == "root");
  motion.clip = {"m", {{.node = root, .times = {0, 1}, .values = {0, 0, 0, 0, 0, 1}}}};
  const std::string result = patched(own, motion);
  const npt::Scene scene = npt::parse_gltf(result, "x.glb");
  CHECK(!scene.nodes[1].matrix);
  CHECK(scene.nodes[1].place.translation == npt::Vec3d{5, 6, 7});
  CHECK(length(scene.nodes[1].place.scale - npt::Vec3d{2, 2, 2}) < 1e-12);
  CHECK(std::abs(scene.nodes[1].place.rotation.z - std::sqrt(0.5)) < 1e-12);
  CHECK(scene.nodes[2].parent == 1);

  // As a rest; clips get all that they need.
  const npt::Motion pose = one_pose(wave(own), root);
  const npt::Scene posed = npt::parse_gltf(patched(own, pose, {.apply = true}), "x.glb");
  CHECK(!posed.nodes[1].matrix);
  CHECK(posed.nodes[1].place.translation == npt::Vec3d{0, 3, 0});
  CHECK(length(posed.nodes[1].place.scale - npt::Vec3d{2, 2, 2}) < 1e-12);
  CHECK(posed.clips[0].channels.size() == 4);
  CHECK(farthest_joints(wave(own), npt::motion_of(posed, &posed.clips[0], "x")) < 1e-6);

  const std::string shears = replaced(text, matrix, R"("matrix":[1,0,0,0,1,1,0,0,0,0,1,0,0,0,0,1])");
  CHECK(error_of([&] { patched(shears, motion); }).find("nodes[1].matrix: found a matrix that shears") !=
        std::string::npos);
  // A joint that stays as it is may shear.
  const std::string sheared = npt::internal::format_glb(shears, small_gltf::bytes(), "x");
  CHECK(json_of(patched(sheared, one_pose(wave(sheared), 1 - root), {.apply = true})).find("[1,0,0,0,1,1,0,") !=
        std::string_view::npos);
  CHECK(error_of([&] { patched(sheared, one_pose(wave(sheared), root), {.apply = true}); }).find("shears") !=
        std::string::npos);
  const std::string both = replaced(text, matrix, matrix + R"(,"scale":[1,1,1])");
  CHECK(error_of([&] { patched(both, motion); }).find("matrix and scale") != std::string::npos);
}

TEST_CASE("VRM stays VRM, unknown extensions and curves by pointers, too") {
  using namespace patch_test;
  for (const std::string vrm :
       {R"("VRMC_vrm":{"specVersion":"1.0","humanoid":{"humanBones":{"hips":{"node":1}}}})",
        R"("VRM":{"humanoid":{"humanBones":[{"bone":"hips","node":1}]},"x" : 1e0, "y":"\u00e4\/"})"}) {
    const std::string extensions = R"("extensions" : {)" + vrm + R"(, "ACME":[ 1.0 ,2e1]},)";
    const std::string text = replaced(small_gltf::json(), R"("scene":0,)", R"("scene":0,)" + extensions);
    const std::string file = npt::internal::format_glb(text, small_gltf::bytes(), "x");
    std::vector<std::string> notes;
    CHECK(json_of(patched(file, wave(), {}, &notes)).find(extensions) != std::string::npos);
    CHECK(notes.size() == 1);  // of the clip's name
    const std::string applied = patched(file, one_pose(wave(), 1), {.apply = true}, &notes);
    CHECK(json_of(applied).find(extensions) != std::string::npos);
    CHECK(notes.back().find("T pose") != std::string::npos);
    CHECK(npt::parse_gltf(applied, "x").nodes[1].bone == "hips");
  }
  const std::string pointed = small_gltf::changed(
      R"("target":{"node":1,"path":"translation"})",
      R"("target":{"path":"pointer","extensions":{"KHR_animation_pointer":{"pointer":"/nodes/2/translation"}}})");
  const npt::Scene scene = npt::parse_gltf(patched(pointed, one_pose(wave(), 1), {.apply = true}), "x.glb");
  CHECK(scene.clips[0].channels.size() == 2);  // the tip's rotation and the weights, as before
  CHECK(scene.clips[1].channels.size() == 2);
}

TEST_CASE("a motion that isn't the file's, and bad curves, are errors with their place") {
  using namespace patch_test;
  const auto error = [](auto change, const npt::GltfPatch& options = {}) {
    npt::Motion motion = wave();
    change(motion);
    return error_of([&] { patched(small_gltf::file(), motion, options); });
  };
  CHECK(error([](npt::Motion&) {}) == "no error");
  CHECK(error([](npt::Motion& m) { m.joints[0].node = 9; }) ==
        "x.glb: joint 'root': found node 9, expected one of the file's 3 nodes");
  CHECK(error([](npt::Motion& m) { m.joints[0].node = npt::no_item; }).find("found no node") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.joints[0].name = "hip"; }) ==
        "x.glb: nodes[1]: found 'root', expected joint 'hip' of the motion");
  CHECK(error([](npt::Motion& m) { m.clip.channels.clear(); }).find("found no curve") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.clip.channels[0].node = 7; }).find("joint 7") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.clip.channels[0].times = {1, 0}; }).find("key 1 at 0.0") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.clip.channels[0].times = {-1, 0}; }).find("key 0 at -1") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.clip.channels[0].times.pop_back(); }).find("for 1 keys") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.clip.channels[0].times.clear(); }).find("for 0 keys") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.clip.channels[0].path = npt::ChannelPath::weights; }).find("no joint") !=
        std::string::npos);
  CHECK(error([](npt::Motion& m) { m.clip.name = "\xFF"; }).find("UTF-8") != std::string::npos);
  const auto not_a_number = [](npt::Motion& m) {
    m.clip.channels[0].values[1] = std::numeric_limits<float>::quiet_NaN();
  };
  CHECK(error(not_a_number).find("isn't finite") != std::string::npos);
  CHECK(error(not_a_number, {.apply = true}).find("isn't finite") != std::string::npos);
  CHECK(error([](npt::Motion& m) { m.joints[0].node = 9; }, {.apply = true}).find("node 9") != std::string::npos);
}

TEST_CASE("damaged files are errors or patched, never more") {
  using namespace patch_test;
  const npt::Motion motion = wave(), pose = one_pose(motion, 1);
  std::size_t errors = 0, good = 0;
  const auto attempt = [&](const std::string& file) {
    for (const bool apply : {false, true}) {
      const std::string error = error_of([&] { patched(file, apply ? pose : motion, {.apply = apply}); });
      ++(error == "no error" ? good : errors);
      CHECK(error.find("x.glb") == (error == "no error" ? std::string::npos : 0));
    }
  };
  const std::string file = small_gltf::file(), text = small_gltf::json();
  for (std::size_t size = 0; size < file.size(); size += 7) attempt(file.substr(0, size));
  for (std::size_t at = 0; at < text.size(); at += 3) {
    for (const char c : {'[', '}', '9', '"', 'x'}) {
      std::string damaged = text;
      damaged[at] = c;
      attempt(damaged);
    }
  }
  for (const char* key : {"nodes", "animations", "accessors", "bufferViews", "buffers", "asset"})
    for (const char* value : {"null", "[]", "[1]", "{}", "[{}]", "\"x\"", "[[]]"})
      attempt("{\"asset\":{\"version\":\"2.0\"},\"" + std::string(key) + "s\":1,\"" + key + "\":" + value + "}");
  CHECK(errors > 2000);
  CHECK(good > 100);
  CHECK(error_of([&] { patched(R"({"asset":{"version":"1.0"}})", motion); }).find("expected 2.0") != std::string::npos);
}

TEST_CASE("files are written beside those that they name, or as one GLB") {
  using namespace patch_test;
  const scratch::Folder folder;
  std::string text =
      replaced(small_gltf::json(), R"({"byteLength":344})", R"({"uri":"parts/all%20of%20it.bin","byteLength":344})");
  text = replaced(text, R"({"bufferView":9,"mimeType":"image/png"})", R"({"name":"i","uri":"skin.png"})");
  std::filesystem::create_directories(folder / "in/parts");
  npt::write_file(folder / "in/a.gltf", text);
  npt::write_file(folder / "in/parts/all of it.bin", small_gltf::bytes());
  npt::write_file(folder / "in/skin.png", "\x89PNG and more");

  std::filesystem::create_directories(folder / "out");
  npt::write_with_motion(folder / "in/a.gltf", wave(), {.name = "n"}, folder / "out/b.gltf");
  CHECK(npt::read_file(folder / "out/parts/all of it.bin") == small_gltf::bytes());
  CHECK(npt::read_file(folder / "out/skin.png") == "\x89PNG and more");
  const npt::Scene scene = npt::read_scene(folder / "out/b.gltf");
  CHECK(scene.clips.back().name == "n");
  npt::write_with_motion(folder / "in/a.gltf", wave(), {.name = "n"}, folder / "out/b.gltf");  // again
  npt::write_file(folder / "out/skin.png", "another");
  CHECK(error_of([&] {
          npt::write_with_motion(folder / "in/a.gltf", wave(), {}, folder / "out/b.gltf");
        }).find("another file of this name") != std::string::npos);

  npt::write_with_motion(folder / "in/a.gltf", wave(), {.name = "n"}, folder / "c.glb");
  const std::string packed = npt::read_file(folder / "c.glb");
  CHECK(chunk_of(packed).starts_with(small_gltf::bytes() + "\x89PNG and more"));
  CHECK(json_of(packed).find("\"buffers\":[{\"byteLength\":") != std::string::npos);
  const npt::Scene again = npt::parse_gltf(packed, "c.glb");
  CHECK(again.appearance->images.at(0).bytes == "\x89PNG and more");
  CHECK(again.appearance->images.at(0).mime_type == "image/png");
  CHECK(npt::format_gltf(again, "x") == npt::format_gltf(scene, "x"));

  // In place, and what can't be.
  npt::write_with_motion(folder / "c.glb", wave(), {.name = "more"}, folder / "c.glb");
  CHECK(npt::read_scene(folder / "c.glb").clips.back().name == "more");
  CHECK(error_of([&] {
          npt::write_with_motion(folder / "c.glb", wave(), {}, folder / "c.gltf");
        }).find("expected .glb") != std::string::npos);
  CHECK(error_of([&] {
          npt::write_with_motion(folder / "c.glb", wave(), {}, folder / "c.fbx");
        }).find("expected .glb, .gltf or .vrm") != std::string::npos);
  npt::write_file(folder / "in/d.gltf", replaced(text, "skin.png", "../skin.png"));
  for (const char* name : {"d.glb", "out/d.gltf"})
    CHECK(error_of([&] {
            npt::write_with_motion(folder / "in/d.gltf", wave(), {}, folder / name);
          }).find("expected a file in the document's folder") != std::string::npos);
  npt::write_file(folder / "in/e.gltf", replaced(text, "\"byteLength\":344", "\"byteLength\":345"));
  CHECK(error_of([&] {
          npt::write_with_motion(folder / "in/e.gltf", wave(), {}, folder / "e.glb");
        }).find("buffers[0].byteLength: found 345") != std::string::npos);
}

TEST_CASE("packing turns what can't stand in a GLB's chunk into data URIs") {
  using namespace patch_test;
  const scratch::Folder folder;
  npt::write_file(folder / "a.bin", "aaaa");
  npt::write_file(folder / "b.bin", "bbbbb");
  npt::write_file(folder / "p.png", "no picture");
  const std::string text = R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"a.bin"},{"uri":"b.bin",)"
                           R"("byteLength":5},{"byteLength":1,"uri":"data:;base64,AA"}],"images":[{"uri":"p.png"}]})";
  const std::string glb = npt::internal::GltfPacker(text, "x", folder.path()).pack();
  CHECK(npt::internal::GltfPacker(replaced(text, R"("byteLength":4)", R"("byteLength":4.0)"), "x", folder.path())
            .pack() == glb);
  CHECK(chunk_of(glb) == "aaaa");
  CHECK(
      without_blanks_behind(json_of(glb)) ==
      R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4},{"uri":"data:application/octet-stream;base64,YmJiYmI=",)"
      R"("byteLength":5},{"byteLength":1,"uri":"data:;base64,AA"}],)"
      R"("images":[{"uri":"data:application/octet-stream;base64,bm8gcGljdHVyZQ=="}]})");
  CHECK(error_of([&] { npt::internal::GltfPacker(text, "x", folder / "none").pack(); }).find("no such file") !=
        std::string::npos);
}

TEST_CASE("base64 there and back") {
  for (const std::string text : {"", "a", "ab", "abc", "abcd", "\xFF\xFE\x01"}) {
    const std::string coded = npt::internal::to_base64(text);
    CHECK(coded.size() % 4 == 0);
    CHECK(npt::internal::from_base64(coded) == text);
  }
  CHECK(npt::internal::to_base64("ab") == "YWI=");
}

TEST_CASE("members go and come without touching others") {
  using npt::internal::GltfText;
  const std::string text = R"({ "asset": {"version":"2.0"}, "a": 1.0 , "b" : { } })";
  for (const auto& [key, expected] : {std::pair{"a", R"({ "asset": {"version":"2.0"}, "b" : { } })"},
                                      std::pair{"b", R"({ "asset": {"version":"2.0"}, "a": 1.0 })"},
                                      std::pair{"asset", R"({ "a": 1.0 , "b" : { } })"}}) {
    GltfText document(text, "x");
    document.remove_member(document.root(), key);
    CHECK(document.changed() == expected);
  }
  GltfText document(text, "x");
  document.set_member(*document.root().find("b"), "c", "2");
  document.set_member(document.root(), "a", "[3]");
  document.add_item(document.root(), "list", "4");
  document.add_item(document.root(), "list", "5");
  CHECK(document.changed() == R"({ "asset": {"version":"2.0"}, "a": [3] , "b" : {"c":2 },"list":[4,5] })");
  npt::internal::TextEdits edits;
  edits.insert(1, "x"), edits.insert(1, "y"), edits.replace(0, 1, "");
  CHECK(edits.applied("ab") == "xyb");
}

TEST_CASE("real characters get their own clip again, and keep all else") {
  using namespace patch_test;
  std::size_t files = 0;
  double worst = 0;
  const std::filesystem::path data = NPT_SHARED "/data";
  for (const char* part : {"characters", "clips", "glb", "awkward"}) {
    if (!std::filesystem::exists(data / part)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data / part)) {
      const std::filesystem::path& path = entry.path();
      if (path.extension() != ".glb" && path.extension() != ".gltf" && path.extension() != ".vrm") continue;
      const std::string file = npt::read_file(path);
      if (json_of(file).find("KHR_draco_mesh_compression") != std::string_view::npos && !npt::internal::with_draco)
        continue;
      const npt::Scene scene = npt::parse_gltf(file, path.string(), path.parent_path());
      if (scene.clips.empty() || !npt::has_skeleton(scene)) continue;
      INFO(path.string());
      const npt::Motion old = npt::motion_of(scene, &scene.clips[0], path.string());
      if (old.clip.channels.empty()) continue;
      ++files;
      const std::string result = npt::with_motion(file, old, {.name = "put in"}, path);
      CHECK(chunk_of(result).starts_with(chunk_of(file)));
      const npt::internal::JsonValue tree = npt::internal::read_json_tree(json_of(file), "x");
      CHECK(as_before(json_of(result), tree) == as_tree(tree));
      npt::Scene again = npt::parse_gltf(result, path.string(), path.parent_path());
      REQUIRE(again.clips.size() == scene.clips.size() + 1);
      const npt::Motion fresh = npt::motion_of(again, &again.clips.back(), path.string());
      worst = std::max(worst, farthest_joints(old, fresh));
      again.clips.pop_back();
      CHECK(npt::format_gltf(again, "x") == npt::format_gltf(scene, "x"));

      // As a pose: the rest is the clip's middle, and each clip shows what it showed.
      const double middle = 0.5 * old.clip.length();
      const npt::Scene posed =
          npt::parse_gltf(npt::with_motion(file, old, {.apply = true, .time = middle}, path), path.string());
      REQUIRE(posed.clips.size() == scene.clips.size());
      const npt::Motion rest = npt::motion_of(posed, &posed.clips[0], path.string());
      const std::vector<npt::Vec3d> p = npt::joint_positions(rest, std::nullopt), q = npt::joint_positions(old, middle);
      for (std::size_t j = 0; j < std::min(p.size(), q.size()); ++j) worst = std::max(worst, length(p[j] - q[j]));
      for (std::size_t c = 0; c < scene.clips.size(); ++c)
        worst = std::max(worst, farthest_joints(npt::motion_of(scene, &scene.clips[c], "x"),
                                                npt::motion_of(posed, &posed.clips[c], "x")));
    }
  }
  if (files > 0) MESSAGE(files << " files, joints at most " << worst << " m off");
  CHECK(worst < 1e-5);
}
