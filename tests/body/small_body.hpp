/// A body small enough to check by hand: six vertices, three joints in a chain, three shape directions.
#pragma once

#include <npt/base/random.hpp>
#include <npt/body/body_tables.hpp>

#include <vector>

inline npt::BodyTables small_body() {
  npt::BodyTables body;
  body.v_template = {1, 0, 0, -1, 0, 0, 0, 1, 0.5F, 0, 2, 0, 0.5F, 3, 0, -0.5F, 3, 1};
  npt::Random random(1);
  for (std::size_t i = 0; i < 3 * body.v_template.size(); ++i) {
    body.shapedirs.push_back(static_cast<float>(0.1 * random.normal()));
  }
  body.J_regressor = npt::SparseMatrix::from_dense(
      std::vector<float>{0.5F, 0.5F, 0, 0, 0, 0, 0, 0, 0.25F, 0.75F, 0, 0, 0, 0, 0, 0, 0.5F, 0.5F}, 3, 6);
  body.weights = npt::SparseMatrix::from_dense(
      std::vector<float>{1, 0, 0, 0.9F, 0.1F, 0, 0.5F, 0.5F, 0, 0, 0.75F, 0.25F, 0, 0.5F, 0.5F, 0.2F, 0.3F, 0.5F}, 6,
      3);
  body.triangles = {{0, 2, 1}, {2, 4, 5}, {3, 4, 5}};
  body.parents = {-1, 0, 1};
  return body;
}
