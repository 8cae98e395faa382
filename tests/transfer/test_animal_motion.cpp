/// Clips of four-legged animals onto animals: of made skeletons, and of those beside the repository, where they are.
#include <doctest/doctest.h>

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_chains.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/io/file.hpp>
#include <npt/io/gltf_reader.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion_transfer.hpp>

#include <body/roles/animal_skeleton.hpp>
#include <body/roles/skeletons.hpp>
#include <support/needs.hpp>
#include <transfer/shipped.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace {

/// Each joint turns about an axis of its own, for a second.
npt::Motion with_clip(npt::Motion motion) {
  motion.clip.name = "clip";
  motion.rate = 10;
  for (std::size_t j = 0; j < motion.joints.size(); ++j) {
    npt::ClipChannel turn{j, npt::ChannelPath::rotation, npt::Interpolation::linear, 4, {}, {}};
    for (int f = 0; f <= 10; ++f) {
      const double angle = 0.3 * std::sin(f + static_cast<double>(j));
      const npt::Quaternion q =
          motion.joints[j].rest.rotation *
          npt::Quaternion{}.turned(npt::Vec3d{angle, 0.5 * angle * static_cast<double>(j % 3), 0.1 * angle});
      turn.times.push_back(static_cast<float>(f) / 10);
      for (const double c : {q.x, q.y, q.z, q.w}) turn.values.push_back(static_cast<float>(c));
    }
    motion.clip.channels.push_back(std::move(turn));
  }
  return motion;
}

/// Joints with a role of a motion, at their largest difference of world rotations from another one's, in degrees.
double largest_turn(const npt::Motion& made, const npt::Motion& wanted, const npt::JointRoles& roles) {
  double most = 0;
  const double end = wanted.clip.length();
  for (int i = 0; i <= 12; ++i) {
    const std::vector<npt::Affine> a = npt::joint_worlds(made, end * i / 12),
                                   b = npt::joint_worlds(wanted, end * i / 12);
    for (std::size_t j = 0; j < a.size(); ++j) {
      if (roles.role_of(j) == npt::JointRole::none) continue;
      const double cosine = std::abs(dot(npt::place_of(a[j]).rotation, npt::place_of(b[j]).rotation));
      most = std::max(most, 2 * std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi);
    }
  }
  return most;
}

npt::MotionOptions exact() {
  npt::MotionOptions options;
  options.retarget.key_tolerance = 0;
  return options;
}

const npt::Motion& made_animal() {
  static const npt::Motion motion = animal_skeleton::of_names(animal_skeleton::own_names());
  return motion;
}

}  // namespace

TEST_CASE("an animal takes its own clip as it is, also of a file that says nothing of how it was bound") {
  npt::Motion hero = made_animal();
  std::vector<npt::Affine> bound = npt::bound_worlds(hero);
  for (std::size_t j = 0; j < bound.size(); ++j) hero.joints[j].bind = bound[j];
  npt::Motion clip = with_clip(made_animal());
  for (npt::MotionJoint& joint : clip.joints)  // its rest is no standing one
    if (joint.name == "neck2") joint.rest.rotation = npt::Quaternion{}.turned(npt::Vec3d{0.5, 0, 0});
  const npt::MotionSkeleton target = npt::motion_skeleton(hero, "hero"), source = npt::motion_skeleton(clip, "clip");
  const npt::MotionResult made = npt::transfer_motion(source, target, exact());
  CHECK(made.warnings.empty());
  CHECK(made.confidence > 0.9);
  CHECK(largest_turn(made.motion, clip, target.roles) < 0.1);
}

TEST_CASE("animals of another build keep how they stand, with tails and spines of other lengths") {
  std::vector<animal_skeleton::Joint> joints = animal_skeleton::own_names();
  std::erase_if(joints, [](const auto& joint) { return joint.name == "tail5" || joint.name == "spine3"; });
  for (animal_skeleton::Joint& joint : joints) {
    if (joint.parent == "spine3") joint.parent = "spine2";
    joint.place = joint.place * 2.0;
    if (joint.name.ends_with("knee")) joint.place.z += 0.1;
  }
  const npt::MotionSkeleton target = npt::motion_skeleton(animal_skeleton::of_names(joints), "other");
  npt::Motion still = with_clip(made_animal());
  for (npt::ClipChannel& channel : still.clip.channels)
    for (std::size_t i = 0; i < channel.values.size(); ++i) channel.values[i] = i % 4 == 3 ? 1.0F : 0.0F;
  const npt::MotionResult made = npt::transfer_motion(npt::motion_skeleton(still, "still"), target, exact());
  CHECK(largest_turn(made.motion, target.motion, target.roles) < 0.01);
  const npt::MotionResult moved =
      npt::transfer_motion(npt::motion_skeleton(with_clip(made_animal()), "moves"), target, exact());
  CHECK(largest_turn(moved.motion, target.motion, target.roles) > 5);
}

TEST_CASE("an animal's motion on a person is refused, and a person's on an animal") {
  const npt::MotionSkeleton animal = npt::motion_skeleton(with_clip(made_animal()), "dog.bvh");
  skeletons::Person made = skeletons::person(skeletons::dialects().front());
  skeletons::add_clip(made);
  const npt::MotionSkeleton person = npt::motion_skeleton(made.motion, "hero.glb");
  const npt::ErrorParts on_person = shipped::error_of([&] { npt::transfer_motion(animal, person); });
  CHECK(on_person.file == "dog.bvh");
  CHECK(on_person.found == "a four-legged animal's motion on a person (hero.glb)");
  CHECK(on_person.expected == "a person's motion");
  CHECK(on_person.code == npt::ErrorCode::domains_differ);
  const npt::ErrorParts on_animal = shipped::error_of([&] { npt::transfer_motion(person, animal); });
  CHECK(on_animal.found == "a person's motion on a four-legged animal (dog.bvh)");
}

