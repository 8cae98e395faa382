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
