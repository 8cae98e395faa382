/// The shipped weights of four-legged animals on the animals and people beside the repository, where they are there.
#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/ply.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/scene/clip_frames.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "support/needs.hpp"

namespace {

const std::filesystem::path weights = NPT_SOURCE_DIR "/examples/weights/quadruped.safetensors";
const std::filesystem::path data = NPT_SHARED "/data";

/// The shared data, and weights with a template of the kind.
support::Needs needs_animals() {
  if (!std::filesystem::exists(data / "glb/Horse.glb") || !std::filesystem::exists(data / "humans/f_heavy"))
    return {false, "../shared/data/glb and humans"};
  const bool has_template = !npt::SafetensorsFile::read(weights).part("body/").tensors().empty();
  return {has_template, "a template in examples/weights/quadruped.safetensors"};
}

const npt::PoseTransfer& transfer() {
  static const npt::PoseTransfer opened = npt::PoseTransfer::open(weights, {}, 1);
  return opened;
}

/// An animal in its walk, half a second on; no clip: as its file has it.
npt::Mesh animal(const std::string& name, bool walks) {
  const std::filesystem::path file = data / "glb" / (name + ".glb");
  npt::ClipFrames frames(npt::read_scene(file), name, {.clip = "AnimalArmature|Walk", .time = 0.5});
  return walks ? frames.frame(0) : frames.at_rest();
}

struct Box {
  npt::Vec3f low, high;
  double length() const { return static_cast<double>(std::max({high.x - low.x, high.y - low.y, high.z - low.z})); }
};
Box box_of(const npt::Mesh& mesh) {
  Box box{mesh.positions.front(), mesh.positions.front()};
  for (const npt::Vec3f p : mesh.positions) {
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
  }
  return box;
}

/// The mean distance of vertices from each other, when their means are in one place.
double mean_distance(const npt::Mesh& a, const npt::Mesh& b) {
  REQUIRE(a.vertex_count() == b.vertex_count());
  const double count = static_cast<double>(a.vertex_count());
  npt::Vec3d shift;
  for (std::size_t v = 0; v < a.vertex_count(); ++v) shift += (b.positions[v] - a.positions[v]).as<double>() / count;
  double sum = 0;
  for (std::size_t v = 0; v < a.vertex_count(); ++v)
    sum += npt::length((b.positions[v] - a.positions[v]).as<double>() - shift);
  return sum / count;
}

}  // namespace

TEST_CASE("a horse takes the pose of a walking fox and of a cow, and stays a horse" * needs_animals()) {
  const npt::Mesh mesh = animal("Horse", false);
  const npt::Character horse = transfer().character(mesh, "horse");
  CHECK(horse.confidence().value_or(0) >= 0.85);
  const Box own = box_of(mesh);
  for (const char* name : {"Fox", "Cow"}) {
    CAPTURE(name);
    const npt::Pose pose = transfer().pose(animal(name, true));
    CHECK(pose.confidence().value_or(0) >= 0.85);
    const npt::Result result = transfer().apply(horse, pose);
    CHECK(result.method == npt::Method::body);
    CHECK(result.mesh.vertex_count() == mesh.vertex_count());
    const Box posed = box_of(result.mesh);
    CHECK(posed.length() > 0.7 * own.length());
    CHECK(posed.length() < 1.4 * own.length());
    CHECK(posed.high.y - posed.low.y > 0.6F * (own.high.y - own.low.y));
    CHECK(mean_distance(mesh, result.mesh) > 0.005 * own.length());
  }
}

namespace {

/// How far a horse in its own pose is from itself, a share of its length.
double off_in_own_pose() {
  const npt::Mesh mesh = animal("Horse", false);
  const npt::Result result = transfer().apply(transfer().character(mesh, "horse"), transfer().pose(mesh));
  return mean_distance(mesh, result.mesh) / box_of(mesh).length();
}

}  // namespace

TEST_CASE("a horse in its own pose is where it was" * needs_animals()) { CHECK(off_in_own_pose() < 0.02); }

TEST_CASE("a person is no four-legged animal" * needs_animals()) {
  const npt::Pose person = transfer().pose(npt::read_ply(data / "humans/f_heavy/table6_0.ply"));
  CHECK(person.confidence().value_or(0) < 0.6);
}
