#include <doctest/doctest.h>

#include <npt/base/matrix3.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/correspondence_views.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include "estimate/people.hpp"

using people::Person;

namespace {

/// A person whose vertical axis is z, as many programs have it.
npt::SampledSurface z_up() {
  Person person(5);
  for (npt::Vec3f& p : person.mesh.positions) p = {p.x, -p.z, p.y};
  return npt::SampledSurface(npt::points_of(person.mesh.coordinates()), npt::mannequin().triangles(), 800);
}

const npt::Matrix3 rotation_of_z_up = npt::rotation_matrix({-std::numbers::pi / 2, 0, 0});

struct Seen {
  npt::CorrespondenceEstimator estimator = people::shipped_correspondences();
  npt::CorrespondenceFitter fitter{people::mannequins()};
  npt::CorrespondenceViews<npt::DefaultExecutor> views{estimator, fitter.correspondence_template(), {}};
};

}  // namespace

TEST_CASE("of the axes that may point up, the right one shows a body") {
  const Seen seen;
  const npt::SampledSurface surface = z_up();
  const std::vector<npt::BodyView> views = seen.views.other_axes(surface.samples());
  REQUIRE(views.size() == 5);
  CHECK(views[2].motion.residual < 0.1);
  CHECK(seen.views.least_residual(views) <= views[2].motion.residual);
  const npt::BodyView upright(seen.fitter.correspondence_template(),
                              seen.views.seen(surface.samples(), rotation_of_z_up));
  CHECK(upright.motion.residual < 0.1);
}

TEST_CASE("half of the views where one of them shows a body well, and all where they are asked for") {
  const Seen seen;
  const npt::SampledSurface surface = z_up();
  CHECK(seen.views.about_vertical(surface.samples(), rotation_of_z_up).size() == 5);
  const npt::CorrespondenceViews<npt::DefaultExecutor> all(seen.estimator, seen.fitter.correspondence_template(),
                                                           {.all = true});
  CHECK(all.about_vertical(surface.samples(), rotation_of_z_up).size() == 10);
}
