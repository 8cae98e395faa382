/// The C library gives the C++ library's bits: a pair, twenty frames, a clip, a saved character.
#include <npt/body/body_kind.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/io/file.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/npt.hpp>
#include <npt/scene/clip_frames.hpp>
#include <npt/transfer/animation.hpp>

#include <doctest/doctest.h>
#include <npt_c.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

const std::string weights = std::string(NPT_SOURCE_DIR) + "/examples/weights/human.safetensors";
constexpr std::size_t frame_count = 20;

/// A swing of legs and arms.
npt::Mesh walker(std::size_t frame) {
  const double swing = 0.6 * std::sin(2 * std::numbers::pi * static_cast<double>(frame) / frame_count);
  std::vector<float> angles(3 * npt::smpl_joint_count);
  const auto set = [&angles](std::size_t joint, std::array<double, 3> values) {
    std::ranges::transform(values, angles.begin() + static_cast<std::ptrdiff_t>(3 * joint),
                           [](double x) { return static_cast<float>(x); });
  };
  set(1, {swing, 0, 0}), set(2, {-swing, 0, 0});
  set(4, {0.5 - 0.4 * swing, 0, 0}), set(5, {0.5 + 0.4 * swing, 0, 0});
  set(16, {0, 0.5 * swing, -1.1}), set(17, {0, 0.5 * swing, 1.1});
  return npt::to_mesh(npt::mannequin(), std::vector<float>{0.5F}, angles);
}

npt::Mesh hero_mesh() { return npt::to_mesh(npt::mannequin(), std::vector<float>{-1.0F, 1.0F}); }

/// A mesh as both libraries take it.
struct Both {
  explicit Both(npt::Mesh given, const char* called)
      : mesh(std::move(given)), triangles(npt::triangulate(mesh)), name(called) {}
  npt::MeshView view() const { return {mesh.coordinates(), triangles, name}; }
  npt_mesh c() const {
    return {sizeof(npt_mesh),         mesh.coordinates().data(), mesh.vertex_count(),
            triangles.front().data(), triangles.size(),          name};
  }
  npt::Mesh mesh;
  std::vector<npt::Triangle> triangles;
  const char* name;
};

struct Opened {
  Opened() { REQUIRE(npt_open(weights.c_str(), nullptr, &c) == NPT_OK); }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  ~Opened() { npt_close(c); }
  npt::PoseTransfer cpp = npt::PoseTransfer::open(weights);
  npt_transfer* c = nullptr;
};

template <class T>
T sized() {
  T value{};
  value.size = sizeof(T);
  return value;
}

