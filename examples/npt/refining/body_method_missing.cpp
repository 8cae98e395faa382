#include <refining/body_method.hpp>

#include <npt/base/error.hpp>

namespace refining {

npt::MakeBodyMethod body_method(npt::Method method) {
  if (method == npt::Method::body)
    throw npt::Error({.file = "--method body",
                      .found = "a program built without Eigen or without liblbfgs",
                      .expected = "one configured where both are (Debian packages libeigen3-dev, liblbfgs-dev)"});
  return nullptr;
}

std::vector<float> canonical_coordinates(const npt::BodyModel&) {
  throw npt::Error({.file = "--net reader",
                    .found = "a program built without Eigen or without liblbfgs",
                    .expected = "one configured where both are (Debian packages libeigen3-dev, liblbfgs-dev)"});
}

}  // namespace refining
