#include <doctest/doctest.h>

#include <estimate/simulated_correspondences.hpp>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/estimate/surface_track.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace {

using npt::Vec3d;

/// A mannequin in a natural pose, and the track of its surface from where it truly is.
struct Followed {
  simulated::Posed posed;
  npt::BodyFit fit;
  npt::SampledSurface surface;
  npt::SurfaceTrack track;

  /// clothes: metres by which the surface stands off
  explicit Followed(std::uint64_t seed, double clothes = 0) : Followed(drawn(seed), clothes) {}

  /// The next frame's surface.
  npt::SampledSurface moved(const simulated::Posed& next, double clothes = 0) const {
    return surface.moved(std::span<const Vec3d>(off(next.points, clothes)), npt::mannequin().triangles());
  }

  static simulated::Posed drawn(std::uint64_t seed) {
    npt::Random random(seed);
    return simulated::draw(npt::mannequin(), {}, random);
  }

 private:
  Followed(const simulated::Posed& p, double clothes)
      : posed(p),
        fit{.translation = {}, .axis_angles = {p.pose.begin(), p.pose.end()}, .betas = p.betas},
        surface(std::span<const Vec3d>(off(p.points, clothes)), npt::mannequin().triangles()),
        track(npt::mannequin(), surface, fit, 1) {}

  static std::vector<Vec3d> off(std::span<const Vec3d> body, double clothes) {
    std::vector<Vec3d> normals(body.size()), result(body.begin(), body.end());
    for (const npt::Triangle& t : npt::mannequin().triangles()) {
      const Vec3d normal = cross(body[t[1]] - body[t[0]], body[t[2]] - body[t[0]]);
      for (const std::uint32_t v : t) normals[v] += normal;
    }
    for (std::size_t v = 0; v < result.size(); ++v) result[v] += normalised(normals[v]) * clothes;
    return result;
  }
};

simulated::Posed turned(simulated::Posed posed, float by) {
  for (std::size_t i = 3; i < 72; ++i) posed.pose[i] += by * (static_cast<float>(i % 3) - 1);
  posed.points = simulated::points_of(npt::mannequin(), posed.betas, posed.pose);
  return posed;
}

double error(const npt::BodyFit& fit, const simulated::Posed& truth) {
  return simulated::error(npt::mannequin(), fit, truth.points);
}

}  // namespace

TEST_CASE("a surface that stays keeps its angles") {
  const Followed f(10);
  npt::SurfaceTrack::Step step{f.fit, 1};
  for (int frame = 0; frame < 5; ++frame) step = f.track.follow(f.surface, step.body);
  CHECK(step.off < 1e-5);
  CHECK(error(step.body, f.posed) < 1e-4);
}

TEST_CASE("the next frame follows from the last one, with its shape; clothes keep their distance") {
  for (const double clothes : {0.0, 0.04}) {
    CAPTURE(clothes);
    const Followed f(11, clothes);
    const simulated::Posed next = turned(f.posed, 0.05F);
    const npt::SurfaceTrack::Step step = f.track.follow(f.moved(next, clothes), f.fit);
    CHECK(step.body.betas == f.fit.betas);
    CHECK(error(step.body, next) < (clothes > 0 ? 0.006 : 0.002));
    CHECK(step.off < (clothes > 0 ? 0.01 : 0.002));
  }
}

TEST_CASE("from one natural pose to another in one step") {
  for (const std::uint64_t seed : {12U, 13U, 14U}) {
    const Followed f(seed);
    simulated::Posed next = Followed::drawn(seed + 100);
    next.betas = f.posed.betas;
    next.points = simulated::points_of(npt::mannequin(), next.betas, next.pose);
    CAPTURE(seed);
    CHECK(error(f.track.follow(f.moved(next), f.fit).body, next) < 0.01);
  }
}

TEST_CASE("another person's surface is far off") {
  const Followed f(15);
  simulated::Posed other = f.posed;
  for (float& beta : other.betas) beta = 2.5F - beta;
  other.points = simulated::points_of(npt::mannequin(), other.betas, other.pose);
  CHECK(f.track.follow(f.moved(other), f.fit).off > 0.01);
}
