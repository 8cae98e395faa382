#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/nn/engine/core_class.hpp>
#include <npt/nn/engine/encoded_input.hpp>
#include <npt/nn/engine/engine_class.hpp>
#include <npt/nn/engine/model_class.hpp>
#include <npt/nn/engine/precision.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>
#include <vector>

#include "support/allocations.hpp"
#include "support/needs.hpp"
#include "support/nets.hpp"

namespace {

using support::random_points;

template <class Net>
npt::Model<Net> random_model(std::uint64_t seed = 11) {
  npt::Model<Net> model;
  npt::randomise(model, seed);
  return model;
}

template <class Engine>
std::vector<float> apply(const Engine& engine, const std::vector<float>& pose, const std::vector<float>& identity) {
  std::vector<float> result(identity.size());
  engine({pose, identity}, result);
  return result;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

template <class Net>
void check_thread_counts() {
  const auto model = random_model<Net>();
  const auto pose = random_points<float>(1000, 1);
  const auto identity = random_points<float>(1000, 2);
  const auto one = apply(npt::Engine(model, 1), pose, identity);
  CHECK(same_bits(one, apply(npt::Engine(model, 2), pose, identity)));
  CHECK(same_bits(one, apply(npt::Engine(model, 7), pose, identity)));
  CHECK(same_bits(one, apply(npt::Engine(model, npt::SerialExecutor{}), pose, identity)));
#if NPT_HAS_TBB
  tbb::task_arena arena(3);
  CHECK(same_bits(one, apply(npt::Engine(model, npt::TbbExecutor(arena)), pose, identity)));
#endif
}

}  // namespace

TEST_CASE("the result has the same bits for any number of threads and any executor") {
  check_thread_counts<npt::PoseTransferNet<61>>();
  check_thread_counts<npt::PoseTransferNet<61, npt::ReluConv>>();
  check_thread_counts<npt::PoseTransferNet<61, npt::ConvRelu, npt::Pooled>>();
}

TEST_CASE("an engine doesn't need its model any more") {
  auto model = random_model<npt::PoseTransferNet<16>>();
  const npt::Engine engine(model, 1);
  const auto pose = random_points<float>(40, 1), identity = random_points<float>(40, 2);
  const auto before = apply(engine, pose, identity);
  std::fill(model.buffer().begin(), model.buffer().end(), 0.0F);
  CHECK(same_bits(before, apply(engine, pose, identity)));
}

TEST_CASE("host threads share a const engine") {
  const npt::Engine engine(random_model<npt::PoseTransferNet<16>>(), 2);
  std::vector<std::vector<float>> expected, found(8);
  for (std::size_t i = 0; i < 8; ++i)
    expected.push_back(apply(engine, random_points<float>(100 + 50 * i, i), random_points<float>(100 + 50 * i, i + 1)));
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 8; ++i)
    threads.emplace_back([&, i] {
      for (int repeat = 0; repeat < 5; ++repeat)
        found[i] = apply(engine, random_points<float>(100 + 50 * i, i), random_points<float>(100 + 50 * i, i + 1));
    });
  for (std::thread& t : threads) t.join();
  for (std::size_t i = 0; i < 8; ++i) CHECK(same_bits(expected[i], found[i]));
}

#if NPT_HAS_TBB
TEST_CASE("an engine can be called from inside the host's own parallel loop on the same arena") {
  tbb::task_arena arena(2);
  const npt::Engine engine(random_model<npt::PoseTransferNet<16>>(), npt::TbbExecutor(arena));
  const auto pose = random_points<float>(300, 1), identity = random_points<float>(300, 2);
  const auto expected = apply(engine, pose, identity);
  std::vector<std::vector<float>> found(12);
  arena.execute([&] {
    tbb::parallel_for(0, 12, [&](int i) { found[static_cast<std::size_t>(i)] = apply(engine, pose, identity); });
  });
  for (const auto& result : found) CHECK(same_bits(expected, result));
}
#endif

