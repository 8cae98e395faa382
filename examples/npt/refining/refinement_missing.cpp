#include <refining/refinement.hpp>

#include <npt/base/error.hpp>

namespace refining {

npt::MakeRefinement refinement() {
  throw npt::Error({.file = "--refine",
                    .found = "a program built without Eigen or without liblbfgs",
                    .expected = "one configured where both are (Debian packages libeigen3-dev, liblbfgs-dev)"});
}

}  // namespace refining
