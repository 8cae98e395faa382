// Networks whose types are composed from a seed, each as engine, as tape and in plain loops; more.sh compiles more. A
// scalar for each, since compiling them takes longest.
#include <doctest/doctest.h>

#include <npt/nn/layer/instance_norm.hpp>

#include "typed_network.hpp"

namespace {

/// A SPAdaIN in an epilogue, conditioned on a hidden tensor that nothing else needs: the stage's output must not take
/// its memory.
struct ConditionInEpilogue {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 16> a;
  npt::Conv1x1<3, 5> b;
  npt::SPAdaIN<16, 5, npt::Norm::none> s;
  npt::Conv1x1<16, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("s", self.s);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto, auto identity) const {
    const auto condition = identity | b | npt::tanh;
    return s(identity | a, condition) | d;
  }
};

/// A convolution that is recorded and not used.
struct UnusedConvolution {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 16> a;
  npt::Conv1x1<16, 7> b;
  npt::Conv1x1<16, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto h = (pose | a) + (identity | a | npt::relu);
    (void)(h | b);
    return h | npt::instance_norm | d;
  }
};

}  // namespace

TEST_CASE("a condition read by an epilogue keeps its memory") {
  random_networks::check(random_networks::network_of<ConditionInEpilogue, float, double>("ConditionInEpilogue\n"), 1);
}

TEST_CASE("what is recorded and not used changes nothing") {
  random_networks::check(random_networks::network_of<UnusedConvolution, float, double>("UnusedConvolution\n"), 1);
}

TEST_CASE("types composed from a seed, in fp32 and bfloat16") {
  random_networks::check_typed_networks<float, 1, 4, 7, 17, 19, 28>();
}

TEST_CASE("types composed from a seed, in double") {
  random_networks::check_typed_networks<double, 9, 10, 13, 22, 25, 31>();
}
