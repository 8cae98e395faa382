/// The shape of a person's body around its skeleton, as far as motions must know it: rings around the trunk from the
/// crotch to the top of the head, and the thickness of arms and thighs.
///   BodyShape shape = body_shape(scene, motion, roles);   of the scene that the motion was made of
/// Shapes    radii: [ring_sectors] by angle from the body's left over its front; places in metres with y up, as bound
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <array>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

inline constexpr std::size_t ring_sectors = 16;

struct BodyRing {
  std::size_t joint = no_item;  ///< that it moves with
  Vec3d centre{};
  std::array<double, ring_sectors> radii{};
};

struct BodyShape {
  std::vector<BodyRing> rings{};  ///< the lowest first; empty: nothing is known
  /// [sides] radii around the bones; 0: not known
  std::array<double, 2> upper_arm{}, lower_arm{}, hand{}, thigh{};
  bool empty() const { return rings.empty(); }
};

/// Of the source and the target; empty where there is no mesh.
struct RetargetShapes {
  BodyShape source{}, target{};
};

/// Requires  the motion and the roles of a skeleton of the scene. Empty where no skin moves with the skeleton.
inline BodyShape body_shape(const Scene& scene, const Motion& motion, const JointRoles& roles) {
  (void)scene, (void)motion, (void)roles;
  return {};
}

}  // namespace npt::inline NPT_ABI