TEST_CASE("an animal that lacks a leg is told of in words of its own") {
  std::vector<animal_skeleton::Joint> joints = animal_skeleton::own_names();
  std::erase_if(joints, [](const auto& j) {
    return j.name == "l_elbow" || j.name == "l_wrist" || j.name == "l_forefoot" || j.name == "l_shoulder";
  });
  const npt::MotionSkeleton source = npt::motion_skeleton(animal_skeleton::of_names(joints), "three.glb");
  npt::MotionOptions options;
  options.time = 0;
  const npt::MotionResult made = npt::transfer_motion(source, npt::motion_skeleton(made_animal(), "four.glb"), options);
  REQUIRE(!made.warnings.empty());
  CHECK(npt::text_of(made.warnings.back(), "four.glb", "three.glb") ==
        "three.glb has no joint for leftForeUpperLeg, leftForeLowerLeg: it stays in the character's rest");
}

namespace {

npt::Scene shared_scene(const std::string& name) {
  const std::string file = std::string(NPT_SHARED) + "/data/glb/" + name + ".glb";
  return npt::parse_gltf(npt::read_file(file), file);
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// From one species' clips, without their mesh, to another: how far joints are from where the makers' own clip of the
/// same name has them, a share of the length from nose to tail; and how far those are from the rest.
struct Truth {
  double off = 0, moved = 0;
};
Truth truth(const std::string& from, const std::string& to) {
  const npt::Scene source = shared_scene(from), own = shared_scene(to);
  const npt::MotionSkeleton target = npt::motion_skeleton(own, to);
  const std::vector<npt::Affine> bound = npt::bound_worlds(target.motion);
  double low = std::numeric_limits<double>::infinity(), high = -low, count = 0;
  for (const std::size_t j : target.roles.joints)
    if (j != npt::no_item) low = std::min(low, bound[j].shift.z), high = std::max(high, bound[j].shift.z);
  Truth sum;
  for (const npt::Clip& clip : source.clips)
    for (const npt::Clip& same : own.clips) {
      if (lower(clip.name) != lower(same.name)) continue;
      npt::Motion motion = npt::motion_of(source, &clip, from);
      for (npt::MotionJoint& joint : motion.joints) joint.bind.reset();
      const npt::MotionResult made = npt::transfer_motion(npt::motion_skeleton(motion, from), target);
      const npt::Motion wanted = npt::motion_of(own, &same, to);
      for (int i = 0; i <= 12; ++i) {
        const std::vector<npt::Vec3d> a = npt::joint_positions(made.motion, clip.length() * i / 12),
                                      b = npt::joint_positions(wanted, same.length() * i / 12);
        for (const std::size_t j : target.roles.joints) {
          if (j == npt::no_item) continue;
          sum.off += length(a[j] - b[j]) / (high - low), sum.moved += length(bound[j].shift - b[j]) / (high - low);
          ++count;
        }
      }
    }
  REQUIRE(count > 0);
  return {sum.off / count, sum.moved / count};
}

}  // namespace

TEST_CASE("animals' clips, without a mesh, move other species as their makers move these" *
          support::needs_shared("data/glb/Horse.glb")) {
  // In hundredths of the length: 0.8 to 2.9 among hoofed animals and 1.8 between fox and dog, whose legs bend alike;
  // 4.6 to 8.5 between both groups, where the clips themselves differ. What stays at rest would be off by 6.7 to 13.5.
  struct Pair {
    std::string from, to;
    double most;
  };
  for (const Pair& pair : {Pair{"Horse", "Cow", 0.01},
                           {"Cow", "Horse", 0.013},
                           {"Donkey", "Deer", 0.026},
                           {"Deer", "Alpaca", 0.018},
                           {"Husky", "Fox", 0.022},
                           {"Fox", "Husky", 0.022},
                           {"Horse", "Fox", 0.055},
                           {"Fox", "Horse", 0.08},
                           {"Horse", "Horse", 0.005},
                           {"Fox", "Fox", 0.005}}) {
    const Truth made = truth(pair.from, pair.to);
    CAPTURE(pair.from);
    CAPTURE(pair.to);
    MESSAGE((100 * made.off) << " %, at rest " << (100 * made.moved) << " %");
    CHECK(made.off < pair.most);
    CHECK(made.off < made.moved);
  }
}

TEST_CASE("animals' clips, without a mesh, are on their own rig what they are in the file" *
          support::needs_shared("data/glb/Horse.glb")) {
  for (const char* name : {"Horse", "Donkey", "Cow", "Deer", "Alpaca", "Fox", "Husky"}) {
    CAPTURE(std::string(name));
    const npt::Scene scene = shared_scene(name);
    const npt::MotionSkeleton target = npt::motion_skeleton(scene, name);
    for (const npt::Clip& clip : scene.clips) {
      npt::Motion motion = npt::motion_of(scene, &clip, name);
      for (npt::MotionJoint& joint : motion.joints) joint.bind.reset();
      const npt::MotionResult made = npt::transfer_motion(npt::motion_skeleton(motion, name), target, exact());
      CHECK(largest_turn(made.motion, motion, target.roles) < 0.1);
    }
  }
}
