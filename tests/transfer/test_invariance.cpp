#include <doctest/doctest.h>

#include <npt/body/kind_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/points.hpp>
#include <npt/scene/clip_frames.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "support/needs.hpp"
#include "transfer/changed_meshes.hpp"
#include "transfer/shipped.hpp"

namespace {

using changed_meshes::Change;
using npt::MeshRole;

/// A mannequin in a natural pose.
npt::Mesh person(std::uint64_t seed) {
  npt::Random random(811, seed);
  return npt::to_mesh(npt::mannequin(), std::vector<float>{0.5F, -0.5F}, npt::natural_poses().sample(random));
}

const npt::PoseTransfer& people() {
  static const npt::PoseTransfer opened = npt::PoseTransfer::open(shipped::weights(), {.method = npt::Method::body}, 1);
  return opened;
}

constexpr const char* animal_weights = "quadruped.safetensors";
const npt::PoseTransfer& animals() {
  static const npt::PoseTransfer opened =
      npt::PoseTransfer::open(shipped::weights(animal_weights), {.method = npt::Method::body}, 1);
  return opened;
}

/// The template of the animals' weights, of a shape and in one of their poses, a third as bent.
npt::Mesh animal(float shape, std::size_t number) {
  static const auto kind = npt::load_body_kind(npt::SafetensorsFile::read(shipped::weights(animal_weights)));
  std::vector<float> pose = kind->poses.at(number);
  for (float& angle : pose) angle /= 3;
  return npt::to_mesh(*kind->body, std::vector<float>{shape, -shape}, pose);
}

/// An animal beside the repository, in its walk at a second, or at rest.
npt::Mesh shared_animal(const std::string& name, std::optional<double> second) {
  const std::string file = NPT_SHARED "/data/glb/" + name + ".glb";
  npt::ClipFrames frames(npt::read_scene(file), name, {.clip = "AnimalArmature|Walk", .time = second.value_or(0)});
  return second ? frames.frame(0) : frames.at_rest();
}

/// The other mesh of a transfer: its pose where the first one is the identity.
struct Partner {
  const npt::PoseTransfer& transfer;
  npt::Character character{};
  npt::Pose pose{};

  Partner(const npt::PoseTransfer& all, const npt::Mesh& mesh, MeshRole role) : transfer(all) {
    if (role == MeshRole::pose)
      character = transfer.character(mesh);
    else
      pose = transfer.pose(mesh);
  }
};

struct Transferred {
  npt::Mesh mesh;
  double confidence = 0;  ///< of the first mesh
};
Transferred transferred(const npt::Mesh& mesh, const Partner& partner, MeshRole role) {
  if (role == MeshRole::pose) {
    const npt::Pose pose = partner.transfer.pose(mesh);
    return {partner.transfer.apply(partner.character, pose).mesh, pose.confidence().value()};
  }
  const npt::Character character = partner.transfer.character(mesh);
  return {partner.transfer.apply(character, partner.pose).mesh, character.confidence().value()};
}

/// Whatever is done to the mesh, the result is the same to a share of its longest side in the mean, and the confidence
/// to 0.03.
void check_changes(const npt::PoseTransfer& transfer, const npt::Mesh& mesh, const npt::Mesh& other, MeshRole role,
                   double most) {
  const Partner partner(transfer, other, role);
  const Transferred plain = transferred(mesh, partner, role);
  const std::vector<npt::Vec3d> expected = changed_meshes::undone(plain.mesh, {}, role);
  const double side = npt::bounding_box(plain.mesh.coordinates()).longest_side();
  for (const Change& change : changed_meshes::changes()) {
    INFO(change.name);
    const npt::Mesh changed = changed_meshes::changed(mesh, change);
    const Transferred made =
        change.mirrors() ? transferred(changed, Partner(transfer, changed_meshes::changed(other, change), role), role)
                         : transferred(changed, partner, role);
    const std::vector<npt::Vec3d> points = changed_meshes::undone(made.mesh, change, role);
    const changed_meshes::Distance off = changed_meshes::distance(points, expected, side, change.turns());
    CAPTURE(off.largest);
    CHECK(off.mean < most);
    CHECK(std::abs(made.confidence - plain.confidence) < 0.03);
  }
}

/// Of people, to 5 mm.
void check_changes(const npt::Mesh& mesh, MeshRole role) { check_changes(people(), mesh, person(7), role, 0.005); }
/// Of animals, to a sixtieth of their length.
void check_animals(const npt::Mesh& mesh, const npt::Mesh& other, MeshRole role) {
  check_changes(animals(), mesh, other, role, 0.0175);
}

}  // namespace

TEST_CASE("changes are undone") {
  const npt::Mesh mesh = shipped::person(0.3F);
  const std::vector<Change> all = changed_meshes::changes();
  CHECK(all.size() == 11);
  CHECK(std::ranges::count_if(all, &Change::turns) == 6);
  for (const Change& change : all) {
    const npt::Mesh changed = changed_meshes::changed(mesh, change);
    if (change.turns()) continue;  // of an identity, which doesn't turn its result
    const auto undone = changed_meshes::undone(changed, change, MeshRole::identity);
    CHECK(changed_meshes::distance(undone, changed_meshes::undone(mesh, {}, MeshRole::identity), 1.75, false).largest <
          1e-5);
  }
}

// Of this mannequin the largest distance of a vertex is 9 mm, the largest mean 1.7 mm, both of the mirrored one.
TEST_CASE("a pose is the same whatever the scale, direction, place, handedness and order of its mesh") {
  check_changes(person(2), MeshRole::pose);
}
TEST_CASE("so is what an identity becomes") { check_changes(person(2), MeshRole::identity); }

// 741 vertices: up to 23 mm, and 5.02 mm in the mean.
TEST_CASE("so is that of a coarse mesh" * support::needs_shared("data/other_topology/proxy741_m_heavy_tpose.obj")) {
  check_changes(people(), npt::read_mesh(NPT_SHARED "/data/other_topology/proxy741_m_heavy_tpose.obj"), person(7),
                MeshRole::pose, 0.006);
}

// A stylised king, whose rest is his own: up to 1.5 mm in the mean, the mirrored one 4.9 mm at most.
TEST_CASE("what a character becomes is, too" * support::needs_shared("data/characters/humanoids/qmen_king.glb")) {
  check_changes(npt::read_mesh(NPT_SHARED "/data/characters/humanoids/qmen_king.glb"), MeshRole::identity);
}

TEST_CASE("an animal's pose is the same whatever is done to its mesh") {
  check_animals(animal(0.8F, 1), animal(-0.8F, 2), MeshRole::pose);
}
// The mirrored one by 1.6 % in the mean: its rest is inferred a little otherwise. The others by 1.2 % at most.
TEST_CASE("so is what an animal becomes") { check_animals(animal(0.8F, 1), animal(-0.8F, 2), MeshRole::identity); }

// Mirrored by 1.4 %, the same pair twice: they have other sample points, and a fit ends elsewhere. The others by 0.8 %
// at most.
TEST_CASE("so are those of two species" * support::needs_shared("data/glb/Horse.glb")) {
  check_animals(shared_animal("Fox", 0.5), shared_animal("Horse", std::nullopt), MeshRole::pose);
  check_animals(shared_animal("Horse", std::nullopt), shared_animal("Fox", 0.5), MeshRole::identity);
}
