#include <doctest/doctest.h>

#include <npt/npt.hpp>
#include <npt/transfer/late_domain.hpp>

#include <filesystem>
#include <memory>

namespace {

const std::filesystem::path human = std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/human.safetensors";

}  // namespace

TEST_CASE("a late domain is opened once, by the first that asks") {
  int opened = 0;
  const npt::LateDomain late([&opened] {
    ++opened;
    return npt::open_body_domain(npt::SafetensorsFile::read(human), {}, 1);
  });
  CHECK(opened == 0);
  CHECK(late.subject() == "a person");
  CHECK(late.subject() == "a person");
  CHECK(opened == 1);
}

TEST_CASE("what opening finds wrong is said by each that asks") {
  const npt::LateDomain late([]() -> std::shared_ptr<const npt::BodyDomain> {
    throw npt::Error({.file = "animals", .found = "a broken tensor", .expected = "a whole one"});
  });
  CHECK_THROWS_AS((void)late.subject(), npt::Error);
  CHECK_THROWS_AS((void)late.subject(), npt::Error);
}
