#include <refining/body_method.hpp>

#include <npt/base/error.hpp>

namespace refining {

std::vector<float> canonical_coordinates(const npt::BodyModel&) {
  throw npt::Error({.file = "--net correspondence",
                    .found = "a program built without Eigen or without liblbfgs",
                    .expected = "one configured where both are (Debian packages libeigen3-dev, liblbfgs-dev)"});
}

}  // namespace refining
