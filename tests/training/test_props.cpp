#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/skeleton.hpp>
#include <training/props.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

using npt::Vec3f;
using npt::data::PropPart;

namespace {

Vec3f inside(const PropPart& part, Vec3f point) {
  const Vec3f off = point - part.middle;
  return {npt::dot(off, part.axes[0]) / part.half.x, npt::dot(off, part.axes[1]) / part.half.y,
          npt::dot(off, part.axes[2]) / part.half.z};
}

}  // namespace

TEST_CASE("points of a prop lie on its surface, by area, and normals point out of it") {
  npt::Random random(5);
  const std::array<Vec3f, 3> axes = npt::data::prop::internal::axes_about(npt::normalised(Vec3f{1, 2, -0.5F}));
  for (const bool box : {true, false}) {
    const PropPart part{{0.1F, -0.3F, 0.2F}, axes, {0.05F, 0.4F, 0.1F}, box};
    constexpr int count = 20000;
    Vec3f sum, normals;
    double pulled = 0;  // a third of the sum of point times normal is the volume over the area
    for (int i = 0; i < count; ++i) {
      Vec3f point, normal;
      part.draw(random, point, normal);
      const Vec3f own = inside(part, point);
      const float most = std::max({std::abs(own.x), std::abs(own.y), std::abs(own.z)});
      REQUIRE((box ? most : npt::length(own)) == doctest::Approx(1).epsilon(1e-4));
      REQUIRE(npt::length(normal) == doctest::Approx(1).epsilon(1e-4));
      sum += point - part.middle, normals += normal;
      pulled += static_cast<double>(npt::dot(point - part.middle, normal)) / count;
    }
    CHECK(npt::length(sum / count) < 0.01F);
    CHECK(npt::length(normals / count) < 0.03F);
    const double volume = (box ? 8 : 4.18879) * 0.05 * 0.4 * 0.1;
    CHECK(pulled * static_cast<double>(part.area()) / 3 == doctest::Approx(volume).epsilon(0.03));
  }
}

TEST_CASE("about half of the people carry or wear something, on hands, arms, back and head") {
  npt::Random random(6);
  std::array<std::size_t, npt::smpl_joint_count> of_joint{};
  int with = 0;
  constexpr int count = 4000;
  for (int i = 0; i < count; ++i) {
    const std::vector<npt::data::Prop> props = npt::data::draw_props(random);
    with += props.empty() ? 0 : 1;
    for (const npt::data::Prop& prop : props) {
      CHECK(!prop.parts.empty());
      ++of_joint[prop.joint];
    }
  }
  CHECK(with > count * 2 / 5);
  CHECK(with < count * 3 / 5);
  using enum npt::SmplJoint;
  for (const npt::SmplJoint joint : {left_hand, right_hand, left_elbow, right_elbow, spine3, head})
    CHECK(of_joint[npt::joint_index(joint)] > 20);
}
