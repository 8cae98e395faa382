#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/npt.hpp>
#include <npt/transfer/animation.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/kind_domain.hpp>
#include <npt/transfer/open_domain.hpp>
#include <npt/transfer/pose_tracker.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/scratch.hpp"
#include "support/bumpy_sphere.hpp"

namespace {

const std::filesystem::path weights_folder = std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights";

npt::PoseTransfer open_with(npt::Method method, int threads = 1) {
  return npt::PoseTransfer::open(weights_folder / "human.safetensors", {.method = method}, threads);
}

npt::Mesh posed_person(float bend) {
  std::vector<float> pose(72, 0.0F);
  pose[3 * 4] = bend, pose[3 * 18 + 1] = -bend, pose[3 * 16 + 2] = -bend / 2;
  return npt::to_mesh(npt::mannequin(), std::vector<float>{0.5F}, pose);
}

}  // namespace

TEST_CASE("people are posed by body estimation, and the report says so") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  REQUIRE(transfer.has_body());
  const npt::Mesh a = posed_person(0.1F), b = posed_person(1.0F);
  const auto faces = npt::triangulate(a);
  std::vector<float> result(a.coordinates().size());
  npt::TransferReport report;
  const npt::TransferJob people{{a.coordinates(), faces, "a"}, {b.coordinates(), faces, "b"}, result, &report};
  transfer.run({&people, 1});
  CHECK(report.method == npt::Method::body);
  CHECK(*report.confidence > 0.85);
  CHECK(report.warnings.empty());
  // The mannequin is one body in two poses: the result is the other mesh.
  double worst = 0;
  for (std::size_t i = 0; i < result.size(); ++i)
    worst = std::max(worst, static_cast<double>(std::abs(result[i] - b.coordinates()[i])));
  CHECK(worst < 0.05);
}

TEST_CASE(
    "a mesh that isn't recognised is refused, whichever it is and whatever its size, unless a method is asked for") {
  npt::Mesh ball = support::bumpy_sphere(20, 30, 0.2, true);
  const npt::Mesh person = posed_person(1.0F);
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  const auto refused = [&](const npt::Mesh& identity, const npt::Mesh& pose, const std::string& name) {
    try {
      (void)transfer(identity, pose);
      FAIL("not refused");
    } catch (const npt::Error& error) {
      CHECK(error.code() == npt::ErrorCode::not_recognised);
      CHECK(error.remedy() == npt::Remedy::choose_method);
      CHECK(std::string(error.what()).find(name + ": found a mesh that is not recognised as a person (confidence") ==
            0);
      CHECK(std::string(error.what()).find("--") == std::string::npos);
    }
  };
  refused(ball, person, "identity");
  refused(person, ball, "pose");
  refused(ball, ball, "identity");
  // Of no person's size in any unit: that is not what is wrong with it.
  npt::Mesh giant = ball;
  for (npt::Vec3f& p : giant.positions) p = p * 5.0F;
  refused(giant, person, "identity");
  refused(person, giant, "pose");
  CHECK_NOTHROW((void)open_with(npt::Method::network)(ball, person));
}

TEST_CASE("a mesh without a surface, in which no body is estimated, is the network's, with a warning") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  const npt::Mesh a = posed_person(0.1F), b = posed_person(1.0F);
  const auto faces = npt::triangulate(a);
  std::vector<float> result(a.coordinates().size());
  npt::TransferReport report;
  const npt::TransferJob job{{a.coordinates(), faces, "a"}, {b.coordinates(), {}, "points"}, result, &report};
  transfer.run({&job, 1});
  CHECK(report.method == npt::Method::network);
  REQUIRE(report.warnings.contains(npt::WarningCode::no_surface));
}

