#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/transfer/network_correction.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "estimate/people.hpp"

namespace {

const people::Bodies& bodies() {
  static const people::Bodies shipped;
  return shipped;
}

const npt::NetworkCorrection& correction() {
  static const npt::NetworkCorrection shipped(
      npt::SafetensorsFile::read(NPT_SOURCE_DIR "/examples/weights/human.safetensors").part("network_correction/"),
      npt::DefaultExecutor(1));
  return shipped;
}

npt::Mesh mannequin_of(float build, std::span<const float> pose) {
  return npt::to_mesh(npt::mannequin(), std::vector<float>{build, -build}, pose);
}

/// A pose of Table 6, which the network knows.
std::array<float, 72> table6_pose(std::uint64_t seed) {
  npt::Random random(seed);
  return npt::sample_pose(random);
}

/// Two people in a pose of Table 6, read as if their meshes kept the distance of another body model's.
struct Pair {
  std::array<float, 72> pose;
  npt::Mesh identity, posed, truth;
  npt::BoundCharacter character;
  npt::BodyEstimate reading;

  explicit Pair(std::array<float, 72> of_pose, double distance = 0.006)
      : pose(of_pose),
        identity(mannequin_of(1.5F, std::array<float, 72>{})),
        posed(mannequin_of(-1.5F, pose)),
        truth(mannequin_of(1.5F, pose)),
        character(bodies().bind(npt::MeshView{identity.coordinates(), npt::mannequin().triangles(), "identity"})),
        reading(bodies().read(npt::MeshView{posed.coordinates(), npt::mannequin().triangles(), "pose"})) {
    character.estimate.fit.relative_distance = reading.fit.relative_distance = distance;
  }
  /// PMD of the transfer with joint angles, bounding boxes centred.
  double error(std::span<const float> angles) const {
    std::vector<float> result(truth.coordinates().size()), expected(result.size());
    bodies().pose(character, angles, result);
    const auto centre = [](std::span<const float> from, std::span<float> to) {
      npt::normalising_transform(from, npt::Normalisation::centre, "points").apply(from, to);
    };
    centre(result, result);
    centre(truth.coordinates(), expected);
    return npt::pmd(result, expected);
  }
};

std::vector<float> fitted(const Pair& pair) {
  return pair.character.angles(bodies().kind(), pair.reading.fit.body.axis_angles, pair.reading);
}
std::vector<float> asked(const Pair& pair) {
  return correction().angles(bodies().kind(), pair.character, pair.reading, fitted(pair));
}

}  // namespace

TEST_CASE("angles that are a little wrong come nearer to the truth, by at most the network's share") {
  for (const std::uint64_t seed : {3U, 4U}) {
    CAPTURE(seed);
    Pair pair(table6_pose(seed));
    std::vector<float>& angles = pair.reading.fit.body.axis_angles;
    // As where a spine is misread: the body leans by 3 degrees, the trunk by 6.
    for (const std::size_t j : {0U, 3U}) angles[3 * j] += 0.05F;
    const double before = pair.error(fitted(pair));
    const std::vector<float> corrected = asked(pair);
    REQUIRE(corrected.size() == 3 * npt::fingered_joint_count);
    CHECK(before > 8e-4);
    CHECK(pair.error(corrected) < 0.87 * before);  // 0.82 for one of them, with the shipped network
    CHECK(corrected == asked(pair));
  }
}

TEST_CASE("bodies of the fitted kind, strange ones, and one character's own poses are left as they are") {
  const Pair near(table6_pose(5), 0.001), far(table6_pose(5), 0.012);
  for (const Pair* pair : {&near, &far}) {
    CHECK(npt::NetworkCorrection::share(pair->character.estimate, pair->reading) == 0);
    CHECK(asked(*pair) == fitted(*pair));
  }
  Pair own(table6_pose(5));
  CHECK(npt::NetworkCorrection::share(own.character.estimate, own.reading) > 0.15);
  own.character.estimate.fit.body.betas = own.reading.fit.body.betas;
  CHECK(npt::NetworkCorrection::share(own.character.estimate, own.reading) == 0);
}

TEST_CASE("a pose that the network doesn't know is left as it is") {
  std::array<float, 72> lying{-1.5F};
  for (const std::size_t hip : {1U, 2U}) lying[3 * hip] = -1.5F;
  for (const std::size_t knee : {4U, 5U}) lying[3 * knee] = 1.5F;
  const Pair pair(lying);
  CHECK(npt::NetworkCorrection::share(pair.character.estimate, pair.reading) > 0.15);
  CHECK(asked(pair) == fitted(pair));
}

TEST_CASE("weights of another network are refused by name") {
  const std::filesystem::path human = std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/human.safetensors";
  try {
    const npt::NetworkCorrection wrong(npt::SafetensorsFile::read(human), npt::DefaultExecutor(1));
    FAIL("opened");
  } catch (const npt::Error& error) {
    CHECK(std::string(error.what())
              .find("human.safetensors: metadata: found bottleneck 256, conv_relu, per-vertex, expected one of the "
                    "networks that are compiled in: bottleneck 256; feature pooled; order conv_relu") !=
          std::string::npos);
  }
}
