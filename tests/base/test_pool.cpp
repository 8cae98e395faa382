#include <doctest/doctest.h>

#include <npt/base/pool.hpp>

#include <set>
#include <thread>
#include <vector>

TEST_CASE("running calls have an object each, and later ones take them again") {
  const npt::Pool<int> pool;
  std::set<const int*> first;
  {
    const auto a = pool.lease(), b = pool.lease();
    first = {&*a, &*b};
    CHECK(first.size() == 2);
  }
  const auto c = pool.lease(), d = pool.lease();
  CHECK(std::set<const int*>{&*c, &*d} == first);
  const auto e = pool.lease();
  CHECK_FALSE(first.contains(&*e));
}

TEST_CASE("threads share a pool") {
  const npt::Pool<std::vector<int>> pool;
  std::vector<std::jthread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&pool, t] {
      for (int i = 0; i < 1000; ++i) {
        const auto lease = pool.lease();
        lease->assign(3, t);
        CHECK(lease->front() == t);
      }
    });
}