TEST_CASE("a person on a floor, beside a stray triangle, is posed as without them, and these stay where they are") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  const npt::Mesh a = posed_person(0.1F), b = posed_person(1.0F);
  const auto with_scenery = [](npt::Mesh mesh) {
    const auto first = static_cast<std::uint32_t>(mesh.vertex_count());
    for (const npt::Vec3f p : {npt::Vec3f{-2, -1.2F, -2},
                               {2, -1.2F, -2},
                               {2, -1.2F, 2},
                               {-2, -1.2F, 2},
                               {60, 0, 0},
                               {60, 0.1F, 0},
                               {60, 0, 0.1F}})
      mesh.positions.push_back(p);
    for (const npt::Triangle& t : {npt::Triangle{0, 2, 1}, {0, 3, 2}, {4, 5, 6}}) {
      for (const std::uint32_t corner : t) mesh.corners.push_back(first + corner);
      mesh.face_start.push_back(mesh.corners.size());
    }
    return mesh;
  };
  const npt::Mesh scene = with_scenery(a), scene_of_b = with_scenery(b);
  const npt::Result alone = transfer.apply(transfer.character(a), transfer.pose(b));
  const npt::Character character = transfer.character(scene);
  const npt::Result both = transfer.apply(character, transfer.pose(scene_of_b));
  CHECK(both.method == npt::Method::body);
  REQUIRE(both.warnings.size() == 2);
  for (const npt::Warning& warning : both.warnings) CHECK(warning.code == npt::WarningCode::part_of_mesh);
  double worst = 0;
  for (std::size_t v = 0; v < both.mesh.vertex_count(); ++v) {
    const npt::Vec3f expected = v < a.vertex_count() ? alone.mesh.positions[v] : scene.positions[v];
    worst = std::max(worst, static_cast<double>(length(both.mesh.positions[v] - expected)));
  }
  CHECK(worst < 1e-5);
  // A rig has a joint for them that never moves.
  const std::optional<npt::SkinnedSkeleton> skeleton = character.skeleton();
  REQUIRE(skeleton.has_value());
  CHECK(skeleton->joint_count() == 41);
  CHECK(skeleton->influences.back().joint == 40);
  CHECK(transfer.motions(character, transfer.pose(b))->back().linear == npt::Matrix3::identity());
  // In metres, though the whole is 60 units across, which would be centimetres of a person.
  CHECK(npt::output_unit(transfer, character, false) == 1);
}

TEST_CASE("prepared meshes, a sequence's first frame and one call give the same bits, with any number of threads") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  const npt::PoseTransfer two = open_with(npt::Method::automatic, 2), seven = open_with(npt::Method::automatic, 7);
  const npt::Mesh a = posed_person(0.1F), b = posed_person(1.0F);
  const auto faces = npt::triangulate(a);
  const npt::MeshView of_a{a.coordinates(), faces, "a"}, of_b{b.coordinates(), faces, "b"};
  std::vector<float> once(a.coordinates().size()), again(once.size());
  transfer(of_a, of_b, once);
  const npt::Character identity = transfer.character(of_a);
  CHECK(identity.domain() == "human");
  transfer.apply(identity, transfer.pose(of_b), again);
  CHECK(once == again);
  npt::PoseTracker tracker(transfer);
  transfer.apply(identity, tracker.next(of_b, a.vertex_count()), again);
  CHECK(once == again);
  const npt::Result result = transfer.apply(transfer.character(a), transfer.pose(b));
  CHECK(std::equal(once.begin(), once.end(), result.mesh.coordinates().begin()));
  two(of_a, of_b, again);
  CHECK(once == again);
  seven(of_a, of_b, again);
  CHECK(once == again);
}

TEST_CASE("a method that was asked for is taken, and one that can't be had is an error") {
  CHECK_FALSE(open_with(npt::Method::network).has_body());
  CHECK(npt::PoseTransfer::open(weights_folder / "quadruped.safetensors", {.method = npt::Method::body}, 1).has_body());
  // The pose transfer network alone, as a training leaves it: it is taken without a word.
  const npt::SafetensorsFile animals = npt::SafetensorsFile::read(weights_folder / "quadruped.safetensors");
  std::vector<npt::FileTensor> network;
  for (const npt::FileTensor& tensor : animals.tensors())
    if (tensor.name.find('/') == std::string::npos) network.push_back(tensor);
  const scratch::Folder folder;
  npt::write_safetensors(folder / "network.safetensors", network, animals.metadata());
  CHECK_FALSE(npt::PoseTransfer::open(folder / "network.safetensors", {}, 1).has_body());
  CHECK_THROWS_AS(npt::PoseTransfer::open(folder / "network.safetensors", {.method = npt::Method::body}, 1),
                  npt::Error);
}

