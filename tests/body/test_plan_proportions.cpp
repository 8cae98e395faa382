#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/body/proportions.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "small_body.hpp"

namespace {

using npt::Vec3d;

/// A trunk along z, a leg of two bones down from it, and a tail.
constexpr const char* text = R"(plan stool
joint trunk -     trunk trunk root trunk 1 1
joint leg   trunk leg   leg   bone foot  1 1
joint foot  leg   foot  leg   tip  foot  1 1
joint tail  trunk tail  tail  tip  tail  1 1
proportion size   0.2  0.8 1.25
proportion length 0.25 0.5 1.5
proportion girth  0.25 0.6 2
proportion depth  0.2  0.8 1.5
grows size   all    trunk leg foot tail
grows length length leg tail
grows girth  girth  leg
grows depth  y      trunk
)";
const std::vector<Vec3d> places{{0, 1, 0}, {0.1, 0.8, 0}, {0.1, 0.3, 0}, {0, 1, -0.5}};

npt::BodyPlan plan() { return npt::read_body_plan(text, "test"); }

/// One vertex beside each joint, of that joint alone; joints are their vertices.
npt::BodyModel stool() {
  npt::BodyTables tables;
  tables.parents = {-1, 0, 1, 0};
  for (std::size_t j = 0; j < places.size(); ++j) {
    const npt::Vec3f p = places[j].as<float>();
    tables.v_template.insert(tables.v_template.end(), {p.x, p.y, p.z, p.x, p.y + 0.1F, p.z + 0.05F});
  }
  std::vector<float> weights(8 * 4, 0.0F), regressor(4 * 8, 0.0F);
  for (std::size_t j = 0; j < 4; ++j)
    weights[(2 * j) * 4 + j] = weights[(2 * j + 1) * 4 + j] = regressor[j * 8 + 2 * j] = 1;
  tables.weights = npt::SparseMatrix::from_dense(weights, 8, 4);
  tables.J_regressor = npt::SparseMatrix::from_dense(regressor, 4, 8);
  return npt::BodyModel(std::move(tables), "stool");
}

}  // namespace

TEST_CASE("bones lead to the joint that the plan names, a last one away from its parent") {
  const std::vector<Vec3d> along = npt::bone_directions(plan(), places);
  CHECK(along[0] == Vec3d{0, 1, 0});
  CHECK(length(along[1] - Vec3d{0, -1, 0}) < 1e-12);
  CHECK(length(along[2] - Vec3d{0, -1, 0}) < 1e-12);
  CHECK(length(along[3] - Vec3d{0, 0, -1}) < 1e-12);
}

TEST_CASE("parts grow along their bones or across them") {
  const auto growth = npt::part_growth(plan(), places);
  CHECK(growth[1][0] == npt::Matrix3::identity());
  CHECK(length(growth[1][1] * Vec3d{1, 1, 1} - Vec3d{0, 1, 0}) < 1e-12);
  CHECK(length(growth[1][2] * Vec3d{1, 1, 1} - Vec3d{1, 0, 1}) < 1e-12);
  CHECK(length(growth[3][1] * Vec3d{1, 1, 1} - Vec3d{0, 0, 1}) < 1e-12);
  CHECK(length(growth[0][3] * Vec3d{1, 1, 1} - Vec3d{0, 1, 0}) < 1e-12);
  CHECK(growth[2][1] == npt::Matrix3{});
}

TEST_CASE("directions are in deviations, linear, and carry the parts behind") {
  const npt::BodyModel body = npt::with_proportions(stool(), plan());
  REQUIRE(body.shape_count() == 4);
  // Two deviations of 0.25: a leg half as long again.
  const auto longer = body.joints(std::vector<float>{0, 2, 0, 0});
  CHECK(length(longer[1] - places[1]) < 1e-6);
  CHECK(length(longer[2] - Vec3d{0.1, 0.05, 0}) < 1e-6);
  CHECK(length(longer[3] - places[3]) < 1e-6);
  // The whole body grows about the origin, a part about its joint.
  const auto larger = body.joints(std::vector<float>{1, 0, 0, 0});
  for (std::size_t j = 0; j < places.size(); ++j) CHECK(length(larger[j] - places[j] * 1.2) < 1e-6);
  const auto deeper = body.joints(std::vector<float>{0, 0, 0, 1});
  CHECK(length(deeper[0] - places[0]) < 1e-6);
  CHECK(length(deeper[2] - (places[2] + Vec3d{0, -0.2 * 0.2, 0})) < 1e-6);
  const auto both = body.joints(std::vector<float>{1, 2, 0, 0});
  CHECK(length(both[2] - (larger[2] + longer[2] - places[2])) < 1e-6);
  // The tail's length grows its own skin too.
  const npt::Mesh mesh = npt::to_mesh(body, std::vector<float>{0, 2, 0, 0});
  CHECK(mesh.positions[7].z == doctest::Approx(-0.5 + 0.05 * 1.5));
}

TEST_CASE("people's proportions are growth of the same kind") {
  const npt::BodyModel body = npt::with_proportions(npt::mannequin());
  const std::vector<Vec3d> joints = npt::mannequin().joints({});
  const auto fixed = npt::body::internal::part_growth(joints);
  std::vector<std::vector<npt::Matrix3>> growth;
  for (const auto& b : fixed) growth.emplace_back(b.begin(), b.end());
  CHECK(npt::body::internal::grows_whole_body(growth, 0));
  CHECK_FALSE(npt::body::internal::grows_whole_body(growth, 1));
  const std::vector<double> units(npt::body_proportion_count, 1.0);
  CHECK(npt::body::internal::with_growth(npt::mannequin(), growth, units).tables().shapedirs ==
        body.tables().shapedirs);
}

TEST_CASE("drawn proportions stay in the plan's ranges, relative to the size") {
  const npt::BodyPlan p = plan();
  double shortest = 1;
  for (std::uint64_t i = 0; i < 300; ++i) {
    npt::Random random(3, i);
    const std::vector<double> changes = npt::sample_proportions(p, random);
    REQUIRE(changes.size() == 4);
    const double size = 1 + changes[0];
    CHECK(size >= 0.8 - 1e-9);
    CHECK(size <= 1.25 + 1e-9);
    for (std::size_t k = 1; k < 4; ++k) {
      const double factor = 1 + changes[k] / size;
      CHECK(factor >= p.proportions[k].low - 1e-9);
      CHECK(factor <= p.proportions[k].high + 1e-9);
      shortest = std::min(shortest, factor);
    }
  }
  CHECK(shortest < 0.6);
}

TEST_CASE("drawn characters are the body's own shapes and proportions in deviations") {
  npt::Random random(4, 1), again(4, 1);
  const std::vector<float> betas = npt::sample_character(plan(), random, 2);
  REQUIRE(betas.size() == 6);
  CHECK(betas[0] == static_cast<float>(again.normal()));
  CHECK(betas[1] == static_cast<float>(again.normal()));
  const std::vector<double> changes = npt::sample_proportions(plan(), again);
  for (std::size_t k = 0; k < 4; ++k)
    CHECK(betas[2 + k] == doctest::Approx(changes[k] / plan().proportions[k].deviation));
}

TEST_CASE("a plan of other joints than the body's is an error") {
  CHECK_THROWS_WITH_AS(npt::with_proportions(npt::BodyModel(small_body(), "small"), plan()),
                       doctest::Contains("plan 'stool'"), npt::Error);
}
