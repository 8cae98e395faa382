/// Confidence of an estimated body, from 0 to 1: that a mesh is a person, and that its pose was estimated rightly.
#pragma once

#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// From `least_confidence` on an estimate is used; from `high_confidence` on nothing needs to be said of it. Of the
/// meshes that were tried, people and stylised figures that came out right had 0.85 and more, animals and things less
/// than 0.45.
inline constexpr double least_confidence = 0.6, high_confidence = 0.85;

}  // namespace npt::inline NPT_ABI
