/// The engine on the executors that need no oneTBB, from one caller and from several. Run under ThreadSanitizer too.
#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/host_executor.hpp>
#include <npt/base/random.hpp>
#include <npt/base/thread_executor.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <thread>
#include <type_traits>
#include <vector>

namespace {

using Net = npt::PoseTransferNet<16>;
constexpr std::size_t vertices = 700;

std::vector<float> points(std::uint64_t seed) {
  npt::Random random(seed, 1);
  std::vector<float> values(3 * vertices);
  for (float& x : values) x = static_cast<float>(random.uniform(-1, 1));
  return values;
}

npt::Model<Net> model() {
  npt::Model<Net> m;
  npt::randomise(m, 5);
  return m;
}

template <class Engine>
std::vector<float> apply(const Engine& engine, std::uint64_t seed) {
  const std::vector<float> pose = points(seed), identity = points(seed + 100);
  std::vector<float> result(identity.size());
  engine({pose, identity}, result);
  return result;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

constexpr auto thread_each = [](int count, auto task) {
  std::vector<std::thread> threads;
  for (int i = 0; i < count; ++i) threads.emplace_back([task, i] { task(i); });
  for (std::thread& thread : threads) thread.join();
};

/// Several host threads call one engine at a time.
template <class Engine>
void check_shared(const Engine& engine) {
  const npt::Engine serial(model(), npt::SerialExecutor{});
  std::vector<std::vector<float>> results(4);
  std::vector<std::thread> callers;
  for (std::size_t i = 0; i < results.size(); ++i)
    callers.emplace_back([&, i] {
      for (int repeat = 0; repeat < 3; ++repeat) results[i] = apply(engine, i);
    });
  for (std::thread& caller : callers) caller.join();
  for (std::size_t i = 0; i < results.size(); ++i) CHECK(same_bits(results[i], apply(serial, i)));
}

}  // namespace

TEST_CASE("without oneTBB engines are serial unless given an executor, and refuse more threads") {
  static_assert(std::is_same_v<decltype(npt::Engine(model()))::Network, Net>);
  static_assert(std::is_same_v<npt::DefaultExecutor, npt::SerialExecutor>);
  CHECK(same_bits(apply(npt::Engine(model()), 1), apply(npt::Engine(model(), 1), 1)));
  CHECK_THROWS_AS(npt::Engine(model(), 2), npt::Error);
}

TEST_CASE("threads and a host's loop give the bits of the serial executor") {
  const auto serial = apply(npt::Engine(model(), npt::SerialExecutor{}), 1);
  CHECK(same_bits(serial, apply(npt::Engine(model(), npt::ThreadExecutor(2)), 1)));
  CHECK(same_bits(serial, apply(npt::Engine(model(), npt::ThreadExecutor(5)), 1)));
  CHECK(same_bits(serial, apply(npt::Engine(model(), npt::HostExecutor(3, thread_each)), 1)));
}

TEST_CASE("host threads share an engine on threads") { check_shared(npt::Engine(model(), npt::ThreadExecutor(3))); }
TEST_CASE("host threads share an engine on a host's loop") {
  check_shared(npt::Engine(model(), npt::HostExecutor(2, thread_each)));
}
TEST_CASE("host threads share a serial engine") { check_shared(npt::Engine(model())); }
