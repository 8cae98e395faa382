#include <doctest/doctest.h>

#include <estimate/nearest_fit.hpp>
#include <estimate/people.hpp>
#include <estimate/simulated_correspondences.hpp>

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/proportions.hpp>
#include <npt/estimate/correspondence_fit.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace {

using npt::Vec3d;

const npt::CorrespondenceFitter& fitter() {
  static const npt::CorrespondenceFitter shared(people::mannequins());
  return shared;
}

struct ReadBody {
  simulated::Posed posed;
  npt::SampledSurface surface;
  npt::Correspondences reading;
};

ReadBody read_body(std::uint64_t seed, const simulated::Noise& noise = {}) {
  npt::Random random(seed);
  const simulated::Posed posed = simulated::draw(npt::mannequin(), {}, random);
  const npt::SampledSurface surface(posed.points, npt::mannequin().triangles());
  return {posed, surface,
          simulated::read(surface, posed.points, npt::mannequin().triangles(), simulated::mannequin_places(),
                          npt::mannequin().tables().weights, 1000, noise, random)};
}

}  // namespace

TEST_CASE("bodies that the model makes come back from noisy readings") {
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const ReadBody c = read_body(seed, {.swap_one_arm = seed == 2, .swap_arms = seed == 3, .swap_legs = seed == 4});
    const npt::CorrespondenceFit fit = nearest_fit(fitter(), c.surface, c.reading);
    CAPTURE(seed);
    const double error = simulated::error(npt::mannequin(), fit.body, c.posed.points);
    CHECK(error < 0.015);
    CHECK(fit.body.distance < 0.003);
    CHECK(fit.mesh_explained > 0.98);
    CHECK(fit.facing == 1);
    sum += error / 6;
  }
  CHECK(sum < 0.007);
}

TEST_CASE("of several readings the right one is taken") {
  const ReadBody c = read_body(7);
  std::vector<npt::Correspondences> readings(3, c.reading);
  for (npt::PointCorrespondence& p : readings[0]) p.place.x = -p.place.x;
  npt::Random random(2);
  for (npt::PointCorrespondence& p : readings[1])
    p.place = readings[2][random.below(static_cast<std::uint32_t>(readings[2].size()))].place;
  std::vector<npt::BodyView> views;
  for (npt::Correspondences& seen : readings) views.emplace_back(fitter().correspondence_template(), std::move(seen));
  const std::vector<npt::CorrespondenceFit> fits = fitter().fits(c.surface, views);
  CHECK(fits.size() <= 3);
  for (std::size_t i = 0; i < fits.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) CHECK(fits[i].body.axis_angles != fits[k].body.axis_angles);
  const npt::CorrespondenceFit fit = nearest_of(fits);
  CHECK(simulated::error(npt::mannequin(), fit.body, c.posed.points) < 0.015);
}

TEST_CASE("triangles that turn inwards are told by the reading") {
  ReadBody c = read_body(8);
  std::vector<npt::Triangle> turned(npt::mannequin().triangles().begin(), npt::mannequin().triangles().end());
  for (npt::Triangle& t : turned) std::swap(t[0], t[1]);
  const npt::SampledSurface surface(c.posed.points, turned);
  for (npt::PointCorrespondence& p : c.reading) p.normal = -p.normal;
  const npt::CorrespondenceFit fit = nearest_fit(fitter(), surface, c.reading);
  CHECK(fit.facing == -1);
  CHECK(fit.body.distance < 0.003);
}

TEST_CASE("what isn't a body is trusted less") {
  ReadBody c = read_body(9);
  // Half as wide again, and the arms cut off at places that the body has.
  std::vector<Vec3d> points = c.posed.points;
  for (Vec3d& p : points) p = {1.6 * p.x, 0.7 * p.y, 0.4 * p.z};
  for (npt::PointCorrespondence& p : c.reading) p.point = {1.6 * p.point.x, 0.7 * p.point.y, 0.4 * p.point.z};
  const npt::CorrespondenceFit fit =
      nearest_fit(fitter(), npt::SampledSurface(points, npt::mannequin().triangles()), c.reading);
  CHECK(fit.mesh_explained < 0.97);
  CHECK(fit.relative_distance > 0.005);
}