template <class Net>
void check_sharing() {
  const npt::Engine engine(random_model<Net>(), 2);
  // Three poses and four identities of different sizes (equal where the network calls vertices).
  std::vector<std::vector<float>> poses, identities;
  for (std::size_t i = 0; i < 3; ++i)
    poses.push_back(random_points<float>(engine.pairs_vertices() ? 150 : 90 + 31 * i, i));
  for (std::size_t i = 0; i < 4; ++i)
    identities.push_back(random_points<float>(engine.pairs_vertices() ? 150 : 40 + 77 * i, 50 + i));
  std::vector<npt::NetworkCall<float>> calls;
  std::vector<std::vector<float>> results, expected;
  results.reserve(12);
  for (const auto& pose : poses)
    for (const auto& identity : identities) {
      expected.push_back(apply(engine, pose, identity));
      results.emplace_back(identity.size());
      calls.push_back({{pose, identity}, results.back()});
    }
  engine.run(calls);
  for (std::size_t i = 0; i < 12; ++i) CHECK(same_bits(expected[i], results[i]));

  for (std::size_t p = 0; p < poses.size(); ++p) {
    const npt::EncodedInput<float> code = engine.encode(poses[p]);
    CHECK(code.vertices() == static_cast<int>(poses[p].size() / 3));
    for (std::size_t i = 0; i < identities.size(); ++i) {
      std::vector<float> result(identities[i].size());
      engine.decode(code, {identities[i]}, result);
      CHECK(same_bits(expected[4 * p + i], result));
      engine.decode(code, {identities[i]}, result);  // the code is not consumed
      CHECK(same_bits(expected[4 * p + i], result));
    }
  }
}

TEST_CASE("a batch, and encode with decode, give what single calls give") {
  check_sharing<npt::PoseTransferNet<29>>();
  check_sharing<npt::PoseTransferNet<29, npt::ReluConv>>();
  check_sharing<npt::PoseTransferNet<29, npt::ConvRelu, npt::Pooled>>();
  check_sharing<npt::PoseTransferNet<29, npt::ReluConv, npt::Pooled>>();
}

TEST_CASE("a large batch is carried in chunks") {
  const npt::Engine engine(random_model<npt::PoseTransferNet<4>>(), 2);
  std::vector<std::vector<float>> points, results;
  for (std::size_t i = 0; i < 10; ++i) points.push_back(random_points<float>(4000, i));
  results.assign(10, std::vector<float>(12000));
  std::vector<npt::NetworkCall<float>> calls;
  for (std::size_t i = 0; i < 10; ++i) calls.push_back({{points[i], points[(i + 1) % 10]}, results[i]});
  engine.run(calls);
  for (std::size_t i = 0; i < 10; ++i) CHECK(same_bits(apply(engine, points[i], points[(i + 1) % 10]), results[i]));
}

TEST_CASE("a warm call allocates nothing" *
          support::Needs(support::counts_malloc, "malloc for itself, which sanitizers take")) {
  const npt::Engine engine(random_model<npt::PoseTransferNet<61>>(), 2);
  const auto pose = random_points<float>(700, 1), identity = random_points<float>(700, 2);
  std::vector<float> result(identity.size());
  npt::Workspace<float> workspace;
  npt::EncodedInput<float> code;
  const auto all = [&] {
    engine({pose, identity}, result);
    engine(workspace, {pose, identity}, result);
    engine.encode(pose, code);
    engine.decode(code, {identity}, result);
  };
  // oneTBB makes worker threads and their task pools lazily, so that a first parallel call may not have met them all.
  for (int i = 0; i < 20; ++i) all();
  const npt::Engine serial(random_model<npt::PoseTransferNet<61>>(), npt::SerialExecutor{});
  serial({pose, identity}, result);
  long before = support::allocations.load();
  serial({pose, identity}, result);  // the second call
  CHECK(support::allocations.load() == before);
  before = support::allocations.load();
  for (int i = 0; i < 5; ++i) all();
  CHECK(support::allocations.load() == before);
}

TEST_CASE("a call holds two feature maps of the paper's network, not three") {
  using Net = npt::PoseTransferNet<128>;
  const npt::Engine<Net> engine(random_model<Net>(), 1, npt::Precision::native);
  const auto pose = random_points<float>(960, 1), identity = random_points<float>(960, 2);
  std::vector<float> result(identity.size());
  npt::Workspace<float> workspace;
  engine(workspace, {pose, identity}, result);
  constexpr std::size_t map = 131 * 960 * sizeof(float);  // bottleneck and coordinates, ten whole groups of vertices
  CHECK(workspace.bytes() > 2 * map);
  CHECK(workspace.bytes() < 5 * map / 2);
}

