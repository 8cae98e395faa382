/// Linear blend skinning: a point goes to the weighted mean of where its joints bring it. Two ways that are equal up to
/// rounding: to move the point by each joint and take the mean, or to move it by the mean of the joints' motions, which
/// carries normals, too.
/// Shapes    joints, weights: equally many, of one point; a joint of weight 0 takes no part
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <iterator>
#include <type_traits>

namespace npt::inline NPT_ABI {

/// `sum` and the weighted sum of what moved(j) gives: where joint j brings the point, or a direction.
template <class Joints, class Weights, class Moved>
Vec3d skinned(const Joints& joints, const Weights& weights, const Moved& moved, Vec3d sum = {}) {
  for (std::size_t i = 0; i < std::size(joints); ++i)
    if (weights[i] != 0) sum += moved(joints[i]) * static_cast<double>(weights[i]);
  return sum;
}

namespace internal {

/// The joints 0 .. count - 1.
struct AllJoints {
  std::size_t count = 0;

  constexpr std::size_t size() const { return count; }
  constexpr std::size_t operator[](std::size_t i) const { return i; }
};

constexpr const Matrix3& linear_part(const Rigid& r) { return r.rotation; }
template <class T>
constexpr const BasicMatrix3<T>& linear_part(const BasicAffine<T>& a) {
  return a.linear;
}

}  // namespace internal

/// The same for weights of all joints, in their order.
template <class Weights, class Moved>
Vec3d skinned(const Weights& weights, const Moved& moved) {
  return skinned(internal::AllJoints{std::size(weights)}, weights, moved);
}

/// sum += weight * motion
template <class T, class Motion>
constexpr void add_motion(BasicAffine<T>& sum, const Motion& motion, std::type_identity_t<T> weight) {
  sum.linear += internal::linear_part(motion) * weight;
  sum.shift += motion.shift * weight;
}

/// The weighted sum of the joints' motions; motions[j]: of joint j, an affine map or a rigid one
template <class Joints, class Weights, class Motions>
auto blended_motion(const Joints& joints, const Weights& weights, const Motions& motions) {
  using T = std::remove_cvref_t<decltype(motions[0].shift.x)>;
  BasicAffine<T> sum{{}, {}};
  for (std::size_t i = 0; i < std::size(joints); ++i)
    if (weights[i] != 0) add_motion(sum, motions[joints[i]], static_cast<T>(weights[i]));
  return sum;
}

}  // namespace npt::inline NPT_ABI
