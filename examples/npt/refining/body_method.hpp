/// The way through bodies as `npt transfer` and `npt evaluate` take it. A build with Eigen has it
/// (body_method_eigen.cpp); any other leaves all transfers to the network, and asking for it is an error
/// (body_method_missing.cpp).
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/transfer/body_interface.hpp>

#include <vector>

namespace refining {

/// nullptr where this build has none and `method` leaves the choice.
/// Errors    npt::Error where this build has none and `method` asks for it
npt::MakeBodyMethod body_method(npt::Method method);

/// npt::canonical_coordinates: [V, 3], where each vertex of a body belongs on the resting mannequin.
/// Errors    npt::Error where this build can't fit bodies
std::vector<float> canonical_coordinates(const npt::BodyModel& body);

}  // namespace refining
