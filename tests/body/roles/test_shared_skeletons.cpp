/// Joint roles and retargeting on real skeletons beside the repository, where they are there.
#include <doctest/doctest.h>

#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/placed_motion.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/file.hpp>
#include <npt/io/gltf_reader.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>
#include <npt/transfer/motion/motion_warning.hpp>
#include <npt/transfer/retarget.hpp>

#include <support/needs.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

npt::Motion motion_in(const fs::path& file) {
  if (file.extension() == ".bvh") return npt::placed_motion(npt::motion_of(npt::read_bvh(file), "clip"));
  const npt::Scene scene = npt::parse_gltf(npt::read_file(file), file.string());
  return npt::motion_of(scene, scene.clips.empty() ? nullptr : &scene.clips.back(), file.string());
}

npt::JointRoles roles_without_names(npt::Motion motion) {
  for (npt::MotionJoint& joint : motion.joints) joint.name = "";
  return npt::joint_roles(motion);
}

std::vector<fs::path> files_in(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(NPT_SHARED) / folder))
    if (entry.path().extension() == ".bvh" || entry.path().extension() == ".glb") files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

}  // namespace

TEST_CASE("the shape of real skeletons gives the roles that their names give" *
          support::needs_shared("data/characters/humanoids")) {
  std::size_t roles = 0, same = 0, whole = 0, files = 0;
  for (const char* folder : {"data/characters/humanoids", "data/clips"})
    for (const fs::path& file : files_in(folder)) {
      const npt::Motion motion = motion_in(file);
      const npt::JointRoles named = npt::joint_roles(motion), shaped = roles_without_names(motion);
      ++files;
      whole += named.confidence > 0.9 ? 1U : 0U;
      for (std::size_t r = 0; r < npt::joint_role_count; ++r) {
        if (named.joints[r] == npt::no_item) continue;
        ++roles;
        same += named.joints[r] == shaped.joints[r] ? 1U : 0U;
      }
    }
  MESSAGE(files << " files, " << whole << " of them with confidence over 0.9; " << same << " of " << roles
                << " roles by shape as by name");
  // A rigid figure of seven parts, one without arms, one whose arms are called legs, one of other words, and a sage whose
  // sleeves have given his skeleton collar bones as long as his arms.
  CHECK(files - whole <= 5);
  CHECK(static_cast<double>(same) > 0.97 * static_cast<double>(roles));
}

TEST_CASE("creatures are animals, refused, or a warning says that they are hardly people; no figure is" *
          support::needs_shared("data/characters")) {
  const auto doubted = [](const fs::path& file) {
    const npt::JointRoles roles = npt::joint_roles(motion_in(file));
    if (roles.kind() == npt::SkeletonKind::four_legged) return true;
    if (roles.confidence < npt::least_skeleton_confidence) return true;
    const std::vector<npt::MotionWarning> warnings = npt::motion_warnings(roles, roles);
    return std::ranges::find(warnings, npt::MotionWarningCode::joints_uncertain, &npt::MotionWarning::code) !=
           warnings.end();
  };
  for (const fs::path& file : files_in("data/characters/creatures"))
    if (file.stem() != "qcyber_enemy_2legs")  // a robot without arms, as one of the figures is: that is what it says
      CHECK_MESSAGE(doubted(file), file.string());
  for (const fs::path& file : files_in("data/characters/humanoids")) CHECK_MESSAGE(!doubted(file), file.string());
}

TEST_CASE("a clip without mesh has the same roles with a prefix before its names, and without names" *
          support::needs_shared("data/awkward/clip_without_mesh.glb")) {
  const fs::path folder = fs::path(NPT_SHARED) / "data/awkward";
  const npt::JointRoles named = npt::joint_roles(motion_in(folder / "clip_without_mesh.glb"));
  const npt::JointRoles nameless = npt::joint_roles(motion_in(folder / "clip_without_mesh_nameless.glb"));
  CHECK(npt::joint_roles(motion_in(folder / "clip_without_mesh_prefixed.glb")).joints == named.joints);
  CHECK(nameless.confidence > 0.5);
  for (std::size_t r = 0; r < npt::joint_role_count; ++r) {
    const auto role = static_cast<npt::JointRole>(r);
    // All fingers are one chain of two joints, of which the first is called a hand's.
    const bool finger = npt::is_of_digit(role) && npt::part_of(role) >= npt::digit_part(1, 0);
    if (!finger) CHECK_MESSAGE(nameless.joints[r] == named.joints[r], npt::role_name(role));
  }
  CHECK(npt::joint_roles(motion_in(folder / "walk.bvh")).joints ==
        npt::joint_roles(motion_in(folder / "walk_other_names.bvh")).joints);
}

