/// npt::canonical_coordinates as `npt train` uses it: a build with liblbfgs has it (body_method_eigen.cpp); in any other,
/// asking for it is an error that says so (body_method_missing.cpp).
#pragma once

#include <npt/body/body_model.hpp>

#include <vector>

namespace refining {

/// npt::canonical_coordinates: [V, 3], where each vertex of a body belongs on the resting mannequin.
/// Errors    npt::Error where this build can't fit bodies
std::vector<float> canonical_coordinates(const npt::BodyModel& body);

}  // namespace refining
