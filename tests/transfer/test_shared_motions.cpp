/// Clips onto the characters beside the repository, where they are there.
#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/body/roles/placed_motion.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/file.hpp>
#include <npt/io/gltf_reader.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/transfer/motion_transfer.hpp>

#include <support/needs.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace {

std::filesystem::path shared_file(const std::string& name) { return std::filesystem::path(NPT_SHARED) / "data" / name; }

npt::MotionSkeleton shared_clip(const std::string& name) {
  const std::filesystem::path file = shared_file(name);
  if (file.extension() == ".bvh")
    return npt::motion_skeleton(npt::placed_motion(npt::motion_of(npt::read_bvh(file), "clip")), name);
  const npt::Scene scene = npt::parse_gltf(npt::read_file(file), name);
  return npt::motion_skeleton(npt::motion_of(scene, &scene.clips.back(), name), name);
}

npt::MotionSkeleton shared_character(const std::filesystem::path& file) {
  return npt::motion_skeleton(npt::parse_gltf(npt::read_file(file), file.string()), file.filename().string());
}

/// The largest change of a bone's length over a clip, a share of the figure's size.
double bone_change(const npt::Motion& motion) {
  double most = 0, size = 0;
  const auto first = npt::joint_worlds(motion, 0.0);
  for (const npt::Affine& world : first) size = std::max(size, npt::length(world.shift - first[0].shift));
  for (int i = 1; i <= 4; ++i) {
    const auto now = npt::joint_worlds(motion, motion.clip.length() * i / 4);
    for (std::size_t j = 0; j < now.size(); ++j) {
      const std::size_t parent = motion.joints[j].parent;
      const bool moves = std::ranges::any_of(motion.clip.channels, [j](const npt::ClipChannel& channel) {
        return channel.node == j && channel.path == npt::ChannelPath::translation && channel.times.size() > 1;
      });
      if (parent == npt::no_item || moves) continue;
      most = std::max(most, std::abs(npt::bone_length(motion, now, j) - npt::bone_length(motion, first, j)) / size);
    }
  }
  return most;
}

}  // namespace

TEST_CASE("every clip goes onto every rigged person, and no bone changes its length" *
          support::needs_shared("data/characters/humanoids")) {
  std::vector<npt::MotionSkeleton> clips;
  for (const char* name : {"clips/cmu_02_01.bvh", "clips/fair_dab.bvh", "clips/kk_med_movementbasic.glb",
                           "clips/qmodular_clips.glb", "awkward/walk_other_names.bvh", "awkward/clip_without_mesh.glb"})
    clips.push_back(shared_clip(name));
  std::size_t pairs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(shared_file("characters/humanoids"))) {
    if (entry.path().extension() != ".glb") continue;
    const npt::MotionSkeleton character = shared_character(entry.path());
    for (const npt::MotionSkeleton& clip : clips) {
      const npt::MotionResult made = npt::transfer_motion(clip, character);
      CHECK_MESSAGE(bone_change(made.motion) < 1e-6, character.name << ", " << clip.name);
      CHECK_MESSAGE(std::abs(made.motion.clip.length() - clip.motion.clip.length()) < 1e-6, character.name);
      ++pairs;
    }
  }
  CHECK(pairs >= 200);
}

TEST_CASE("a horse's clip is refused for a person" * support::needs_shared("data/awkward")) {
  const npt::MotionSkeleton person = shared_character(shared_file("glb/Knight.glb"));
  CHECK_THROWS_WITH(npt::transfer_motion(shared_clip("awkward/clip_of_a_horse_without_mesh.glb"), person),
                    doctest::Contains("a four-legged animal's motion on a person (Knight.glb)"));
}
