#include <doctest/doctest.h>

#include <estimate/nearest_fit.hpp>
#include <estimate/people.hpp>
#include <estimate/simulated_correspondences.hpp>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/limb_search.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace {

constexpr std::size_t legs = 0, arms = 1;  // as people_plan() has them

const npt::CorrespondenceFitter& limb_fitter() {
  static const npt::CorrespondenceFitter shared(people::mannequins());
  return shared;
}

/// A body that is fitted right, and the same with its legs (or arms) in the pose of another body.
struct MislaidLimbs {
  simulated::Posed posed;
  npt::SampledSurface surface;
  npt::CorrespondenceFit right, wrong;
};

MislaidLimbs mislay(std::uint64_t seed, std::size_t pair) {
  npt::Random random(seed);
  const simulated::Posed posed = simulated::draw(npt::mannequin(), {}, random);
  const npt::SampledSurface surface(posed.points, npt::mannequin().triangles());
  const npt::Correspondences reading =
      simulated::read(surface, posed.points, npt::mannequin().triangles(), simulated::mannequin_places(),
                      npt::mannequin().tables().weights, 1000, {}, random);
  const npt::CorrespondenceFit right = nearest_fit(limb_fitter(), surface, reading);
  npt::CorrespondenceFit wrong = right;
  const npt::NaturalPoses::Pose other = npt::natural_poses().sample(random);
  for (const std::size_t j :
       pair == legs ? std::vector<std::size_t>{1, 2, 4, 5, 7, 8} : std::vector<std::size_t>{13, 14, 16, 17, 18, 19})
    for (std::size_t e = 3 * j; e < 3 * j + 3; ++e) wrong.body.axis_angles[e] = other[e];
  wrong.relative_distance = std::numeric_limits<double>::infinity();
  wrong = nearest_of(limb_fitter().fits(surface, wrong, std::vector{wrong.body}));
  return {posed, surface, right, wrong};
}

}  // namespace

TEST_CASE("limbs in the wrong place are found again") {
  const npt::LimbSearch search(people::mannequins());
  int mislaid = 0, found = 0;
  for (const std::size_t pair : {arms, legs})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const MislaidLimbs m = mislay(seed, pair);
      if (m.wrong.relative_distance < 2 * m.right.relative_distance) continue;  // the fit found back alone
      ++mislaid;
      const std::vector<npt::BodyFit> starts = search(m.surface, m.wrong.body, pair, 1, {}, 4);
      const npt::CorrespondenceFit fit = nearest_of(limb_fitter().fits(m.surface, m.wrong, starts));
      CHECK(starts.size() <= 4);
      CHECK(fit.relative_distance <= m.wrong.relative_distance);
      found += simulated::error(npt::mannequin(), fit.body, m.posed.points) < 0.03;
    }
  CHECK(mislaid >= 3);
  CHECK(3 * found >= 2 * mislaid);  // of 8 seeds each, 8 of 11: their shapes have given way, too
}

TEST_CASE("a search changes nothing but the limbs, and finds the same each time") {
  const npt::LimbSearch search(people::mannequins());
  const MislaidLimbs m = mislay(5, legs);
  const std::vector<npt::BodyFit> fits = search(m.surface, m.wrong.body, legs, 1, {}, 5);
  const std::vector<npt::BodyFit> again = search(m.surface, m.wrong.body, legs, 1, {}, 5);
  REQUIRE(!fits.empty());
  REQUIRE(fits.size() == again.size());
  for (std::size_t i = 0; i < fits.size(); ++i) {
    CHECK(fits[i].axis_angles == again[i].axis_angles);
    CHECK(fits[i].betas == m.wrong.body.betas);
    for (const std::size_t j : {0U, 3U, 6U, 9U, 12U, 13U, 16U, 19U, 23U})
      CHECK(std::equal(&fits[i].axis_angles[3 * j], &fits[i].axis_angles[3 * j] + 3, &m.wrong.body.axis_angles[3 * j]));
  }
}

TEST_CASE("each part's own distance tells limbs in the wrong place") {
  const MislaidLimbs m = mislay(2, arms);
  const auto of = [](const npt::CorrespondenceFit& fit, npt::SmplJoint j) {
    return fit.part_distances[npt::joint_index(j)];
  };
  using enum npt::SmplJoint;
  const double right = std::max(of(m.right, left_elbow), of(m.right, right_elbow)),
               wrong = std::max(of(m.wrong, left_elbow), of(m.wrong, right_elbow));
  CHECK(right < 0.005);
  CHECK(wrong > 0.01);
  CHECK(of(m.wrong, left_knee) < 0.01);
}
