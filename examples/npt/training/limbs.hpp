/// The limbs of SMPL's skeleton: which part of a person each of the 24 joints moves.
#pragma once

#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI {

enum class Limb : std::size_t { trunk, skull, left_arm, right_arm, left_leg, right_leg };

inline constexpr std::size_t limb_count = 6;

/// Collars belong to the trunk, the neck to the skull.
constexpr Limb limb_of(std::size_t joint) {
  using enum Limb;
  constexpr std::array<Limb, smpl_joint_count> limbs{trunk,    left_leg,  right_leg, trunk,     left_leg, right_leg,
                                                     trunk,    left_leg,  right_leg, trunk,     left_leg, right_leg,
                                                     skull,    trunk,     trunk,     skull,     left_arm, right_arm,
                                                     left_arm, right_arm, left_arm,  right_arm, left_arm, right_arm};
  return limbs[joint];
}

}  // namespace npt::inline NPT_ABI
