#include <doctest/doctest.h>

#include <estimate/people.hpp>

#include <npt/base/random.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/estimate/finger_fit.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace {

const npt::FingerFitter& finger_fitter() {
  static const npt::FingerFitter all(people::mannequins());
  return all;
}

/// A mannequin in a natural pose, and the fit that only lacks the fingers.
struct PersonWithHands {
  npt::CorrespondenceFit fit;
  npt::SampledSurface surface;

  PersonWithHands(std::uint64_t seed, const std::array<npt::HandBend, 2>& hands)
      : fit(fit_in_natural_pose(seed)),
        surface(npt::points_of(npt::to_mesh(people::mannequins()->bound_body(), fit.body.betas,
                                            npt::with_fingers(fit.body.axis_angles, hands))
                                   .coordinates()),
                npt::mannequin().triangles()) {}

 private:
  static npt::CorrespondenceFit fit_in_natural_pose(std::uint64_t seed) {
    npt::Random random(77, seed);
    npt::CorrespondenceFit fit;
    fit.part_distances.assign(24, 0.012);
    const auto pose = npt::natural_poses().sample(random);
    fit.body.axis_angles.assign(pose.begin(), pose.end());
    fit.body.betas = npt::sample_shape(random, npt::mannequin().shape_count());
    return fit;
  }
};

}  // namespace

TEST_CASE("hands that are as they were fitted stay so, exactly") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const PersonWithHands person(seed, {});
    CHECK(finger_fitter()(person.surface, person.fit) == std::array<npt::HandBend, 2>{});
  }
}

TEST_CASE("a fist is found, whichever hand makes it and however the faces turn") {
  constexpr npt::HandBend fist{.knuckles = 0.8, .middle = {1.4, 1.4, 1.4, 1.4}};
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    std::array<npt::HandBend, 2> hands;
    hands[side] = fist;
    const PersonWithHands person(4 + 2 * side, hands);
    for (const double facing : {1.0, 0.0}) {
      npt::CorrespondenceFit fit = person.fit;
      fit.facing = facing;
      const auto found = finger_fitter()(person.surface, fit);
      CHECK(found[1 - side] == npt::HandBend{});
      CHECK(found[side].knuckles == doctest::Approx(fist.knuckles).epsilon(0.3));
      for (const double middle : found[side].middle) CHECK(middle == doctest::Approx(1.4).epsilon(0.2));
    }
  }
}

TEST_CASE("hands that lie on the fitted ones aren't looked at") {
  std::array<npt::HandBend, 2> hands;
  hands[1] = {.knuckles = 0.8, .middle = {1.4, 1.4, 1.4, 1.4}};
  PersonWithHands person(4, hands);
  person.fit.part_distances.assign(24, 0.003);
  CHECK(finger_fitter()(person.surface, person.fit) == std::array<npt::HandBend, 2>{});
}

TEST_CASE("a finger that points is told from the others; the next frame starts from the last one") {
  std::array<npt::HandBend, 2> hands;
  hands[0] = {.knuckles = 0.6, .middle = {0.1, 1.5, 1.5, 1.5}};
  const PersonWithHands person(6, hands);
  const auto found = finger_fitter()(person.surface, person.fit);
  CHECK(found[0].middle[0] < 0.5);
  for (const std::size_t f : {1U, 2U, 3U}) CHECK(found[0].middle[f] > 1.1);
  const auto next = finger_fitter()(person.surface, person.fit, found);
  for (std::size_t f = 0; f < npt::finger_count; ++f)
    CHECK(next[0].middle[f] == doctest::Approx(found[0].middle[f]).epsilon(0.1));
}

TEST_CASE("where there is no hand, nothing is found") {
  const PersonWithHands person(7, {});
  npt::CorrespondenceFit elsewhere = person.fit;
  elsewhere.body.translation = {10, 0, 0};
  CHECK(finger_fitter()(person.surface, elsewhere) == std::array<npt::HandBend, 2>{});
}
