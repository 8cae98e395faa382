#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/scene/scene.hpp>
#include <training/leg_matching.hpp>

#include <cstddef>
#include <vector>

namespace {

using Joints = std::vector<npt::Vec3d>;
constexpr std::size_t none = npt::no_item;

std::vector<std::size_t> matched(const Joints& own, const Joints& model) {
  return npt::rig::internal::LegMatch(own, own.back(), 0, model, 0).matched();
}

const Joints fore{{0, 0.5, 0.2}, {0, 0.42, 0.09}, {0, 0.2, 0.11}, {0, 0.045, 0.115}};
const Joints hind{{0, 0.6, -0.41}, {0, 0.41, -0.31}, {0, 0.22, -0.5}, {0, 0.047, -0.48}};

}  // namespace

TEST_CASE("a whole leg is matched one by one, in any size") {
  Joints large = hind;
  for (npt::Vec3d& p : large) p = p * 30;
  CHECK(matched(large, hind) == std::vector<std::size_t>{0, 1, 2, 3});
  CHECK(matched(fore, fore) == std::vector<std::size_t>{0, 1, 2, 3});
}

TEST_CASE("where it bends tells a wrist from an elbow and a hock from a knee") {
  CHECK(matched({{0, 2, 1}, {0, 1, 1.1}, {0, 0.2, 1}}, fore) == std::vector<std::size_t>{0, none, 1, 2});
  CHECK(matched({{0, 2, 1}, {0, 1.5, 0.8}, {0, 0.2, 1}}, fore) == std::vector<std::size_t>{0, 1, none, 2});
  CHECK(matched({{0, 2, 1}, {0, 1.1, 0.7}, {0, 0.2, 1}}, hind) == std::vector<std::size_t>{0, none, 1, 2});
  CHECK(matched({{0, 2, 1}, {0, 1.1, 1.3}, {0, 0.2, 1}}, hind) == std::vector<std::size_t>{0, 1, none, 2});
}

TEST_CASE("a leg without a foot, and one of more joints than the plan's") {
  const Joints own{{0, 2, 1}, {0, 1.1, 0.7}};
  const npt::rig::internal::LegMatch match(own, {0, 0, 1}, 0, hind, 0);
  CHECK(match.matched() == std::vector<std::size_t>{0, none, 1, none});
  CHECK(match.cost() > 0.4);
  Joints toes = fore;
  toes.push_back({0, 0.01, 0.2});
  CHECK(matched(toes, fore) == std::vector<std::size_t>{0, 1, 2, 3});
}