TEST_CASE("weights that name another file's body estimation pose people as that file does") {
  const std::filesystem::path pooled = weights_folder / "human-pooled.safetensors";
  const npt::Mesh identity = posed_person(0.1F), pose = posed_person(0.6F);
  CHECK(npt::PoseTransfer::open(pooled, {}, 1)(identity, pose).positions ==
        open_with(npt::Method::automatic)(identity, pose).positions);
  // A copy under the other file's name names itself.
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "npt_test_people";
  std::filesystem::create_directories(folder);
  const std::filesystem::path copy = folder / "human.safetensors";
  std::filesystem::copy_file(pooled, copy, std::filesystem::copy_options::overwrite_existing);
  try {
    npt::PoseTransfer::open(copy, {}, 1);
    FAIL("no error");
  } catch (const npt::Error& error) {
    CHECK(error.code() == npt::ErrorCode::missing_weights);
    CHECK(std::string(error.what()).find("human.safetensors: found weights without body estimation") !=
          std::string::npos);
  }
  std::filesystem::remove_all(folder);
}

TEST_CASE("a unit that can't be inferred is no hindrance to body estimation") {
  const npt::PoseTransfer transfer = open_with(npt::Method::automatic);
  npt::Mesh a = posed_person(0.1F);
  const npt::Mesh b = posed_person(1.0F);
  for (npt::Vec3f& p : a.positions) p = p * 5.0F;
  const npt::Mesh result = transfer(a, b);
  float low = 1e9F, high = -1e9F;
  for (const npt::Vec3f p : result.positions) low = std::min(low, p.y), high = std::max(high, p.y);
  CHECK(high - low > 6);
}

TEST_CASE("of two people in one mesh the one that is asked for is posed, and the other stays") {
  const npt::Mesh first = posed_person(0.1F), pose = posed_person(1.0F);
  npt::Mesh second = posed_person(0.4F), both = first;
  for (npt::Vec3f& p : second.positions) p.x += 3;
  const auto count = static_cast<std::uint32_t>(first.vertex_count());
  both.positions.insert(both.positions.end(), second.positions.begin(), second.positions.end());
  for (std::size_t f = 1; f < second.face_start.size(); ++f)
    both.face_start.push_back(both.corners.size() + second.face_start[f]);
  for (const std::uint32_t corner : second.corners) both.corners.push_back(count + corner);
  for (const std::size_t figure : {std::size_t{1}, std::size_t{2}}) {
    npt::TransferOptions options;
    options.body.figure = figure;
    const auto transfer = npt::PoseTransfer::open(weights_folder / "human.safetensors", options);
    const npt::Result got = transfer.apply(transfer.character(both), transfer.pose(pose));
    const npt::Result alone = transfer.apply(transfer.character(figure == 1 ? first : second), transfer.pose(pose));
    double moved = 0, off = 0;
    for (std::size_t v = 0; v < both.vertex_count(); ++v) {
      const bool own = (v < count) == (figure == 1);
      const npt::Vec3f expected = own ? alone.mesh.positions[v < count ? v : v - count] : both.positions[v];
      off = std::max(off, static_cast<double>(length(got.mesh.positions[v] - expected)));
      if (own) moved = std::max(moved, static_cast<double>(length(got.mesh.positions[v] - both.positions[v])));
    }
    CHECK(off < 1e-4);
    CHECK(moved > 0.1);
  }
  npt::TransferOptions options;
  options.body.figure = 3;
  const auto transfer = npt::PoseTransfer::open(weights_folder / "human.safetensors", options);
  CHECK_THROWS_WITH_AS((void)transfer.character(both), doctest::Contains("found 2 figures, expected at least 3"),
                       npt::Error);
}
