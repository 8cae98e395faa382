#include <doctest/doctest.h>

#include <npt/base/matrix3.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/correspondence_views.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/body/mannequin/mannequin.hpp>

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "estimate/people.hpp"

using people::Person;

namespace {

/// A person whose vertical axis is z, as many programs have it.
npt::FitSurface z_up() {
  Person person(5);
  for (npt::Vec3f& p : person.mesh.positions) p = {p.x, -p.z, p.y};
  return npt::FitSurface(person.mesh.coordinates(), npt::mannequin().triangles(), 800);
}

struct Seen {
  npt::CorrespondenceEstimator estimator = people::shipped_correspondences();
  npt::CorrespondenceFitter fitter{std::make_shared<const npt::BodyModel>(npt::mannequin())};
  npt::CorrespondenceViews<npt::DefaultExecutor> views{estimator, fitter.correspondence_template(), {}};
};

}  // namespace

TEST_CASE("the axis that points up is found, and a body explains what is seen then") {
  const Seen seen;
  const npt::FitSurface surface = z_up();
  const npt::UprightView best = seen.views.best_axis(surface.samples());
  const npt::Vec3d up = best.upright * npt::Vec3d{0, 0, 1};
  CHECK(up.y == doctest::Approx(1));
  CHECK(best.residual < 0.1);
  const std::array upright{seen.views.one(surface.samples(), best.upright)};
  CHECK(seen.views.least_residual(upright) < 0.1);
}

TEST_CASE("half of the views where one of them shows a body well, and all where they are asked for") {
  const Seen seen;
  const npt::FitSurface surface = z_up();
  const npt::Matrix3 upright = seen.views.best_axis(surface.samples()).upright;
  CHECK(seen.views.about_vertical(surface.samples(), upright).size() == 5);
  const npt::CorrespondenceViews<npt::DefaultExecutor> all(seen.estimator, seen.fitter.correspondence_template(),
                                                           {.all = true});
  CHECK(all.about_vertical(surface.samples(), upright).size() == 10);
}
