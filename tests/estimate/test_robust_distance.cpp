#include <doctest/doctest.h>

#include <npt/estimate/robust_distance.hpp>

TEST_CASE("near distances count as they are, far ones as the scale, one of the scale by half") {
  CHECK(npt::robust_squared(0, 0.1) == 0);
  CHECK(npt::robust_squared(1e-8, 0.1) == doctest::Approx(1e-8).epsilon(1e-5));
  CHECK(npt::robust_squared(0.01, 0.1) == doctest::Approx(0.005));
  CHECK(npt::robust_squared(1e6, 0.1) == doctest::Approx(0.01).epsilon(1e-6));
}
