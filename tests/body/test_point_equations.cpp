#include <doctest/doctest.h>

#include <body/small_body.hpp>

#include <npt/base/random.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/body/point_equations.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace {

using npt::Vec3d;

struct Point {
  std::array<std::uint32_t, 3> corners;
  std::array<double, 3> weights;
  Vec3d direction;  ///< zero: all three axes, with an offset of (1, 2, 3)
};

std::vector<double> parameters(const npt::DifferentiableBody& body, double angle) {
  npt::Random random(3);
  std::vector<double> x;
  for (std::size_t i = 0; i < body.parameter_count(); ++i)
    x.push_back(random.normal() * (i >= 3 && i < 3 + 3 * body.joint_count() ? angle : 1));
  return x;
}

/// [n] How a point moves along a direction with each parameter, by differences.
std::vector<double> slopes(const npt::DifferentiableBody& body, std::vector<double> x, const Point& point,
                           Vec3d direction) {
  std::vector<Vec3d> points(body.vertex_count());
  const auto height = [&] {
    npt::DifferentiableBody::State state;
    body.forward(x, state, points);
    Vec3d sum;
    for (std::size_t c = 0; c < 3; ++c) sum += points[point.corners[c]] * point.weights[c];
    return dot(direction, sum);
  };
  std::vector<double> row;
  for (double& at : x) {
    constexpr double change = 1e-6;
    const double before = std::exchange(at, at - change), low = height();
    at = before + change;
    row.push_back((height() - low) / (2 * change));
    at = before;
  }
  return row;
}

/// The steps that both kinds of sums lead to.
void check_points(const npt::DifferentiableBody& body, double angle, std::span<const Point> all) {
  const std::vector<double> x = parameters(body, angle);
  std::vector<Vec3d> points(body.vertex_count());
  npt::DifferentiableBody::State state;
  body.forward(x, state, points);
  npt::PointEquations sums(body, x, state, all.size());
  npt::NormalEquations equations(x.size()), expected(x.size());
  std::vector<std::uint32_t> everything(x.size());
  std::iota(everything.begin(), everything.end(), 0U);
  npt::NormalEquations::Group rows = npt::NormalEquations::group(everything, 3 * all.size());
  const auto add_row = [&](const Point& point, Vec3d direction, double weight, double residual) {
    const std::vector<double> row = slopes(body, x, point, direction);
    std::copy(row.begin(), row.end(), rows.row(weight, residual).begin());
  };
  double weight = 0.5;
  for (const Point& p : all) {
    weight += 0.25;
    if (p.direction != Vec3d{}) {
      sums.add(p.corners, p.weights, p.direction, weight, 0.7);
      add_row(p, p.direction, weight, 0.7);
      continue;
    }
    sums.add(p.corners, p.weights, Vec3d{1, 2, 3}, weight);
    add_row(p, {1, 0, 0}, weight, 1), add_row(p, {0, 1, 0}, weight, 2), add_row(p, {0, 0, 1}, weight, 3);
  }
  sums.sum_into(equations);
  expected.add(rows);
  const std::vector<double> step = equations.solve(0.1, 0.1), same = expected.solve(0.1, 0.1);
  for (std::size_t i = 0; i < x.size(); ++i) {
    CAPTURE(i);
    CHECK(std::abs(equations.diagonal(i) - expected.diagonal(i)) < 1e-5 * (1 + expected.diagonal(i)));
    CHECK(std::abs(equations.right(i) - expected.right(i)) < 1e-5 * (1 + std::abs(expected.right(i))));
    CHECK(std::abs(step[i] - same[i]) < 1e-5 * (1 + std::abs(same[i])));
  }
}

const std::vector<Point> points{{{0, 3, 5}, {0.2, 0.5, 0.3}, {0.3, -0.8, 0.5}},
                                {{1, 1, 1}, {1, 0, 0}, {}},
                                {{2, 4, 0}, {0.4, 0.6, 0}, {0, 1, 0}},
                                {{5, 3, 0}, {0.3, 0.1, 0.6}, {}},
                                {{0, 0, 0}, {1, 0, 0}, {0.6, 0, 0.8}}};

}  // namespace

TEST_CASE("sums over points agree with differences, for angles of all sizes") {
  const npt::BodyModel model(small_body());
  for (const double angle : {1e-9, 0.3, 2.0}) check_points(npt::DifferentiableBody(model), angle, points);
}

TEST_CASE("so do those of a body of more joints than a set of bits holds") {
  npt::BodyTables tables = small_body();
  const std::size_t joints = 70, vertices = 6;
  tables.parents.clear();
  for (std::size_t j = 0; j < joints; ++j) tables.parents.push_back(static_cast<int>(j) - 1 - (j == 69 ? 60 : 0));
  std::vector<float> regressor(joints * vertices), weights(vertices * joints);
  for (std::size_t j = 0; j < joints; ++j) regressor[j * vertices + j % vertices] = 1;
  for (std::size_t v = 0; v < vertices; ++v) weights[v * joints + 12 * v] = 0.75F, weights[v * joints + 69] = 0.25F;
  for (std::size_t j = 0; j < 2; ++j) weights[j * joints + 69] = 0, weights[j * joints + 12 * j] = 1;
  tables.J_regressor = npt::SparseMatrix::from_dense(regressor, joints, vertices);
  tables.weights = npt::SparseMatrix::from_dense(weights, vertices, joints);
  const npt::BodyModel model(std::move(tables));
  const npt::DifferentiableBody body(model);
  CHECK(npt::DifferentiableBody::moves(body.movers(1), 12));
  CHECK(!npt::DifferentiableBody::moves(body.movers(1), 13));
  CHECK(npt::DifferentiableBody::moves(body.movers(5), 68));
  check_points(body, 0.1, points);
}

TEST_CASE("an object forgets what it summed") {
  const npt::BodyModel model(small_body());
  const npt::DifferentiableBody body(model);
  const std::vector<double> x = parameters(body, 0.3);
  std::vector<Vec3d> all(body.vertex_count());
  npt::DifferentiableBody::State state;
  body.forward(x, state, all);
  npt::PointEquations sums(body, x, state, 1);
  sums.add({0, 0, 0}, {1, 0, 0}, {1, 0, 0}, 1, 2);
  npt::NormalEquations first(x.size()), second(x.size());
  sums.sum_into(first);
  sums.sum_into(second);
  CHECK(first.right(0) == 2);
  CHECK(second.right(0) == 0);
}
