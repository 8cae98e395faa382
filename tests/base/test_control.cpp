#include <doctest/doctest.h>

#include <npt/base/control.hpp>
#include <npt/base/error.hpp>

#include <vector>

TEST_CASE("a step says how much is done, unless it is to stop") {
  std::vector<double> done;
  bool stop = false;
  const npt::Control control{.progress = [&done](double x) { done.push_back(x); }, .stop = [&stop] { return stop; }};
  control.step(0);
  control.step(0.5);
  CHECK(done == std::vector<double>{0, 0.5});
  stop = true;
  try {
    control.step(1);
    FAIL("went on");
  } catch (const npt::Error& error) {
    CHECK(error.code() == npt::ErrorCode::stopped);
    CHECK(error.remedy() == npt::Remedy::none);
  }
  CHECK(done.size() == 2);
  CHECK_NOTHROW(npt::Control().step(0.5));
}

TEST_CASE("a part of work says its share of the whole") {
  std::vector<double> done;
  bool stop = false;
  const npt::Control whole{.progress = [&done](double x) { done.push_back(x); }, .stop = [&stop] { return stop; }};
  const npt::Control second = whole.part(0.5, 1);
  second.part(0, 0.5).step(1);
  second.step(1);
  CHECK(done == std::vector<double>{0.75, 1});
  stop = true;
  CHECK_THROWS_AS(second.step(1), npt::Error);
  CHECK_FALSE(npt::Control().part(0, 1).progress);
}
