/// Bodies with SMPL's skeleton that are small enough for many samples.
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/skeleton.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

/// A body of 24 joints in a random tree with `per_joint` triangles at each: 72 * per_joint vertices, 3 shapes.
inline npt::BodyTables stick_figure(std::size_t per_joint) {
  npt::BodyTables body;
  npt::Random random(11, per_joint);
  body.parents.assign(npt::smpl_parents.begin(), npt::smpl_parents.end());
  std::vector<npt::Vec3d> joints;
  for (const int parent : body.parents) {
    const npt::Vec3d step{random.uniform(-0.2, 0.2), random.uniform(-0.3, 0.3), random.uniform(-0.1, 0.1)};
    joints.push_back(parent < 0 ? step : joints[static_cast<std::size_t>(parent)] + step);
  }
  body.J_regressor.columns = 72 * per_joint;
  body.weights.columns = joints.size();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const auto first = static_cast<std::uint32_t>(body.v_template.size() / 3);
    for (std::size_t i = 0; i < 3 * per_joint; ++i) {
      const double values[3] = {joints[j].x, joints[j].y, joints[j].z};
      for (const double x : values) body.v_template.push_back(static_cast<float>(x + random.uniform(-0.1, 0.1)));
      body.weights.append(static_cast<std::uint32_t>(j), 1.0F);
      body.weights.end_row();
      body.J_regressor.append(first + static_cast<std::uint32_t>(i), 1.0F / static_cast<float>(3 * per_joint));
    }
    body.J_regressor.end_row();
    for (std::uint32_t t = first; t < body.v_template.size() / 3; t += 3) body.triangles.push_back({t, t + 1, t + 2});
  }
  for (std::size_t i = 0; i < 3 * body.v_template.size(); ++i)
    body.shapedirs.push_back(static_cast<float>(0.02 * random.normal()));
  return body;
}
