#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/npt.hpp>
#include <npt/transfer/late_domain.hpp>

#include <io/scratch.hpp>
#include <transfer/shipped.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace {

const std::filesystem::path human = shipped::weights(), animals = shipped::weights("quadruped.safetensors");

}  // namespace

TEST_CASE("a late domain is opened once, by the first that asks") {
  int opened = 0;
  const npt::LateDomain late([&opened] {
    ++opened;
    return npt::open_body_domain(npt::SafetensorsFile::read(human), {}, 1);
  });
  CHECK(opened == 0);
  CHECK(late.words().one == "person");
  CHECK(late.words().many == "people");
  CHECK(opened == 1);
}

TEST_CASE("what opening finds wrong is said by each that asks") {
  const npt::LateDomain late([]() -> std::shared_ptr<const npt::BodyDomain> {
    throw npt::Error({.file = "animals", .found = "a broken tensor", .expected = "a whole one"});
  });
  CHECK_THROWS_AS((void)late.words(), npt::Error);
  CHECK_THROWS_AS((void)late.words(), npt::Error);
}

TEST_CASE("a further file is read once a mesh isn't surely of the first one's kind") {
  const scratch::Folder folder;
  std::filesystem::copy_file(animals, folder / "animals.safetensors");
  const npt::PoseTransfer both = npt::PoseTransfer::open({human, folder / "animals.safetensors"}, {}, 1);
  CHECK(both.description() == shipped::human().description() + ", quadrupeds by body estimation");
  std::filesystem::remove(folder / "animals.safetensors");
  const npt::Mesh a = shipped::person(0.1F), b = shipped::person(1.0F, -1.0F);
  CHECK(both(a, b).positions == shipped::human()(a, b).positions);
  const npt::Result result = both.apply(both.character(a), both.pose(b));
  CHECK(result.kind == "person");
  const npt::ErrorParts parts = shipped::error_of([&] { (void)both.pose(shipped::ball()); });
  CHECK(parts.file.find("animals.safetensors") != std::string::npos);
}

TEST_CASE("a further file that lacks what its metadata tell of is an error when it is asked") {
  const scratch::Folder folder;
  const npt::SafetensorsFile whole = npt::SafetensorsFile::read(animals);
  std::vector<npt::FileTensor> network;
  for (const npt::FileTensor& tensor : whole.tensors())
    if (tensor.name.find('/') == std::string::npos) network.push_back(tensor);
  npt::write_safetensors(folder / "network.safetensors", network, whole.metadata());
  const npt::PoseTransfer both = npt::PoseTransfer::open({human, folder / "network.safetensors"}, {}, 1);
  CHECK(shipped::error_of([&] { (void)both.pose(shipped::ball()); }).code == npt::ErrorCode::missing_weights);
}

TEST_CASE("people and animals of the templates: each is recognised as what it is, and no animal poses a person") {
  const npt::PoseTransfer both = npt::PoseTransfer::open({human, animals}, {}, 1);
  const std::shared_ptr<const npt::BodyKind> kind = npt::load_body_kind(npt::SafetensorsFile::read(animals));
  REQUIRE(kind != nullptr);
  const auto animal = [&](const std::vector<float>& pose) {
    return npt::to_mesh(*kind->body, std::vector<float>{}, pose);
  };
  const npt::Character hero = both.character(animal({}), "animal");
  const npt::Pose pose = both.pose(animal(kind->poses.front())), person = both.pose(shipped::person(1.0F));
  CHECK(hero.kind() == "four-legged animal");
  CHECK(pose.kind() == "four-legged animal");
  CHECK(person.kind() == "person");
  const npt::Result result = both.apply(hero, pose);
  CHECK(result.method == npt::Method::body);
  CHECK(result.kind == "four-legged animal");
  // The same as by the animals' weights alone.
  const npt::PoseTransfer alone = npt::PoseTransfer::open(animals, {}, 1);
  CHECK(alone(animal({}), animal(kind->poses.front())).positions == result.mesh.positions);
  CHECK(shipped::error_of([&] { (void)both.apply(hero, person); }).code == npt::ErrorCode::domains_differ);
  const npt::Pose thing = both.pose(shipped::ball(), 0, "ball");
  CHECK(thing.kind().empty());
  const npt::ErrorParts parts = shipped::error_of([&] { thing.expect_recognised(); });
  CHECK(parts.found.starts_with("a mesh that is not recognised as a person (confidence "));
  CHECK(parts.found.find(", nor as a four-legged animal (") != std::string::npos);
  CHECK(parts.expected == "a person, whole, with head, arms and legs");
}
