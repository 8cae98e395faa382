#include "rigged_figure.hpp"

#include <doctest/doctest.h>

#include <npt/lab/rig/humanoid_joints.hpp>
#include <npt/lab/rig/joint_renaming.hpp>
#include <npt/lab/rig/rig_character.hpp>
#include <npt/lab/rig/rig_sampler.hpp>

#include <array>
#include <memory>
#include <string>

namespace {

npt::Scene kneeling_figure() {
  return rigged::figure({}, {{{}, rigged::turned(npt::SmplJoint::left_knee, 0.9F, 0, 0)}});
}

/// A figure whose joints have names that nobody knows.
npt::Rig foreign(const std::string& file) {
  npt::Rig rig = npt::make_rig(kneeling_figure(), file);
  for (std::size_t j = 0; j < rig.joint_count(); ++j) rig.scene.nodes[rig.joints[j]].name = "os " + std::to_string(j);
  return rig;
}

/// Lines that give a foreign figure its names back.
std::string translation() {
  std::string text = "# number  name\n";
  for (std::size_t j = 0; j < npt::smpl_joint_count; ++j)
    text += "'os " + std::to_string(j) + "' " + rigged::names[j] + "\n";
  return text;
}

void rename(npt::Rig& rig, const std::string& text) {
  const std::array<npt::Rig*, 1> all{&rig};
  npt::JointRenaming(text, "names.txt").apply(all);
}

std::string message(const std::string& text) {
  npt::Rig rig = foreign("a/knight.glb");
  try {
    rename(rig, text);
  } catch (const npt::Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("a person of foreign joint names is known by a list of names") {
  npt::Rig rig = foreign("knight.glb");
  rename(rig, translation());
  CHECK(npt::humanoid_joints(rig) == npt::humanoid_joints(npt::make_rig(kneeling_figure(), "knight.glb")));
}

TEST_CASE("characters share poses by a list of names") {
  const auto character = [](const npt::Rig& rig) { return std::make_shared<const npt::RigCharacter>(rig); };
  const npt::Rig own = npt::make_rig(kneeling_figure(), "knight.glb");
  npt::Rig other = foreign("other.glb");
  for (const bool renamed : {false, true}) {
    if (renamed) rename(other, "[other]\n" + translation());
    const npt::RigMixture mixture({{character(own), 1}, {character(other), 1}});
    CHECK(mixture.partners(0).size() == (renamed ? 2 : 1));
  }
}

TEST_CASE("a rig's own lines come before those for all; two joints may exchange their names") {
  npt::Rig rig = foreign("a/big knight.glb");
  rename(rig, "'os 1' 'os 2'\n'os 2' 'os 1'\n'os 3' hip\n\"[big knight]\"\n'os 3' knee\n");
  CHECK(rig.joint_name(1) == "os 2");
  CHECK(rig.joint_name(2) == "os 1");
  CHECK(rig.joint_name(3) == "knee");
  CHECK(rig.joint_name(4) == "os 4");
}

TEST_CASE("a list of names that can't be followed says where and why") {
  CHECK(message("'os 1' hip") == "no error");
  CHECK(message("# nothing\n") == "names.txt: found no names, expected lines of: joint other_name");
  CHECK(message("\na b c\n").find("names.txt: line 2: found 3 words, expected a joint and its other name") == 0);
  CHECK(message("'os 1 hip\n").find("line 1: found a quotation mark that is not closed") != std::string::npos);
  CHECK(message("'os 1' a\n'os 1' b\n").find("line 2: found joint 'os 1' again (line 1)") != std::string::npos);
  CHECK(message("[]\n").find("line 1: found no name in []") != std::string::npos);
  CHECK(message("[robot]\n'os 1' a\n") == "names.txt: line 2: found [robot], expected one of the rigs: knight");
  CHECK(message("Wheel a\n") == "names.txt: line 1: found joint 'Wheel', which no rig has, expected a joint of knight");
  CHECK(message("[knight]\nWheel a\n") ==
        "names.txt: line 2: found joint 'Wheel', which a/knight.glb doesn't have, expected the name of one of its 24 "
        "joints");
  CHECK(
      message("'os 1' 'os 7'\n") ==
      "names.txt: line 1: found a second joint 'os 7' in a/knight.glb, expected a name that no other joint of the rig "
      "has");
}
