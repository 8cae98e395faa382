#include <doctest/doctest.h>

#include <npt/body/pose_sampler.hpp>

#include <array>
#include <cmath>
#include <numbers>

namespace {

void expect_ranges_filled(npt::PoseDistribution distribution,
                          const std::array<npt::JointRange, npt::smpl_joint_count>& ranges) {
  constexpr double radians_in_degree = std::numbers::pi / 180.0;
  std::array<double, 72> low{}, high{};
  for (std::uint64_t i = 0; i < 2000; ++i) {
    npt::Random random(11, i);
    const auto pose = npt::sample_pose(random, distribution);
    for (std::size_t k = 0; k < pose.size(); ++k) {
      const npt::AngleRange range = ranges[k / 3][k % 3];
      const double angle = static_cast<double>(pose[k]) / radians_in_degree;
      REQUIRE(angle >= range.low - 1e-5);
      REQUIRE(angle <= range.high + 1e-5);
      low[k] = i == 0 ? angle : std::min(low[k], angle);
      high[k] = i == 0 ? angle : std::max(high[k], angle);
    }
  }
  for (std::size_t k = 0; k < 72; ++k) {
    const npt::AngleRange range = ranges[k / 3][k % 3];
    CHECK(high[k] - low[k] >= 0.98 * (range.high - range.low));
  }
}

}  // namespace

TEST_CASE("sampled poses fill their ranges and never leave them") {
  expect_ranges_filled(npt::PoseDistribution::paper, npt::paper_pose_ranges);
  expect_ranges_filled(npt::PoseDistribution::wide, npt::wide_pose_ranges);
}

TEST_CASE("wide ranges hold the paper's large ones, and left and right are mirror images") {
  const auto &wide = npt::wide_pose_ranges, &paper = npt::paper_pose_ranges;
  for (std::size_t j = 0; j < 24; ++j)
    for (std::size_t k = 0; k < 3; ++k)
      if (paper[j][k].high - paper[j][k].low > 20) {
        CHECK(wide[j][k].low <= paper[j][k].low + 10);
        CHECK(wide[j][k].high >= paper[j][k].high - 10);
      }
  for (const std::size_t left : {1U, 4U, 7U, 10U, 13U, 16U, 18U, 20U, 22U}) {
    const npt::JointRange &l = wide[left], &r = wide[left + 1];
    CHECK(l[0].low == r[0].low);
    CHECK(l[0].high == r[0].high);
    for (const std::size_t k : {1U, 2U}) {
      CHECK(l[k].low == -r[k].high);
      CHECK(l[k].high == -r[k].low);
    }
  }
}

TEST_CASE("the table is the paper's: spot checks by joint number") {
  const auto& table = npt::paper_pose_ranges;
  CHECK(table[1][0].low == -90);
  CHECK(table[1][2].high == 40);
  CHECK(table[2][2].low == -40);
  CHECK(table[5][0].high == 100);
  CHECK(table[13][1].high == 30);
  CHECK(table[18][1].low == -60);
  CHECK(table[19][1].high == 60);
  CHECK(table[23][2].high == 10);
  for (std::size_t j = 0; j < 24; ++j) {
    for (std::size_t k = 0; k < 3; ++k) CHECK(table[j][k].low <= table[j][k].high);
  }
}

TEST_CASE("a draw depends on seed and stream only") {
  npt::Random a(3, 5), b(3, 5), other_stream(3, 6), other_seed(4, 5);
  const auto pose = npt::sample_pose(a);
  CHECK(pose == npt::sample_pose(b));
  CHECK(pose != npt::sample_pose(other_stream));
  CHECK(pose != npt::sample_pose(other_seed));
  CHECK(npt::sample_shape(a, 10) == npt::sample_shape(b, 10));
}

TEST_CASE("shapes are normal, or uniform in -4 .. 4") {
  npt::Random random(2);
  const auto uniform = npt::sample_shape(random, 20000, npt::ShapeDistribution::uniform);
  const auto normal = npt::sample_shape(random, 20000);
  double mean_uniform = 0, square_uniform = 0, mean_normal = 0, square_normal = 0;
  for (const float x : uniform) {
    REQUIRE(std::abs(x) <= 4.0F);
    mean_uniform += static_cast<double>(x) / 20000;
    square_uniform += static_cast<double>(x) * static_cast<double>(x) / 20000;
  }
  for (const float x : normal) {
    mean_normal += static_cast<double>(x) / 20000;
    square_normal += static_cast<double>(x) * static_cast<double>(x) / 20000;
  }
  CHECK(std::abs(mean_uniform) < 0.06);
  CHECK(std::abs(square_uniform - 16.0 / 3.0) < 0.15);
  CHECK(std::abs(mean_normal) < 0.03);
  CHECK(std::abs(square_normal - 1.0) < 0.05);
}