std::string bytes_of(const fs::path& file) {
  const auto bytes = npt::read_file(file);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Folder {
  Folder() { fs::create_directories(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { fs::remove_all(path); }
  fs::path path = fs::temp_directory_path() / "npt_test_c_api";
};

}  // namespace

TEST_CASE("a pair, and what is said of it") {
  const Opened opened;
  const Both hero(hero_mesh(), "hero"), pose(walker(5), "walker");
  std::vector<float> expected(3 * hero.mesh.vertex_count()), found(expected.size());
  opened.cpp(hero.view(), pose.view(), expected);
  auto result = sized<npt_result>();
  const npt_mesh identity = hero.c(), posed = pose.c();
  REQUIRE(npt_run(opened.c, &identity, &posed, found.data(), &result) == NPT_OK);
  CHECK(found == expected);
  const npt::Character character = opened.cpp.character(hero.view());
  const npt::Pose own = opened.cpp.pose(pose.view());
  const npt::TransferReport report = opened.cpp.report(character, own);
  CHECK(result.method == NPT_BODY);
  CHECK(result.confidence == report.confidence);
  CHECK(result.character_confidence == character.confidence());
  CHECK(result.pose_confidence == own.confidence());
  REQUIRE(result.warning_count == report.warnings.size());
  for (std::size_t i = 0; i < result.warning_count; ++i)
    CHECK(static_cast<int>(result.warnings[i].code) == static_cast<int>(report.warnings[i].code));

  // Where the identity lies in the result's memory.
  found.assign(hero.mesh.coordinates().begin(), hero.mesh.coordinates().end());
  npt_mesh in_place = identity;
  in_place.xyz = found.data();
  REQUIRE(npt_run(opened.c, &in_place, &posed, found.data(), nullptr) == NPT_OK);
  CHECK(found == expected);
}

TEST_CASE("twenty frames") {
  const Opened opened;
  const Both hero(hero_mesh(), "hero");
  const npt::Character character = opened.cpp.character(hero.view());
  const std::size_t vertices = character.vertex_count();
  npt_character* own = nullptr;
  npt_tracker* tracker = nullptr;
  const npt_mesh identity = hero.c();
  REQUIRE(npt_prepare_character(opened.c, &identity, nullptr, &own) == NPT_OK);
  REQUIRE(npt_open_tracker(opened.c, &tracker) == NPT_OK);
  npt::PoseTracker frames(opened.cpp);
  std::vector<float> expected(3 * vertices), found(3 * vertices);
  std::array<std::size_t, NPT_MOST_TRIES> numbers{};
  const std::size_t tries = npt_frames_to_try(frame_count, numbers.data());
  const auto other = [&numbers](std::size_t k) { return walker(numbers[k]); };
  std::vector<Both> others;
  for (std::size_t k = 0; k < tries; ++k) others.emplace_back(other(k), "walker");
  std::vector<npt_mesh> c_others;
  c_others.reserve(others.size());
  for (const Both& one : others) c_others.push_back(one.c());
  for (std::size_t i = 0; i < frame_count; ++i) {
    CAPTURE(i);
    const Both pose(walker(i), "walker");
    const npt_mesh frame = pose.c();
    const npt_pose* tracked = nullptr;
    if (i == 0) {
      opened.cpp.apply(character, frames.start(pose.mesh, pose.name, vertices, tries, other), expected);
      REQUIRE(npt_start_tracker(tracker, &frame, c_others.data(), tries, vertices, &tracked) == NPT_OK);
    } else {
      opened.cpp.apply(character, frames.next(pose.view(), vertices), expected);
      REQUIRE(npt_next_pose(tracker, &frame, vertices, &tracked) == NPT_OK);
    }
    REQUIRE(npt_apply(opened.c, own, tracked, found.data(), nullptr) == NPT_OK);
    CHECK(found == expected);
  }
  npt_close_tracker(tracker);
  npt_release_character(own);
}

TEST_CASE("a clip, from files to a file") {
  const Opened opened;
  const Folder folder;
  const fs::path identity = folder.path / "hero.obj", pose = folder.path / "walker.glb", out = folder.path / "out.glb";
  npt::Mesh mesh = hero_mesh();
  for (float& x : mesh.coordinates()) x *= 100;  // centimetres, by its size
  npt::write_mesh(identity, mesh);
  npt::Animation walk;
  std::vector<double> times;
  for (std::size_t i = 0; i < 6; ++i) {
    const npt::Mesh frame = walker(i);
    walk.positions.emplace_back(frame.coordinates().begin(), frame.coordinates().end());
    times.push_back(static_cast<double>(i) / 10);
  }
  npt::write_scene(pose, npt::animation_scene(walker(0), "walker", walk, "walk", times));

  auto options = sized<npt_clip_options>();
  options.clip = "walk", options.fps = 10;
  for (const int in_place : {0, 1}) {
    CAPTURE(in_place);
    options.in_place = in_place;
    const Both hero(npt::read_mesh(identity), "hero");
    const npt::Character character = opened.cpp.character(hero.view());
    npt::ClipFrames frames(npt::read_scene(pose), pose.string(), {.clip = "walk", .rate = 10, .time = {}});
    const npt::Animation made = npt::animate(opened.cpp, character, npt::frame_source(frames), in_place == 0);
    REQUIRE(made.skeleton.has_value());
    const npt::Scene scene = npt::animation_scene(hero.mesh, "hero", made, "walk", frames.times(), 0.01);
    auto result = sized<npt_result>();
    REQUIRE(npt_animate_file(opened.c, identity.string().c_str(), pose.string().c_str(), out.string().c_str(), &options,
                             nullptr, &result) == NPT_OK);
    CHECK(bytes_of(out) == npt::glb_bytes(scene, out.string()));
    CHECK(result.method == NPT_BODY);
    CHECK(result.confidence == made.report.confidence);
    CHECK(result.character_confidence == character.confidence());
    REQUIRE(result.warning_count >= 1);
    const npt_warning& last = result.warnings[result.warning_count - 1];
    CHECK(last.code == NPT_WARNING_UNIT_ASSUMED);
    CHECK(std::string_view(npt_warning_text(&last, "hero.obj", nullptr)) ==
          "hero.obj is taken to be in centimetres, by its size");
  }

  fs::remove(out);
  struct Course {
    double done = 0;
    bool rising = true;
  } course;
  auto control = sized<npt_control>();
  control.user = &course;
  control.progress = [](double done, void* user) {
    auto& own = *static_cast<Course*>(user);
    own.rising = own.rising && done >= own.done, own.done = done;
  };
  control.stop = [](void* user) { return static_cast<Course*>(user)->done > 0.5 ? 1 : 0; };
  CHECK(npt_animate_file(opened.c, identity.string().c_str(), pose.string().c_str(), out.string().c_str(), &options,
                         &control, nullptr) == NPT_STOPPED);
  CHECK(course.rising);
  CHECK(course.done < 1);
  CHECK_FALSE(fs::exists(out));
  CHECK(npt_animate_file(opened.c, identity.string().c_str(), pose.string().c_str(), pose.string().c_str(), &options,
                         nullptr, nullptr) == NPT_BAD_INPUT);
  options.clip = "run";
  CHECK(npt_animate_file(opened.c, identity.string().c_str(), pose.string().c_str(), out.string().c_str(), &options,
                         nullptr, nullptr) == NPT_BAD_INPUT);
  options.fps = -1;
  CHECK(npt_animate_file(opened.c, identity.string().c_str(), pose.string().c_str(), out.string().c_str(), &options,
                         nullptr, nullptr) == NPT_BAD_ARGUMENT);
}

TEST_CASE("a character: saved and read, its skeleton, joints and motions") {
  const Opened opened;
  const Folder folder;
  const std::string file = (folder.path / "hero.npt").string();
  const Both hero(hero_mesh(), "hero"), pose(walker(5), "walker");
  const npt_mesh identity = hero.c(), posed = pose.c();
  npt_character *own = nullptr, *again = nullptr;
  npt_pose* taken = nullptr;
  REQUIRE(npt_prepare(opened.c, &identity, &posed, &own, &taken) == NPT_OK);
  REQUIRE(npt_character_save(own, file.c_str()) == NPT_OK);
  REQUIRE(npt_load_character(opened.c, file.c_str(), &again) == NPT_OK);
  std::vector<float> expected(3 * hero.mesh.vertex_count()), found(expected.size());
  REQUIRE(npt_apply(opened.c, own, taken, expected.data(), nullptr) == NPT_OK);
  REQUIRE(npt_apply(opened.c, again, taken, found.data(), nullptr) == NPT_OK);
  CHECK(found == expected);
  auto estimate = sized<npt_estimate>();
  REQUIRE(npt_character_estimate(again, &estimate) == NPT_OK);
  CHECK(estimate.recognised == 1);
  CHECK(std::string_view(estimate.domain) == "human");

  const npt::Character character = opened.cpp.character(hero.view());
  const npt::Pose cpp_pose = opened.cpp.pose(pose.view());
  const npt_skeleton* skeleton = nullptr;
  REQUIRE(npt_open_skeleton(again, &skeleton) == NPT_OK);
  const npt::SkinnedSkeleton bones = *character.skeleton();
  CHECK(skeleton->size == sizeof(npt_skeleton));
  CHECK(skeleton->joints == bones.joint_count());
  CHECK(skeleton->vertices == hero.mesh.vertex_count());
  for (std::size_t j = 0; j < bones.joint_count(); ++j) {
    CHECK(skeleton->names[j] == bones.names[j]);
    CHECK(skeleton->places[3 * j] == bones.joints[j].x);
  }
  npt_close_skeleton(skeleton);
  std::vector<double> motions(12 * NPT_JOINTS);
  REQUIRE(npt_move_joints(opened.c, own, taken, motions.data()) == NPT_OK);
  const std::vector<npt::Affine> moved = *opened.cpp.motions(character, cpp_pose);
  CHECK(motions[0] == moved[0].linear.rows[0].x);
  CHECK(motions[12 * NPT_JOINTS - 1] == moved.back().shift.z);
  auto joints = sized<npt_joint_pose>();
  REQUIRE(npt_pose_joints(taken, &joints) == NPT_OK);
  const npt::JointPose angles = *cpp_pose.joints();
  CHECK(joints.axis_angles[23][2] == angles.axis_angles[71]);
  CHECK(joints.root[1] == angles.root.y);
  CHECK(joints.leg == angles.leg);
  CHECK(npt_load_character(opened.c, weights.c_str(), &again) == NPT_BAD_INPUT);
  npt_release_pose(taken);
  npt_release_character(again);
  npt_release_character(own);
}

TEST_CASE("shipped weights pose two animals as the C++ library does, and say what was recognised") {
  const std::string folder = std::string(NPT_SOURCE_DIR) + "/examples/weights";
  const std::string people = folder + "/human.safetensors", animals = folder + "/quadruped.safetensors";
  npt_transfer* transfer = nullptr;
  REQUIRE(npt_open_shipped(folder.c_str(), nullptr, &transfer) == NPT_OK);
  const auto cpp = npt::PoseTransfer::open({people, animals});
  const auto kind = npt::load_body_kind(npt::SafetensorsFile::read(animals));
  REQUIRE(kind != nullptr);
  const Both animal(npt::to_mesh(*kind->body), "animal"),
      posed(npt::to_mesh(*kind->body, std::vector<float>{}, kind->poses.front()), "pose"),
      person(hero_mesh(), "person");
  const npt_mesh c_animal = animal.c(), c_posed = posed.c(), c_person = person.c();
  std::vector<float> expected(animal.mesh.coordinates().size()), found(expected.size());
  cpp(animal.view(), posed.view(), expected);
  auto result = sized<npt_result>();
  REQUIRE(npt_run(transfer, &c_animal, &c_posed, found.data(), &result) == NPT_OK);
  CHECK(found == expected);
  CHECK(result.method == NPT_BODY);
  CHECK(std::string_view(result.kind) == "four-legged animal");
  CHECK(result.confidence > 0.85);

  npt_character* hero = nullptr;
  npt_pose* pose = nullptr;
  REQUIRE(npt_prepare(transfer, &c_animal, &c_posed, &hero, &pose) == NPT_OK);
  auto estimate = sized<npt_estimate>();
  REQUIRE(npt_character_estimate(hero, &estimate) == NPT_OK);
  CHECK(std::string_view(estimate.kind) == "four-legged animal");
  CHECK(std::string_view(estimate.domain) == "quadruped");
  auto joints = sized<npt_joint_pose>();
  REQUIRE(npt_pose_joints(pose, &joints) == NPT_OK);
  CHECK(joints.joints == kind->joint_count());
  npt_release_pose(pose);
  npt_release_character(hero);

  std::vector<float> of_person(person.mesh.coordinates().size());
  CHECK(npt_run(transfer, &c_person, &c_posed, of_person.data(), nullptr) == NPT_BAD_INPUT);
  CHECK(npt_last_error_code() == NPT_ERROR_DOMAINS_DIFFER);
  REQUIRE(npt_run(transfer, &c_person, &c_person, of_person.data(), &result) == NPT_OK);
  CHECK(std::string_view(result.kind) == "person");
  npt_close(transfer);
  CHECK(npt_open_shipped("no/folder", nullptr, &transfer) == NPT_BAD_INPUT);
  CHECK(npt_open_shipped(nullptr, nullptr, &transfer) == NPT_BAD_ARGUMENT);
}

TEST_CASE("a warning about an animal has an animal's words") {
  const npt::KindWords& words =
      npt::read_body_plan("plan beast\njoint hips - hips trunk root hips 1 1\n", "plan").words();
  const npt_warning warning{NPT_WARNING_LOW_CONFIDENCE, NPT_POSE, 0.66, NPT_REMEDY_LOOK_AT_RESULT, &words};
  CHECK(std::string_view(npt_warning_text(&warning, nullptr, "wolf.obj")) ==
        "wolf.obj is recognised as a beast with a low confidence of 66 %");
}
