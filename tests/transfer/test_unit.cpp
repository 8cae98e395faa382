#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/transfer/unit.hpp>

#include <limits>
#include <vector>

TEST_CASE("an extent is the longest side of the bounding box, without what is NaN") {
  const std::vector<float> xyz{0, 0, 0, 1, -3, 2, std::numeric_limits<float>::quiet_NaN(), 1, 1};
  CHECK(npt::extent_of(xyz) == 4);
}

TEST_CASE("the unit of a person is told from its extent") {
  const auto unit = [](float extent) {
    const std::vector<float> xyz{0, 0, 0, 0, extent, 0};
    return npt::unit_of({xyz, {}, "person.obj"});
  };
  CHECK(unit(1.7F) == 1);
  CHECK(unit(0.5F) == 1);
  CHECK(unit(172) == 0.01);
  CHECK(unit(1720) == 0.001);
  for (const float extent : {0.001F, 0.3F, 20.0F, 5000.0F}) CHECK_THROWS_AS(unit(extent), npt::Error);
  CHECK_THROWS_WITH_AS(
      unit(20),
      "person.obj: found a mesh 20 units across, expected a person, 0.4 to 4 metres across, in metres, "
      "centimetres or millimetres",
      npt::Error);
}
