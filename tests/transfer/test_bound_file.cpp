#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/transfer/bound_file.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "io/scratch.hpp"

namespace {

constexpr std::size_t joints = 24;

/// People without fingers, with three shapes.
const npt::BodyKind& small_kind() {
  static const npt::BodyKind kind = [] {
    npt::BodyTables tables = npt::mannequin().tables();
    std::vector<float> three;
    for (std::size_t i = 0; i < tables.v_template.size(); ++i)
      three.insert(three.end(), &tables.shapedirs[10 * i], &tables.shapedirs[10 * i] + 3);
    tables.shapedirs = std::move(three);
    npt::BodyKind own{.plan = npt::people_plan(), .body = std::make_shared<const npt::BodyModel>(std::move(tables))};
    return own;
  }();
  return kind;
}

/// Two vertices, the first on two joints; each number another one.
npt::BoundCharacter small_character() {
  npt::BoundCharacter c;
  c.estimate.centre = {1, 2, 3}, c.estimate.metres = 0.01, c.estimate.confidence = 0.9;
  c.estimate.fit.relative_distance = 1.0 / 3, c.estimate.fit.facing = -1;
  c.estimate.fit.body.betas = {0.1F, -0.2F, 0.3F};
  for (int i = 0; i < 72; ++i) c.estimate.fit.body.axis_angles.push_back(0.01F * static_cast<float>(i));
  c.estimate.fit.part_distances.assign(joints, 0.01);
  c.estimate.joint_confidence.assign(joints, 0.8);
  c.estimate.hands[1].knuckles = 0.7;
  c.body = c.estimate.fit.body;
  c.body.axis_angles[5] = 9;
  c.estimate.hands[0].middle[2] = 1.1;
  c.fingers = {false, true};
  for (std::size_t j = 0; j < joints; ++j) c.joints.push_back({static_cast<double>(j) / 7, 0, 1});
  c.points = {{0.1, 0.2, 0.3}, {1, 0, 0}};
  c.weights.rows = 2, c.weights.columns = joints;
  c.weights.start = {0, 2, 3}, c.weights.column = {4, 7, 0}, c.weights.value = {0.25F, 0.75F, 1};
  return c;
}

/// What save_bound writes, and the positions that belong to it, after a change.
npt::SafetensorsFile file_of(const std::filesystem::path& path, const npt::BoundCharacter& c,
                             std::vector<float> positions = std::vector<float>(6)) {
  npt::TensorList tensors;
  tensors.add("positions", positions);
  npt::save_bound(c, tensors);
  tensors.write(path);
  return npt::SafetensorsFile::read(path);
}

}  // namespace

TEST_CASE("a bound character comes back with every bit") {
  const scratch::Folder folder;
  const npt::BoundCharacter c = small_character(), back = npt::load_bound(file_of(folder / "c.npt", c), small_kind());
  CHECK(back.estimate.centre == c.estimate.centre);
  CHECK(back.estimate.metres == c.estimate.metres);
  CHECK(back.estimate.confidence == 0.9);
  CHECK(back.estimate.fit.relative_distance == c.estimate.fit.relative_distance);
  CHECK(back.estimate.fit.facing == c.estimate.fit.facing);
  CHECK(back.estimate.fit.body.betas == c.estimate.fit.body.betas);
  CHECK(back.estimate.fit.body.axis_angles == c.estimate.fit.body.axis_angles);
  CHECK(back.estimate.hands[1].knuckles == 0.7);
  CHECK(back.body.axis_angles == c.body.axis_angles);
  CHECK(back.body.betas == c.body.betas);
  CHECK(back.estimate.hands[0].middle == c.estimate.hands[0].middle);
  CHECK(back.fingers == c.fingers);
  CHECK(back.joints == c.joints);
  CHECK(back.points == c.points);
  CHECK(back.weights.rows == 2);
  CHECK(back.weights.columns == joints);
  CHECK(back.weights.start == c.weights.start);
  CHECK(back.weights.column == c.weights.column);
  CHECK(back.weights.value == c.weights.value);
}

TEST_CASE("tensors that don't fit one another are errors that name file and tensor") {
  const scratch::Folder folder;
  const auto error_of = [&](const std::function<void(npt::BoundCharacter&)>& change, std::size_t vertices = 2) {
    npt::BoundCharacter c = small_character();
    change(c);
    return scratch::error_of(
        [&] { (void)npt::load_bound(file_of(folder / "c.npt", c, std::vector<float>(3 * vertices)), small_kind()); });
  };
  const auto says = [](const std::string& error, const char* what) {
    return error.find("c.npt") != std::string::npos && error.find(what) != std::string::npos;
  };
  CHECK(says(error_of([](auto& c) { c.estimate.fit.body.betas.pop_back(); }), "'estimate.betas': found 2 numbers"));
  CHECK(says(error_of([](auto& c) { c.joints.pop_back(); }), "'joints': found 69 numbers, expected 72"));
  CHECK(says(error_of([](auto&) {}, 3), "'points': found 6 numbers, expected 9"));
  CHECK(says(error_of([](auto& c) { c.weights.column[1] = joints; }), "numbers outside of their lists"));
  CHECK(says(error_of([](auto& c) { c.weights.start = {0, 3, 2}; }), "numbers outside of their lists"));
  CHECK(says(error_of([](auto& c) { c.weights.start = {0, 2}; }), "'weights.start': found 2 numbers, expected 3"));
  CHECK(says(error_of([](auto& c) { c.weights.value.pop_back(); }), "'weights.value': found 2 numbers, expected 3"));
  CHECK(says(error_of([](auto& c) { c.estimate.metres = std::numeric_limits<double>::quiet_NaN(); }),
             "estimate.numbers"));
}
