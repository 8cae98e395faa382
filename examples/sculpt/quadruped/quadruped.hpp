/// The four-legged template body: npt's own animal, sculpted as the mannequin was, in the joints of quadruped.plan.
/// Shapes    as BodyModel; metres, y up, facing +z, standing, soles at y = 0, 0 in the middle of its length
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/mannequin/surface.hpp>
#include <npt/body/plan_poses.hpp>

#include <sculpt/quadruped/anatomy.hpp>
#include <sculpt/quadruped/shape.hpp>
#include <sculpt/quadruped/skin.hpp>
#include <sculpt/quadruped/surface.hpp>
#include <string>

namespace sculpt::quadruped {

/// plan_text, pose_text: quadruped.plan and quadruped.poses, which the body's metadata keeps as "plan" and "poses".
inline npt::BodyModel make_body(const std::string& plan_text, const std::string& pose_text) {
  const npt::BodyPlan plan = npt::read_body_plan(plan_text, "quadruped.plan");
  // Only a table that fits the plan may go into the file.
  const npt::PlanPoses poses(plan, pose_text, "quadruped.poses");
  const npt::anatomy::Surface surface = npt::anatomy::mirrored(half());
  const Vec3d zero = npt::anatomy::rounded(origin);
  npt::BodyTables body;
  for (const Vec3d p : surface.positions) {
    const npt::Vec3f q = (p - zero).as<float>();
    body.v_template.insert(body.v_template.end(), {q.x, q.y, q.z});
  }
  body.shapedirs = shapedirs(surface);
  body.weights = skin_weights(surface, plan);
  body.J_regressor = joint_regressor(surface, body.weights, plan);
  body.triangles = surface.triangles;
  for (const npt::JointPlan& joint : plan.joints) {
    body.parents.push_back(joint.parent);
    body.joint_names.push_back(joint.name);
  }
  body.metadata = {{"unit", "metre"},   {"up", "y"},
                   {"front", "z"},      {"rest_pose", "standing"},
                   {"licence", "MIT"},  {"source", "npt's four-legged template, made by code"},
                   {"plan", plan_text}, {"poses", pose_text}};
  return npt::BodyModel(std::move(body), "quadruped");
}

}  // namespace sculpt::quadruped
