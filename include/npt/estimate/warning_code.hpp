/// What a user should know of a mesh or of a result, as codes that programs put into words.
#pragma once

#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

enum class WarningCode {
  not_recognised,       ///< not recognised in any domain of the weights
  low_confidence,       ///< recognised, but with a confidence below BodyOptions::high_confidence
  no_surface,           ///< no triangle has an area, so no body could be estimated: left to the network
  upside_down,          ///< the body stands on its head
  lying,                ///< the body lies or is bent over
  lying_or_z_up,        ///< the body lies, or the mesh's vertical axis is z
  arms_uncertain,       ///< an arm is that far from the surface that it may be in the wrong place
  legs_uncertain,       ///< the same of a leg
  unusual_proportions,  ///< no person has these proportions
  faces_inward,         ///< the mesh's faces are turned inwards
  unit_assumed,         ///< a unit other than metres was inferred from the mesh's size
  part_of_mesh          ///< the body is some pieces of the mesh; the others stay where they are
};

/// From `least_confidence` on an estimate is used; from `high_confidence` on nothing needs to be said of it.
inline constexpr double least_confidence = 0.6, high_confidence = 0.85;

}  // namespace npt::inline NPT_ABI
