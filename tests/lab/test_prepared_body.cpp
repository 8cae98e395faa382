// Bodies as samplers hold them, and the vertices that their bounding boxes hang on.
#include <doctest/doctest.h>
#include <lab/figures.hpp>
#include <npt/body/body_model.hpp>
#include <npt/lab/extreme_vertices.hpp>
#include <npt/lab/prepared_body.hpp>

#include <memory>
#include <numbers>
#include <set>
#include <vector>

TEST_CASE("a prepared body has SMPL's joints and its edges once") {
  const npt::BodyModel body(stick_figure(1));
  const npt::data::PreparedBody prepared(npt::borrowed(body));
  CHECK(prepared.model.get() == &body);
  CHECK(prepared.edges == npt::edges_of_triangles(body.triangles()));
  CHECK_THROWS_AS(npt::data::PreparedBody{nullptr}, npt::Error);
}

TEST_CASE("a body of other joints is refused") {
  npt::BodyTables tables = stick_figure(1);
  tables.parents.pop_back();
  std::vector<float> regressor = tables.J_regressor.to_dense();
  regressor.resize(23 * tables.vertex_count());
  tables.J_regressor = npt::SparseMatrix::from_dense(regressor, 23, tables.vertex_count());
  std::vector<float> weights(23 * tables.vertex_count());
  for (std::size_t v = 0; v < tables.vertex_count(); ++v) weights[23 * v] = 1;
  tables.weights = npt::SparseMatrix::from_dense(weights, tables.vertex_count(), 23);
  tables.joint_names.clear();
  CHECK_THROWS_AS(npt::data::PreparedBody(std::make_shared<const npt::BodyModel>(std::move(tables))), npt::Error);
}

TEST_CASE("extremes are the vertices on the sides of the turned box and the one farthest from its centre") {
  const std::vector<float> xyz{-1, 0, 0, 1, 0, 0, 0, -2, 0, 0, 2, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0.6F, 0, 0.6F};
  std::set<std::uint32_t> found;
  npt::data::add_extremes(xyz, 0, found);
  CHECK(found == std::set<std::uint32_t>{0, 1, 2, 3, 4, 5});
  found.clear();
  npt::data::add_extremes(xyz, std::numbers::pi / 4, found);  // the corner at 0.6, 0.6 now leads in one direction
  CHECK(found.contains(7));
  CHECK_FALSE(found.contains(6));
}

TEST_CASE("a mixture of poses gives each its part") {
  const npt::data::PoseMixture mixture{.wide = 0.2, .natural = 0.5};
  CHECK(mixture.at(0.1) == npt::PoseDistribution::wide);
  CHECK(mixture.at(0.2) == npt::PoseDistribution::natural);
  CHECK(mixture.at(0.6) == npt::PoseDistribution::natural);
  CHECK(mixture.at(0.8) == npt::PoseDistribution::paper);
  CHECK(npt::data::PoseMixture{}.at(0) == npt::PoseDistribution::paper);
}

TEST_CASE("extreme vertices are ascending and grow with the number of trials") {
  const npt::BodyModel body(stick_figure(2));
  const auto few = npt::data::extreme_vertices(body, npt::ShapeDistribution::normal, 0, {}, 3);
  const auto many = npt::data::extreme_vertices(body, npt::ShapeDistribution::normal, 0, {}, 20);
  CHECK(std::ranges::is_sorted(many));
  CHECK(std::ranges::includes(many, few));
  CHECK(few.size() >= 4);
}
