/// How a motion is put on another skeleton (retarget.hpp).
#pragma once

#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// Which joint carries the way over the ground.
enum class RootMotion {
  keep,    ///< the hips
  extract  ///< the joint without parent, as game engines want it; the hips, where these have no parent
};

struct RetargetOptions {
  /// Feet that stand in the source are held on the target, and no foot sinks below the source's ground.
  bool foot_lock = true;
  /// How far arms and thighs are kept out of the body, 0 (not at all) to 1. Needs the target's BodyShape.
  double clearance = 1;
  /// Hands that touch the own body in the source touch it in the target. Needs both BodyShapes; hands that touch each
  /// other need none.
  bool touch = true;
  /// The way over the ground is left out: heights and turns stay.
  bool in_place = false;
  RootMotion root_motion = RootMotion::keep;
  /// Joints for the twist of forearms, upper arms and thighs take their share.
  bool twist = true;
  /// Keys are left out where linear interpolation brings all joints within this distance of where they were, at a
  /// height of 1.75 m, in metres; 0: a key at each time.
  double key_tolerance = 1e-4;

  /// Rotations from joint to joint, hips scaled, and no more.
  static RetargetOptions plain() {
    RetargetOptions options;
    options.foot_lock = options.touch = options.twist = false;
    options.clearance = options.key_tolerance = 0;
    return options;
  }
};

}  // namespace npt::inline NPT_ABI
