/// What the tests in Python and JavaScript look at: dump_gltf FILE FOLDER writes
///   frames.bin   for some times of each clip: clip, time, then the vertices, all in double
///   scene.glb    the scene, written again; mesh.glb: as one mesh; rest.bin: the vertices as the scene stands
///   clip.glb     the file with its first clip once more, and applied.glb, with the middle of that as its rest
/// dump_gltf --joints FILE OUT.json writes where the joints are, in metres with y up: at rest, and at some times of each
/// clip. dump_gltf --made FOLDER writes GLB files of every kind that npt makes.
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_patch.hpp>
#include <npt/io/json.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>

#include <npt/body/mannequin/mannequin.hpp>

#include <mesh/zoo.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

void write_doubles(const fs::path& path, const std::vector<double>& numbers) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(numbers.data()), static_cast<std::streamsize>(8 * numbers.size()));
}

/// A file with its first clip once more, and another with the middle of that as its rest.
void write_patched(const fs::path& file, const npt::Scene& scene, const fs::path& clip, const fs::path& applied) {
  if (scene.clips.empty() || !npt::has_skeleton(scene)) return;
  const npt::Motion motion = npt::motion_of(scene, &scene.clips[0], file.string());
  npt::write_with_motion(file, motion, {.name = "once more"}, clip);
  npt::write_with_motion(file, motion, {.apply = true, .time = 0.5 * motion.clip.length()}, applied);
}

void dump(const fs::path& file, const fs::path& folder) {
  const npt::Scene scene = npt::read_scene(file);
  const npt::ScenePoser poser(scene, file.string());
  npt::Mesh mesh = poser.mesh();
  npt::write_scene(folder / "scene.glb", scene);
  npt::write_gltf(folder / "mesh.glb", mesh);
  write_patched(file, scene, folder / "clip.glb", folder / "applied.glb");
  std::vector<double> rest, frames;
  for (const float x : mesh.coordinates()) rest.push_back(static_cast<double>(x));
  write_doubles(folder / "rest.bin", rest);
  for (std::size_t c = 0; c < scene.clips.size(); ++c)
    for (const double part : {0.0, 0.137, 0.5, 0.911, 1.0}) {
      const double time = part * scene.clips[c].length();
      poser.positions(&scene.clips[c], time, mesh.coordinates());
      frames.push_back(static_cast<double>(c));
      frames.push_back(time);
      for (const float x : mesh.coordinates()) frames.push_back(static_cast<double>(x));
    }
  write_doubles(folder / "frames.bin", frames);
  std::printf("%zu vertices, %zu clips\n", mesh.vertex_count(), scene.clips.size());
}

template <class Items, class Append>
void append_list(std::string& json, const Items& items, Append append) {
  json += '[';
  for (const auto& item : items) {
    if (json.back() != '[') json += ',';
    append(item);
  }
  json += ']';
}

/// `clip`: as JSON; times: empty: at rest
void append_places(std::string& json, const npt::Motion& motion, const std::string& clip, std::vector<double> times) {
  const bool at_rest = times.empty();
  if (at_rest) times = {0};
  const auto number = [&](double value) { npt::append_number(json, value); };
  json += "{\"clip\":" + clip + ",\"times\":";
  append_list(json, times, number);
  json += ",\"joints\":";
  append_list(json, motion.joints, [&](const npt::MotionJoint& joint) {
    json += "{\"node\":" + std::to_string(joint.node) + ",\"name\":";
    npt::internal::append_json_string(json, joint.name);
    json += '}';
  });
  json += ",\"places\":";
  append_list(json, times, [&](double time) {
    append_list(json, npt::joint_positions(motion, at_rest ? std::nullopt : std::optional(time)), [&](npt::Vec3d p) {
      append_list(json, std::array{p.x, p.y, p.z}, number);
    });
  });
  json += '}';
}