TEST_CASE("animals' skeletons are known by their names, and by their shape where these are gone" *
          support::needs_shared("data/glb/Horse.glb")) {
  const fs::path folder = fs::path(NPT_SHARED) / "data";
  std::size_t roles = 0, same = 0;
  for (const char* name : {"glb/Horse", "glb/Donkey", "glb/Cow", "glb/Deer", "glb/Alpaca", "glb/Fox", "glb/Husky",
                           "awkward/clip_of_a_horse_without_mesh", "characters/creatures/qdino_triceratops",
                           "characters/creatures/qdino_apatosaurus", "characters/creatures/qdino_stegosaurus"}) {
    CAPTURE(name);
    const npt::Motion motion = motion_in(folder / (std::string(name) + ".glb"));
    const npt::JointRoles named = npt::joint_roles(motion), shaped = roles_without_names(motion);
    CHECK(named.kind() == npt::SkeletonKind::four_legged);
    CHECK(named.confidence > 0.9);
    CHECK(shaped.kind() == npt::SkeletonKind::four_legged);
    CHECK(shaped.confidence > 0.6);
    for (std::size_t r = 0; r < npt::joint_role_count; ++r) {
      if (named.joints[r] == npt::no_item) continue;
      ++roles;
      same += named.joints[r] == shaped.joints[r] ? 1U : 0U;
    }
  }
  MESSAGE(same << " of " << roles << " roles by shape as by name");
  CHECK(static_cast<double>(same) > 0.85 * static_cast<double>(roles));
  CHECK(npt::joint_roles(motion_in(folder / "characters/creatures/qdino_trex.glb")).confidence < 0.3);
}

TEST_CASE("clips without mesh that differ in their names alone give a character the same motion" *
          support::needs_shared("data/characters/humanoids/quac_witch.glb")) {
  const npt::Motion target = motion_in(fs::path(NPT_SHARED) / "data/characters/humanoids/quac_witch.glb");
  const npt::JointRoles roles = npt::joint_roles(target);
  const auto on_target = [&](const char* name) {
    const npt::Motion motion = motion_in(fs::path(NPT_SHARED) / "data/awkward" / name);
    return npt::retarget(motion, npt::joint_roles(motion), target, roles);
  };
  const auto difference = [&](const npt::Motion& a, const npt::Motion& b) {
    double most = 0;
    for (int f = 0; f <= 30; ++f) {
      const double time = f / 30.0 * a.clip.length();
      const auto x = npt::joint_positions(a, time), y = npt::joint_positions(b, time);
      for (std::size_t j = 0; j < x.size(); ++j)
        if (const npt::JointRole role = roles.role_of(j); role != npt::JointRole::none && !npt::is_of_digit(role))
          most = std::max(most, npt::length(x[j] - y[j]));
    }
    return most;
  };
  const npt::Motion clip = on_target("clip_without_mesh.glb"), walk = on_target("walk.bvh");
  CHECK(clip.clip.length() > 0.5);
  CHECK(difference(clip, on_target("clip_without_mesh_prefixed.glb")) < 1e-6);
  CHECK(difference(clip, on_target("clip_without_mesh_nameless.glb")) < 1e-6);
  CHECK(walk.clip.length() == doctest::Approx(0.8).epsilon(1e-3));  // 25 frames
  CHECK(difference(walk, on_target("walk_other_names.bvh")) < 1e-6);
}

TEST_CASE("drawings' clips are found to be z up, and CMU's in its unit" * support::needs_shared("data/clips")) {
  const fs::path folder = fs::path(NPT_SHARED) / "data/clips";
  CHECK(npt::up_axis(motion_in(folder / "fair_dab.bvh")) == "z");
  CHECK(npt::up_axis(motion_in(folder / "cmu_02_01.bvh")) == "y");
  CHECK(npt::metres_a_unit(motion_in(folder / "cmu_02_01.bvh")) == doctest::Approx(0.05644));
}
