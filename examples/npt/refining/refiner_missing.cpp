#include <refining/refiner.hpp>

#include <npt/core/error.hpp>

namespace refining {

double default_radius() { return 0; }

std::unique_ptr<const Refiner> make_refiner(std::span<const float>, std::span<const npt::Triangle>, double,
                                            const std::string&) {
  expect_available();
  return nullptr;
}

void expect_available() {
  throw npt::Error({.file = "--refine",
                    .found = "a program built without Eigen or without liblbfgs",
                    .expected = "one configured where both are (Debian packages libeigen3-dev, liblbfgs-dev)"});
}

}  // namespace refining