TEST_CASE("half and one and a half times the size fit as well, with proportions") {
  static const npt::BodyModel model = npt::with_proportions(npt::mannequin(), npt::human_proportion_deviations);
  static const npt::CorrespondenceFitter wide(npt::people_kind(npt::borrowed(model)));
  for (const double scale : {0.5, 1.5}) {
    ReadBody c = read_body(13);
    for (Vec3d& p : c.posed.points) p *= scale;
    for (npt::PointCorrespondence& p : c.reading) p.point *= scale;
    const npt::CorrespondenceFit fit =
        nearest_fit(wide, npt::SampledSurface(c.posed.points, npt::mannequin().triangles()), c.reading);
    CAPTURE(scale);
    CHECK(simulated::error(model, fit.body, c.posed.points) < 0.015 * scale);
    CHECK(fit.mesh_explained > 0.98);
  }
}

TEST_CASE("threads share a fitter and get the same bits") {
  const ReadBody c = read_body(11);
  std::vector<npt::CorrespondenceFit> fits(2);
  std::thread other([&] { fits[1] = nearest_fit(fitter(), c.surface, c.reading); });
  fits[0] = nearest_fit(fitter(), c.surface, c.reading);
  other.join();
  CHECK(fits[0].body.axis_angles == fits[1].body.axis_angles);
  CHECK(fits[0].body.betas == fits[1].body.betas);
  CHECK(fits[0].body.distance == fits[1].body.distance);
}

TEST_CASE("views that are fitted for themselves: the right one is nearest, and three poses are finished at most") {
  const ReadBody c = read_body(14);
  std::vector<npt::BodyView> views;
  for (const double angle : {0.0, 1.0, 2.0, 3.0}) {  // the right places, and those of a body that is turned away
    npt::Correspondences seen = c.reading;
    for (npt::PointCorrespondence& p : seen) p.place = npt::rotation_matrix({angle, 0, 0}) * p.place;
    views.emplace_back(fitter().correspondence_template(), std::move(seen));
  }
  const std::vector<npt::CorrespondenceFit> fits = fitter().fits(c.surface, views, npt::SerialExecutor(), false);
  CHECK(fits.size() <= 3);
  CHECK(simulated::error(npt::mannequin(), nearest_of(fits).body, c.posed.points) < 0.015);
}

TEST_CASE("no view and another unit have no fit; no reading and no body are errors") {
  const ReadBody c = read_body(12);
  CHECK(fitter().fits(c.surface, std::span<const npt::BodyView>()).empty());
  CHECK_THROWS_AS(nearest_fit(fitter(), c.surface, npt::Correspondences()), npt::Error);
  CHECK_THROWS_AS(npt::CorrespondenceFitter(nullptr), npt::Error);
  // Centimetres.
  std::vector<Vec3d> points = c.posed.points;
  npt::Correspondences reading = c.reading;
  for (Vec3d& p : points) p *= 100;
  for (npt::PointCorrespondence& p : reading) p.point *= 100;
  const npt::BodyView view(fitter().correspondence_template(), std::move(reading));
  CHECK(fitter().fits(npt::SampledSurface(points, npt::mannequin().triangles()), std::span(&view, 1)).empty());
}

TEST_CASE("a fit that is polished by all samples lies nearer to the truth in the mean") {
  double before = 0, after = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const ReadBody c = read_body(seed);
    const npt::CorrespondenceFit fit = nearest_fit(fitter(), c.surface, c.reading);
    const npt::BodyView view(fitter().correspondence_template(), c.reading);
    const npt::CorrespondenceFit polished = fitter().polished(c.surface, view, fit);
    before += simulated::error(npt::mannequin(), fit.body, c.posed.points);
    after += simulated::error(npt::mannequin(), polished.body, c.posed.points);
    CHECK(polished.facing == fit.facing);
  }
  CHECK(after < before);
}