TEST_CASE("NaN in gives NaN out, never a wrong mesh") {
  const auto nan = std::numeric_limits<float>::quiet_NaN();
  const auto check = [&](const auto& engine) {
    auto pose = random_points<float>(120, 1), identity = random_points<float>(120, 2);
    pose[33] = nan;
    for (const float x : apply(engine, pose, identity)) REQUIRE(std::isnan(x));
    pose[33] = 0;
    identity[119] = nan;
    for (const float x : apply(engine, pose, identity)) REQUIRE(std::isnan(x));
  };
  check(npt::Engine(random_model<npt::PoseTransferNet<16>>(), 1));
  check(npt::Engine(random_model<npt::PoseTransferNet<16, npt::ReluConv>>(), 1));
  check(npt::Engine(random_model<npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>>(), 1));
}

TEST_CASE("all vertices in one point give finite numbers") {
  const npt::Engine engine(random_model<npt::PoseTransferNet<16>>(), 1);
  const std::vector<float> point(300, 0.25F);
  for (const float x : apply(engine, point, point)) REQUIRE(std::isfinite(x));
}

TEST_CASE("permuting both meshes alike permutes the result") {
  const npt::Engine engine(random_model<npt::PoseTransferNet<16>>(), 1);
  const auto pose = random_points<float>(200, 1), identity = random_points<float>(200, 2);
  const auto expected = apply(engine, pose, identity);
  npt::Random random(9);
  const auto order = npt::random_permutation(200, random);
  auto permuted_pose = pose, permuted_identity = identity;
  for (std::size_t v = 0; v < 200; ++v)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      permuted_pose[3 * v + axis] = pose[3 * order[v] + axis];
      permuted_identity[3 * v + axis] = identity[3 * order[v] + axis];
    }
  const auto found = apply(engine, permuted_pose, permuted_identity);
  for (std::size_t v = 0; v < 200; ++v)
    for (std::size_t axis = 0; axis < 3; ++axis)
      REQUIRE(std::abs(found[3 * v + axis] - expected[3 * order[v] + axis]) < 1e-5F);
}

TEST_CASE("wrong sizes are errors that say which argument, found and expected") {
  const npt::Engine engine(random_model<npt::PoseTransferNet<16>>(), 1);
  const auto message = [&](std::size_t pose, std::size_t identity, std::size_t result) -> std::string {
    std::vector<float> a(pose), b(identity), c(result);
    try {
      engine({a, b}, c);
    } catch (const npt::Error& e) {
      return e.what();
    }
    return "no error";
  };
  CHECK(message(0, 9, 9) == "pose: found no vertices, expected at least one");
  CHECK(message(9, 0, 0) == "identity: found no vertices, expected at least one");
  CHECK(message(10, 9, 9) == "pose: found 10 numbers, expected 3 for each vertex");
  CHECK(message(9, 9, 6) == "result: found 6 numbers, expected 9, three for each vertex of identity");
  CHECK(message(12, 9, 9).find("pose: found 4 vertices, expected 3, as many as identity has") == 0);
  const npt::Engine pooled(random_model<npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>>(), 1);
  std::vector<float> a(12), b(9), c(9);
  CHECK_NOTHROW(pooled({a, b}, c));
  CHECK_THROWS_AS(engine.decode(npt::EncodedInput<float>{}, {b}, c), npt::Error);
}

TEST_CASE("an engine refuses the code of another") {
  using Net = npt::PoseTransferNet<16>;
  const auto pose = random_points<float>(100, 1), identity = random_points<float>(100, 2);
  std::vector<float> result(identity.size());
  npt::Engine engine(random_model<Net>(), 1);
  npt::EncodedInput<float> code = engine.encode(pose);
  const auto refuses = [&](const auto& other) {
    CHECK_THROWS_WITH_AS(other.decode(code, {identity}, result),
                         "pose: found a code that another engine made, expected one made by this engine", npt::Error);
  };
  refuses(npt::Engine(random_model<Net>(), 1));  // the same weights, and memory of the same shape, but who could tell
  refuses(npt::Engine(random_model<Net>(12), 1));
  refuses(npt::Engine(random_model<npt::PoseTransferNet<64>>(), 1));
  refuses(npt::Engine(random_model<npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>>(), 1));
  if (npt::Engine<Net>::supports(npt::Precision::bf16))
    refuses(npt::Engine(random_model<Net>(), 1, npt::Precision::bf16));
  const auto expected = apply(engine, pose, identity);
  const auto same = [&](const auto& e) {
    e.decode(code, {identity}, result);
    return same_bits(expected, result);
  };
  CHECK(same(engine));
  const npt::Engine moved = std::move(engine);
  CHECK(same(moved));
  const npt::Engine other(random_model<Net>(), 1);
  other.encode(pose, code);  // now it is that one's
  CHECK(same(other));
  CHECK_THROWS_AS(moved.decode(code, {identity}, result), npt::Error);
}
