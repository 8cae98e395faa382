#include <refining/refinement.hpp>

#include <npt/transfer/detail_refiner.hpp>

namespace refining {

npt::MakeRefinement refinement() { return npt::detail_refinement; }

}  // namespace refining
