#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/baseline/fit/body_distance.hpp>
#include <npt/baseline/fit/fit_target.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/pose_prior.hpp>
#include <npt/body/pose_sampler.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace {

using npt::Vec3d;

/// The mannequin of some shape in some pose, moved by 10 cm.
npt::FitTarget some_target() {
  npt::Random random(3);
  const std::vector<float> betas = npt::sample_shape(random, 10);
  const npt::Mesh mesh = npt::to_mesh(npt::mannequin(), betas, npt::sample_pose(random));
  std::vector<Vec3d> points;
  for (const npt::Vec3f p : mesh.positions) points.push_back(p.as<double>() + Vec3d{0.1, 0, 0});
  return npt::FitTarget(points, npt::triangulate(mesh), 500);
}

std::vector<double> some_parameters(std::size_t count) {
  npt::Random random(2);
  std::vector<double> x;
  for (std::size_t i = 0; i < count; ++i) x.push_back(0.1 * random.normal());
  return x;
}

}  // namespace

TEST_CASE("a level's probes share the area, and its triangles are a closed surface of its vertices") {
  const npt::BodyModel& model = npt::mannequin();
  const npt::BodyLevel coarse(model, 400);
  REQUIRE(coarse.body().vertex_count() == 400);
  REQUIRE(coarse.probes().size() == 400);
  double area = 0;
  for (std::uint32_t i = 0; i < 400; ++i) {
    CHECK(coarse.probes()[i].vertex == i);
    CHECK(std::abs(length(coarse.probes()[i].normal) - 1) < 1e-9);
    area += coarse.probes()[i].area;
  }
  CHECK(std::abs(area - 1) < 1e-9);
  // Euler: a closed surface like the body's has 2 V - 4 triangles; small cells may touch in fewer places.
  CHECK(coarse.triangles().size() > 750);
  CHECK(coarse.triangles().size() < 850);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const npt::Triangle& t : coarse.triangles())
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  std::size_t closed = 0;
  for (const auto& [side, count] : sides) closed += sides.contains({side.second, side.first}) ? 1U : 0U;
  CHECK(closed > sides.size() * 97 / 100);

  const npt::BodyLevel full = npt::BodyLevel::full(model, 300);
  CHECK(full.body().vertex_count() == model.vertex_count());
  CHECK(full.triangles().size() == model.triangles().size());
  CHECK(full.probes().size() == 300);
}

TEST_CASE("the distance's gradient agrees with differences") {
  const npt::FitTarget target = some_target();
  const npt::BodyLevel level(npt::mannequin(), 300);
  const npt::PosePrior prior(npt::mannequin(), npt::people_plan());
  npt::BodyDistance distance(
      level, target, {.scale = 0.2, .pose_prior = 0.1, .shape_prior = 0.02, .bend_prior = 0.1, .mesh_points = 400},
      prior);
  std::vector<double> x = some_parameters(level.body().parameter_count());
  std::vector<double> gradient(x.size()), ignored(x.size());
  const double value = distance(x, gradient);
  CHECK(value > 1);
  CHECK(distance.data_value() < value);
  CHECK(distance.data_value() > 0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    constexpr double change = 1e-6;
    const double at = x[i];
    x[i] = at + change;
    const double after = distance(x, ignored);
    x[i] = at - change;
    const double before = distance(x, ignored);
    x[i] = at;
    const double difference = (after - before) / (2 * change);
    CHECK_MESSAGE(std::abs(gradient[i] - difference) < 1e-3 * (1 + std::abs(difference)), "parameter ", i, ": ",
                  gradient[i], " and by differences ", difference);
  }
}

