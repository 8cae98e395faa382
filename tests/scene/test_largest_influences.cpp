#include <doctest/doctest.h>

#include <npt/scene/largest_influences.hpp>
#include <npt/scene/skinned_skeleton.hpp>

#include <cmath>
#include <vector>

TEST_CASE("the four largest influences, with weights that sum to 1") {
  const std::vector<npt::SkinnedSkeleton::Influence> five{{7, 0.1F}, {3, 0.3F}, {1, 0.25F}, {9, 0.05F}, {4, 0.3F}};
  const auto four = npt::largest_influences(five);
  CHECK(four[0].joint == 3);
  CHECK(four[1].joint == 4);
  CHECK(four[3].joint == 7);
  double sum = 0;
  for (const auto& influence : four) sum += static_cast<double>(influence.weight);
  CHECK(std::abs(sum - 1) < 1e-7);
  CHECK(npt::largest_influences({})[0].weight == 1);
}
