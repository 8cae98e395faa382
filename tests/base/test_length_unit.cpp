#include <npt/base/length_unit.hpp>

#include <doctest/doctest.h>

TEST_CASE("units have names, others are said in metres") {
  CHECK(npt::unit_name(1) == "metres");
  CHECK(npt::unit_name(0.0254) == "inches");
  CHECK(npt::unit_name(0.5) == "units of 0.500000 metres");
}

TEST_CASE("metric units come first, the longest foremost") {
  for (std::size_t i = 1; i < npt::metric_unit_count; ++i)
    CHECK(npt::length_units[i].metres < npt::length_units[i - 1].metres);
  CHECK(npt::length_units[npt::metric_unit_count - 1].metres == 0.001);
}
