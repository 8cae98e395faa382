/// Unit and up axis of a motion whose file says neither, as BVH: from the body that its skeleton is.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace npt::inline NPT_ABI {

namespace internal {

/// The turn that takes an axis to y.
inline Matrix3 to_y_up(Vec3d up) {
  const std::array<double, 3> along{std::abs(up.x), std::abs(up.y), std::abs(up.z)};
  const auto axis = static_cast<std::size_t>(std::ranges::max_element(along) - along.begin());
  if (axis == 0)
    return up.x > 0 ? Matrix3{{{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}}} : Matrix3{{{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}}};
  if (axis == 2)
    return up.z > 0 ? Matrix3{{{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}}} : Matrix3{{{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}}};
  return up.y > 0 ? Matrix3::identity() : Matrix3{{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}};
}

/// Upwards over the clip: people stand most of the time, also where their rest lies.
inline Vec3d mean_up(const Motion& motion, const JointRoles& roles) {
  constexpr int samples = 16;
  Vec3d sum{};
  if (!motion.clip.channels.empty())
    for (int i = 0; i <= samples; ++i)
      sum += normalised(upwards(roles.joints, joint_positions(motion, motion.clip.length() * i / samples)));
  return length(sum) > 0.5 * samples ? sum : upwards(roles.joints, joint_positions(motion, std::nullopt));
}

}  // namespace internal

/// The motion in metres with y up: its height becomes a person's in the first of metres, centimetres, millimetres,
/// inches and CMU's unit (0.45 inch scaled to metres, 0.05644) that makes it 1.2 to 2.2 metres, else 1.7 metres; an
/// animal's, from a mouse's to a dinosaur's, 0.1 to 10 metres, else 1 metre. One without legs and arms stays as it is.
inline Motion placed_motion(Motion motion) {
  const JointRoles roles = joint_roles(motion);
  if (roles.confidence < 0.3) return motion;
  const Matrix3 turn = internal::to_y_up(internal::mean_up(motion, roles));
  const Vec3d up = normalised(internal::upwards(roles.joints, joint_positions(motion, std::nullopt)));
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vec3d p : joint_positions(motion, std::nullopt))
    low = std::min(low, dot(p, up)), high = std::max(high, dot(p, up));
  const double height = high - low;
  if (!(height > 0)) return motion;
  const bool person = roles.kind() == SkeletonKind::person;
  const double least = person ? 1.2 : 0.1, most = person ? 2.2 : 10, usual = person ? 1.7 : 1;
  double unit = usual / height;
  for (const double known : {0.05644, 0.0254, 0.001, 0.01, 1.0})
    if (height * known >= least && height * known <= most) unit = known;
  motion.base = Affine{turn * unit, {}} * motion.base;
  return motion;
}

}  // namespace npt::inline NPT_ABI
