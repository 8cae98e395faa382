/// One network for several instruction sets in one program: each that this machine has computes the same, and the
/// plain call takes the best.
#include <doctest/doctest.h>

#include <retarget.hpp>

#include <cmath>
#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

extern "C" {
Retarget* make_retarget__sse2(std::uint64_t seed);
Retarget* make_retarget__avx2(std::uint64_t seed);
Retarget* make_retarget__avx512(std::uint64_t seed);
Retarget* make_retarget__avx512bf16(std::uint64_t seed);
}

namespace {

constexpr std::size_t vertices = 700;

std::vector<float> wave(float phase) {
  std::vector<float> values(3 * vertices);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::sin(static_cast<float>(i) + phase);
  return values;
}

struct Variant {
  const char* name;
  Retarget* (*make)(std::uint64_t);
};

/// Those that this machine can run, the best last.
std::vector<Variant> variants() {
  std::vector<Variant> list{{"sse2", make_retarget__sse2}};
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512vl");
  if (avx2) list.push_back({"avx2+fma", make_retarget__avx2});
  if (avx512) list.push_back({"avx512", make_retarget__avx512});
  if (avx512 && __builtin_cpu_supports("avx512bf16")) list.push_back({"avx512+bf16", make_retarget__avx512bf16});
  return list;
}

std::vector<float> run(Retarget* (*make)(std::uint64_t)) {
  const std::unique_ptr<Retarget> retarget(make(3));
  const std::vector<float> pose = wave(0), identity = wave(1);
  std::vector<float> result(identity.size());
  (*retarget)(pose.data(), identity.data(), result.data(), vertices);
  return result;
}

}  // namespace

TEST_CASE("each unit is compiled for its instruction set, and the plain call takes the best") {
  for (const Variant& variant : variants())
    CHECK(std::unique_ptr<Retarget>(variant.make(1))->instruction_set() == std::string_view(variant.name));
  CHECK(std::unique_ptr<Retarget>(make_retarget(1))->instruction_set() == std::string_view(variants().back().name));
}

TEST_CASE("all instruction sets agree to the engine's accuracy") {
  const std::vector<float> expected = run(make_retarget__sse2);
  for (const Variant& variant : variants()) {
    const std::vector<float> result = run(variant.make);
    double difference = 0, norm = 0;
    for (std::size_t i = 0; i < result.size(); ++i) {
      difference += std::pow(static_cast<double>(result[i]) - static_cast<double>(expected[i]), 2);
      norm += std::pow(static_cast<double>(expected[i]), 2);
    }
    CHECK_MESSAGE(std::sqrt(difference / norm) < 2e-5, variant.name);
  }
}

TEST_CASE("an exception passes from a unit into the program") {
  for (const Variant& variant : variants()) {
    const std::unique_ptr<Retarget> retarget(variant.make(1));
    std::string message;
    try {
      (*retarget)(nullptr, nullptr, nullptr, 0);
    } catch (const std::exception& error) {
      message = error.what();
    }
    CHECK_MESSAGE(message == "pose: found no vertices, expected at least one", variant.name);
  }
}
