/// The joint angles of an estimated body, and where it stands.
/// Source    Loper et al., "SMPL", 2015 (joints and their order)
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <vector>

namespace npt::inline NPT_ABI {

/// The joint angles that were estimated for a mesh.
struct JointPose {
  std::vector<float> axis_angles;  ///< [24, 3], radians, each in its parent's frame
  Vec3d root;                      ///< the root joint's position, in the mesh's unit and place
  double leg = 0;  ///< length from the hip over the knee to the ankle, in the mesh's unit; mean of both legs
};

}  // namespace npt::inline NPT_ABI
