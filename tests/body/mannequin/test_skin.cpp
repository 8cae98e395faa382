// Skin weights and joint regressors at places that are no vertex of the mannequin.
#include <doctest/doctest.h>
#include <npt/base/random.hpp>
#include <npt/body/mannequin/skin.hpp>

#include <cmath>
#include <numeric>
#include <vector>

using npt::Vec3d;
namespace anatomy = npt::anatomy;

TEST_CASE("a ramp rises from 0 to 1") {
  CHECK(anatomy::ramp(1, 2, 4) == 0);
  CHECK(anatomy::ramp(3, 2, 4) == 0.5);
  CHECK(anatomy::ramp(5, 2, 4) == 1);
}

TEST_CASE("the shares of the joints sum to one in all of space, and mirror") {
  npt::Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d p{random.uniform(0, 0.9), random.uniform(0, 1.75), random.uniform(-0.2, 0.2)};
    const anatomy::JointWeights left = anatomy::joint_weights(p), right = anatomy::joint_weights({-p.x, p.y, p.z});
    REQUIRE(std::abs(std::accumulate(left.begin(), left.end(), 0.0) - 1) < 1e-12);
    for (std::size_t j = 0; j < left.size(); ++j) {
      const std::string_view name = npt::smpl_joint_names[j];
      const std::size_t twin = name.starts_with("l_") ? j + 1 : name.starts_with("r_") ? j - 1 : j;
      REQUIRE(std::abs(left[j] - right[twin]) < 1e-12);
    }
  }
}

TEST_CASE("convex weights are positive, sum to one and average the points to the target") {
  const std::vector<Vec3d> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  const Vec3d target{0.3, 0.4, 0.2};
  const std::vector<double> w = anatomy::convex_weights(points, std::vector<double>(5, 1.0), target);
  Vec3d mean{};
  double sum = 0;
  for (std::size_t i = 0; i < w.size(); ++i) {
    CHECK(w[i] > 0);
    mean += points[i] * w[i];
    sum += w[i];
  }
  CHECK(std::abs(sum - 1) < 1e-12);
  CHECK(length(mean - target) < 1e-10);
}
