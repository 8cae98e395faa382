/// A built-in human figure in SMPL's parameter layout, so that demos, tests and training need no download.
///   6890 vertices, 13776 triangles: one closed surface without holes, symmetric in x; 24 joints; 10 shape directions
/// Shapes    as BodyModel; metres, y up, facing +z, rest pose T, origin between the hips, 1.75 m tall
/// Numerics  made in 10 ms; every call gives the same bits, and so did g++ 12 and clang++ 14 at every level of
///           optimisation and instruction set tried
/// Programs that link the library's compiled units (NPT_COMPILED, config.hpp) only see the declarations.
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/config.hpp>

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)
#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/anatomy.hpp>
#include <npt/body/mannequin/shape.hpp>
#include <npt/body/mannequin/skin.hpp>
#include <npt/body/mannequin/surface.hpp>
#include <npt/body/skeleton.hpp>
#endif

namespace npt::inline NPT_ABI {

#if !defined(NPT_COMPILED) || defined(NPT_COMPILING)

namespace internal {

NPT_INLINE BodyTables mannequin_tables() {
  const anatomy::Surface surface = anatomy::mannequin_surface();
  const Vec3d origin = anatomy::rounded(anatomy::origin);
  BodyTables body;
  for (const Vec3d p : surface.positions) {
    const Vec3f q = (p - origin).as<float>();
    body.v_template.insert(body.v_template.end(), {q.x, q.y, q.z});
  }
  body.shapedirs = anatomy::mannequin_shapedirs(surface);
  body.weights = anatomy::mannequin_weights(as_span(surface.positions));
  body.J_regressor = anatomy::mannequin_joint_regressor(as_span(surface.positions), as_span(surface.mirror));
  body.triangles = surface.triangles;
  body.parents.assign(smpl_parents.begin(), smpl_parents.end());
  body.joint_names.assign(smpl_joint_names.begin(), smpl_joint_names.end());
  body.metadata = {{"unit", "metre"},  {"up", "y"},        {"front", "z"},
                   {"rest_pose", "T"}, {"licence", "MIT"}, {"source", "npt's built-in mannequin, made by code"}};
  return body;
}

}  // namespace internal

#endif

/// Makes the mannequin's tables.
#ifdef NPT_COMPILED
BodyTables make_mannequin_tables();
#else
NPT_INLINE BodyTables make_mannequin_tables() { return internal::mannequin_tables(); }
#endif

NPT_INLINE BodyModel make_mannequin() { return BodyModel(make_mannequin_tables(), "mannequin"); }

/// The mannequin, made at the first call and then shared.
NPT_INLINE const BodyModel& mannequin() {
  static const BodyModel model = make_mannequin();
  return model;
}

}  // namespace npt::inline NPT_ABI