void write_joints(const fs::path& file, const fs::path& to) {
  const npt::Scene scene = npt::read_scene(file);
  std::string json = "[";
  append_places(json, npt::motion_of(scene, nullptr, file.string()), "null", {});
  for (const npt::Clip& clip : scene.clips) {
    std::vector<double> times;  // on quarters of frames: players sample curves before they play them
    for (int i = 0; i <= 8; ++i) times.push_back(std::floor(clip.length() * 15 * i + 1e-3) / 120);
    std::string name;
    npt::internal::append_json_string(name, clip.name);
    append_places(json += ',', npt::motion_of(scene, &clip, file.string()), name, times);
  }
  std::ofstream(to) << json << "]\n";
}

/// A chain of three joints along a mesh's y axis, each vertex between the two next to it.
npt::SkinnedSkeleton chain(const npt::Mesh& mesh) {
  npt::SkinnedSkeleton skeleton{.names = {"hips", "spine", "head"},
                                .parents = {npt::SkinnedSkeleton::no_parent, 0, 1},
                                .joints = {{0, 0, 0}, {0, 0.5, 0}, {0, 1, 0}},
                                .start = {0},
                                .influences = {}};
  for (const npt::Vec3f p : mesh.positions) {
    const float t = std::fmin(std::fmax(p.y, 0.0F), 1.0F);
    skeleton.influences.push_back({0, 0.5F * (1 - t)});
    skeleton.influences.push_back({1, 0.5F});
    skeleton.influences.push_back({2, 0.5F * t});
    skeleton.start.push_back(skeleton.influences.size());
  }
  return skeleton;
}

void write_made(const fs::path& folder) {
  npt::Mesh coloured = zoo::cube();
  for (const char* name : {"red", "green", "blue", "alpha"})
    coloured.properties.push_back({name, "uchar", std::vector<double>(coloured.vertex_count(), 128)});
  npt::Mesh points = zoo::cloud();
  npt::write_gltf(folder / "mixed.glb", zoo::mixed());
  npt::write_gltf(folder / "hard_cube.glb", zoo::hard_cube());
  npt::write_gltf(folder / "coloured.glb", coloured);
  npt::write_gltf(folder / "points.glb", points);

  const npt::Mesh body = npt::to_mesh(npt::mannequin(), std::vector<float>(npt::mannequin().shape_count()),
                                      std::vector<float>(3 * npt::mannequin().joint_count()));
  const std::vector<double> times{0, 0.5, 1};
  npt::MeshScene rigged = npt::scene_from(body, "body");
  const npt::SkinnedSkeleton skeleton = chain(body);
  const std::size_t first = npt::add_skeleton(rigged, skeleton);
  std::vector<std::vector<npt::Affine>> motions;
  for (const double t : times) {
    const npt::Quaternion half{0, std::sin(t / 2), 0, std::cos(t / 2)};
    motions.push_back(std::vector<npt::Affine>(3, {npt::matrix_of(half), {t, 0, 0}}));
  }
  npt::add_skeleton_clip(rigged, skeleton, first, "turn", times, motions);
  npt::write_scene(folder / "rigged.glb", rigged.scene);
  write_patched(folder / "rigged.glb", rigged.scene, folder / "clip.glb", folder / "applied.glb");

  npt::MeshScene morphed = npt::scene_from(body, "body");
  std::vector<std::vector<float>> frames;
  for (const double t : times) {
    const auto xyz = body.coordinates();
    frames.emplace_back(xyz.begin(), xyz.end());
    for (float& x : frames.back()) x *= static_cast<float>(1 + t);
  }
  npt::add_morph_clip(morphed, body, "grow", times, frames);
  npt::write_scene(folder / "morphed.glb", morphed.scene);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string first = argc > 1 ? argv[1] : "";
    if (argc != (first == "--joints" ? 4 : 3))
      throw npt::Error({"dump_gltf", {}, "other arguments", "FILE FOLDER, --joints FILE OUT.json or --made FOLDER"});
    if (first == "--joints")
      write_joints(argv[2], argv[3]);
    else if (first == "--made")
      write_made(argv[2]);
    else
      dump(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "dump_gltf: %s\n", error.what());
    return 1;
  }
}
