/// The refinement of transferred meshes as `npt transfer` and `npt evaluate` use it. A build with Eigen has it
/// (refinement_eigen.cpp); in any other, asking for it is an error that says so (refinement_missing.cpp).
#pragma once

#include <npt/transfer/refinement.hpp>

namespace refining {

/// Errors    npt::Error where this build can't refine
npt::MakeRefinement refinement();

}  // namespace refining
