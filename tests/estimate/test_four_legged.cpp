// What estimates bodies knows no kind: a four-legged one is found as people are.
#include <doctest/doctest.h>

#include <estimate/four_legged.hpp>
#include <estimate/nearest_fit.hpp>

#include <npt/base/random.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/limb_search.hpp>
#include <npt/estimate/part_motion.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace {

using four_legged::Posed;

const npt::CorrespondenceFitter& animal_fitter() {
  static const npt::CorrespondenceFitter shared(four_legged::kind());
  return shared;
}

/// The largest angle in radians between a leg's bone and where the motion has it.
double worst_leg(const Posed& posed, const npt::PartMotion& motion) {
  const std::vector<npt::Rigid> truth =
      four_legged::kind()->body->bone_motions(posed.truth.betas, posed.truth.axis_angles);
  double worst = 0;
  for (const npt::LimbPair& pair : four_legged::kind()->plan.limb_pairs())
    for (const std::vector<std::size_t>& joints : pair.joints)
      for (std::size_t k = pair.first; k <= pair.middle(); ++k)
        worst = std::max(
            worst, length(npt::axis_angle(truth[joints[k]].rotation.transposed() * motion.parts[joints[k]].rotation)));
  return worst;
}

}  // namespace

TEST_CASE("the parts of a four-legged body move as places say, and the residual tells a mirrored reading") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    CAPTURE(seed);
    const Posed posed = four_legged::draw(seed);
    const npt::CorrespondenceTemplate& rest = animal_fitter().correspondence_template();
    const npt::PartMotion exact = npt::part_motion(rest, four_legged::read(posed, 0, 0, seed));
    CHECK(worst_leg(posed, exact) < 0.35);
    CHECK(exact.residual < 0.03);
    CHECK(exact.axis_angles.size() == 3 * four_legged::kind()->joint_count());
    npt::Correspondences noisy = four_legged::read(posed, 0.03, 0.1, seed);
    const double residual = npt::part_motion(rest, noisy).residual;
    CHECK(residual < 0.11);
    for (npt::PointCorrespondence& p : noisy) p.place.x = -p.place.x;
    CHECK(npt::part_motion(rest, noisy).residual > 1.2 * residual);
  }
}

TEST_CASE("a random pose of a four-legged body is found back, hind legs that were taken for each other, too") {
  const std::vector<npt::LimbPair> pairs = four_legged::kind()->plan.limb_pairs();
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    CAPTURE(seed);
    const Posed posed = four_legged::draw(seed);
    const npt::LimbPair* mirrored = seed == 3 ? &pairs[1] : nullptr;
    const npt::CorrespondenceFit fit =
        nearest_fit(animal_fitter(), posed.surface, four_legged::read(posed, 0.03, 0.1, seed, mirrored));
    CHECK(four_legged::error(fit.body, posed) < 0.02);
    CHECK(fit.body.distance < 0.006);
    CHECK(fit.part_distances.size() == four_legged::kind()->joint_count());
  }
}

TEST_CASE("legs in the wrong place are found again") {
  const npt::LimbSearch search(four_legged::kind());
  REQUIRE(search.pairs().size() == 2);
  int mislaid = 0, found = 0;
  for (std::size_t pair = 0; pair < 2; ++pair)
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Posed posed = four_legged::draw(seed);
      const npt::CorrespondenceFit right =
          nearest_fit(animal_fitter(), posed.surface, four_legged::read(posed, 0.03, 0, seed));
      npt::CorrespondenceFit wrong = right;
      npt::Random random(79, seed);
      const std::vector<float> other = four_legged::draw_pose(four_legged::kind()->plan, random);
      for (const std::vector<std::size_t>& joints : search.pairs()[pair].joints)
        for (const std::size_t j : joints)
          for (std::size_t e = 3 * j; e < 3 * j + 3; ++e) wrong.body.axis_angles[e] = 2 * other[e];
      wrong.relative_distance = std::numeric_limits<double>::infinity();
      wrong = nearest_of(animal_fitter().fits(posed.surface, wrong, std::vector{wrong.body}));
      if (wrong.relative_distance < 2 * right.relative_distance) continue;  // the fit found back alone
      ++mislaid;
      const std::vector<npt::BodyFit> starts = search(posed.surface, wrong.body, pair, 1, {}, 4);
      const npt::CorrespondenceFit fit = nearest_of(animal_fitter().fits(posed.surface, wrong, starts));
      found += four_legged::error(fit.body, posed) < 0.03;
    }
  CHECK(mislaid >= 3);
  CHECK(3 * found >= 2 * mislaid);
}
