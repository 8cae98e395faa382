#include <doctest/doctest.h>

#include <body/small_body.hpp>

#include <npt/base/random.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/mesh/points.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using npt::Vec3d;

npt::BodyModel body_with_corrections() {
  npt::BodyTables tables = small_body();
  npt::Random random(7);
  for (std::size_t i = 0; i < tables.v_template.size() * 9 * 2; ++i)
    tables.posedirs.push_back(static_cast<float>(0.1 * random.normal()));
  return npt::BodyModel(std::move(tables));
}

/// Translation, axis angles and betas; `angle` is their size in radians.
std::vector<double> parameters(double angle) {
  npt::Random random(3);
  std::vector<double> x;
  for (int i = 0; i < 3 + 9 + 3; ++i) x.push_back(random.normal() * (i >= 3 && i < 12 ? angle : 1));
  return x;
}

double weighted_sum(const std::vector<Vec3d>& points, const std::vector<Vec3d>& weights) {
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) sum += dot(points[i], weights[i]);
  return sum;
}

void check_gradient(const npt::DifferentiableBody& body, std::vector<double> x) {
  npt::Random random(5);
  std::vector<Vec3d> weights, points(body.vertex_count());
  for (std::size_t i = 0; i < points.size(); ++i)
    weights.push_back({random.normal(), random.normal(), random.normal()});
  npt::DifferentiableBody::State state;
  body.forward(x, state, points);
  std::vector<double> gradient(body.parameter_count(), 0.0);
  body.backward(x, state, weights, gradient);
  for (std::size_t i = 0; i < x.size(); ++i) {
    constexpr double change = 1e-6;
    const double at = x[i];
    x[i] = at + change;
    body.forward(x, state, points);
    const double after = weighted_sum(points, weights);
    x[i] = at - change;
    body.forward(x, state, points);
    const double before = weighted_sum(points, weights);
    x[i] = at;
    const double difference = (after - before) / (2 * change);
    CHECK_MESSAGE(std::abs(gradient[i] - difference) < 1e-6 * (1 + std::abs(difference)), "parameter ", i, ": ",
                  gradient[i], " and by differences ", difference);
  }
}

}  // namespace

TEST_CASE("vertices are those of the body model") {
  const npt::BodyModel model = body_with_corrections();
  const npt::DifferentiableBody body(model);
  const std::vector<double> x = parameters(0.7);
  std::vector<float> angles, betas, expected(3 * model.vertex_count());
  std::transform(x.begin() + 3, x.begin() + 12, std::back_inserter(angles), [](double v) { return float(v); });
  std::transform(x.begin() + 12, x.end(), std::back_inserter(betas), [](double v) { return float(v); });
  model.posed(betas, angles, expected);
  std::vector<Vec3d> points(body.vertex_count());
  npt::DifferentiableBody::State state;
  body.forward(x, state, points);
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3d q = npt::point_at(expected, v) + Vec3d{x[0], x[1], x[2]};
    CHECK(length(points[v] - q) < 1e-5);
  }
}

TEST_CASE("a subset has the same vertices") {
  const npt::BodyModel model = body_with_corrections();
  const npt::DifferentiableBody all(model), some(model, {4, 1});
  const std::vector<double> x = parameters(0.7);
  std::vector<Vec3d> points(6), two(2);
  npt::DifferentiableBody::State state;
  all.forward(x, state, points);
  some.forward(x, state, two);
  CHECK(two[0] == points[4]);
  CHECK(two[1] == points[1]);
}

TEST_CASE("gradients agree with differences, for angles of all sizes") {
  const npt::BodyModel model = body_with_corrections();
  for (const double angle : {0.0, 1e-9, 1e-3, 0.7, 3.0}) {
    CAPTURE(angle);
    check_gradient(npt::DifferentiableBody(model), parameters(angle));
  }
}

TEST_CASE("gradients agree with differences without corrections and for a subset") {
  const npt::BodyModel model(small_body());
  check_gradient(npt::DifferentiableBody(model), parameters(0.7));
  check_gradient(npt::DifferentiableBody(model, {5, 0, 3}), parameters(1.5));
}

TEST_CASE("a carried direction turns with its bones") {
  const npt::BodyModel model(small_body());
  const npt::DifferentiableBody body(model);
  std::vector<double> x(body.parameter_count(), 0.0);
  x[5] = std::acos(-1.0) / 2;  // the root, a quarter turn about z
  std::vector<Vec3d> points(body.vertex_count());
  npt::DifferentiableBody::State state;
  body.forward(x, state, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    CHECK(length(body.carried(i, {1, 0, 0}, state) - Vec3d{0, 1, 0}) < 1e-6);
}
