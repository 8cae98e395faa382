#include <doctest/doctest.h>

#include <estimate/simulated_correspondences.hpp>

#include <npt/base/error.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/part_motion.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

namespace {

using npt::Vec3d;

struct Case {
  simulated::Posed posed;
  npt::Correspondences reading;
};

Case make(std::uint64_t seed, const simulated::Noise& noise) {
  npt::Random random(seed);
  Case c{simulated::draw(npt::mannequin(), {}, random), {}};
  const npt::SampledSurface surface(c.posed.points, npt::mannequin().triangles(), 1500);
  c.reading = simulated::read(surface, c.posed.points, npt::mannequin().triangles(), simulated::mannequin_places(),
                              npt::mannequin().tables().weights, 1000, noise, random);
  return c;
}

const npt::CorrespondenceTemplate& rest() {
  static const npt::BodyLevel level(npt::mannequin(), 1200);
  static const npt::CorrespondenceTemplate surface(npt::mannequin(), level, npt::people_plan());
  return surface;
}

/// The largest angle, in degrees, between the parts' rotations and the truth, of hips, knees, shoulders, elbows, chest.
double rotation_error(const Case& c, const npt::PartMotion& motion) {
  std::vector<npt::Matrix3> truth(24);
  double worst = 0;
  for (std::size_t j = 0; j < 24; ++j) {
    const float* a = &c.posed.pose[3 * j];
    truth[j] = npt::rotation_matrix({a[0], a[1], a[2]});
    if (j > 0) truth[j] = truth[static_cast<std::size_t>(npt::smpl_parents[j])] * truth[j];
  }
  for (const std::size_t j : {1U, 2U, 4U, 5U, 9U, 16U, 17U, 18U, 19U})
    worst = std::max(worst, length(npt::axis_angle(truth[j].transposed() * motion.parts[j].rotation)));
  return worst * 180 / std::numbers::pi;
}

}  // namespace

TEST_CASE("places without errors give the rotations of parts, but for what bends within one") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Case c = make(seed, {.place = 0, .part = 0, .wild = 0});
    const npt::PartMotion motion = npt::part_motion(rest(), c.reading);
    CAPTURE(seed);
    CHECK(rotation_error(c, motion) < 35);
    CHECK(motion.residual < 0.03);
    CHECK(motion.size == doctest::Approx(1).epsilon(0.1));
    REQUIRE(motion.axis_angles.size() == 72);
  }
}

TEST_CASE("so do noisy places of which some are wild, roughly; and the residual tells a wrong reading") {
  for (const std::uint64_t seed : {4U, 5U, 6U}) {
    Case c = make(seed, {});
    const npt::PartMotion motion = npt::part_motion(rest(), c.reading);
    CAPTURE(seed);
    CHECK(rotation_error(c, motion) < 80);
    CHECK(motion.residual < 0.11);
    for (npt::PointCorrespondence& p : c.reading) p.place.x = -p.place.x;
    CHECK(npt::part_motion(rest(), c.reading).residual > 1.2 * motion.residual);
  }
}

TEST_CASE("a mesh in another unit has another size, and the same rotations") {
  Case c = make(7, {});
  const npt::PartMotion before = npt::part_motion(rest(), c.reading);
  for (npt::PointCorrespondence& p : c.reading) p.point *= 100;
  const npt::PartMotion after = npt::part_motion(rest(), c.reading);
  CHECK(after.size == doctest::Approx(100 * before.size));
  CHECK(after.residual == doctest::Approx(before.residual));
  for (std::size_t i = 0; i < 72; ++i) CHECK(std::abs(after.axis_angles[i] - before.axis_angles[i]) < 1e-6);
}

TEST_CASE("too few points, and places that are no numbers, are errors") {
  Case c = make(8, {});
  npt::Correspondences few(c.reading.begin(), c.reading.begin() + 19);
  CHECK_THROWS_AS(npt::part_motion(rest(), few), npt::Error);
  c.reading[3].place.y = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(npt::part_motion(rest(), c.reading), npt::Error);
}