TEST_CASE("the distance of a body from itself is nothing, and hints of earlier calls don't change a value") {
  const npt::BodyModel& model = npt::mannequin();
  const npt::Mesh mesh = npt::to_mesh(model);
  std::vector<Vec3d> points;
  for (const npt::Vec3f p : mesh.positions) points.push_back(p.as<double>());
  const npt::FitTarget target(points, npt::triangulate(mesh), 500);
  const npt::BodyLevel level = npt::BodyLevel::full(model, 300);
  const npt::PosePrior prior(model);
  npt::BodyDistance distance(level, target, {.mesh_points = 500}, prior), fresh = distance;
  std::vector<double> zero(level.body().parameter_count(), 0.0), gradient(zero.size());
  const std::vector<double> x = some_parameters(zero.size());
  CHECK(distance(zero, gradient) < 1e-9);
  const double value = distance(x, gradient);
  CHECK(value == fresh(x, gradient));
}

TEST_CASE("the prior's gradient agrees with differences, and wrong bends cost more than right ones") {
  const npt::PosePrior prior(npt::mannequin(), npt::people_plan());
  npt::Random random(4);
  std::vector<double> theta(72), gradient(72, 0.0), ignored(72);
  for (double& angle : theta) angle = 1.5 * random.normal();
  prior(theta, 0.3, 0.7, gradient);
  for (std::size_t i = 0; i < 72; ++i) {
    constexpr double change = 1e-6;
    const double at = theta[i];
    theta[i] = at + change;
    const double after = prior(theta, 0.3, 0.7, ignored);
    theta[i] = at - change;
    const double before = prior(theta, 0.3, 0.7, ignored);
    theta[i] = at;
    CHECK(std::abs(gradient[i] - (after - before) / (2 * change)) < 1e-4);
  }
  const auto cost = [&](npt::SmplJoint joint, std::size_t axis, double angle) {
    std::vector<double> pose(72, 0.0);
    pose[3 * joint_index(joint) + axis] = angle;
    return prior(pose, 0.1, 1, ignored);
  };
  using enum npt::SmplJoint;
  CHECK(cost(left_knee, 0, 1) < cost(left_knee, 0, -1));
  CHECK(cost(right_elbow, 1, 1) < cost(right_elbow, 1, -1));
  CHECK(cost(left_elbow, 1, -1) < cost(left_elbow, 1, 1));
  CHECK(cost(left_elbow, 1, -1) < cost(left_elbow, 0, -1));    // about its own axis
  CHECK(cost(right_knee, 0, 2.3) < cost(right_knee, 0, 3.2));  // heel through thigh
  CHECK(cost(pelvis, 1, 3) == cost(pelvis, 1, 0));
}

TEST_CASE("in the curvature's coordinates the distance of close surfaces grows about equally in all directions") {
  npt::Random random(1);
  const npt::BodyModel& model = npt::mannequin();
  const npt::Mesh mesh = npt::to_mesh(model);
  std::vector<Vec3d> points;
  for (const npt::Vec3f p : mesh.positions) points.push_back(p.as<double>());
  const npt::FitTarget target(points, npt::triangulate(mesh), 1000);
  const npt::BodyLevel coarse(model, 300), full = npt::BodyLevel::full(model, 1000);
  const npt::PosePrior prior(model);
  const npt::BodyDistanceOptions options{.scale = 1, .mesh_points = 1000};
  npt::BodyDistance distance(full, target, options, prior);
  const std::size_t n = full.body().parameter_count();
  const std::vector<double> zero(n, 0.0);
  const npt::DenseCholesky curvature = npt::body_curvature(coarse, prior, options, zero, n);
  double least = 1e9, most = 0;
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<double> y(n), gradient(n);
    for (double& v : y) v = random.normal();
    double square = 0;
    for (const double v : y) square += v * v;
    for (double& v : y) v *= 0.02 / std::sqrt(square);
    curvature.solve_upper(y);
    const double growth = distance(y, gradient) / (0.5 * 0.02 * 0.02);
    least = std::min(least, growth);
    most = std::max(most, growth);
  }
  CHECK(least > 0.1);
  CHECK(most < 6.5);
  const std::vector<double> wild(n, std::nan(""));
  CHECK_THROWS_AS(npt::body_curvature(coarse, prior, options, wild, n), npt::Error);
}
