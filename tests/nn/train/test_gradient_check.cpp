// Gradients against finite differences: each layer, compositions that the pose transfer network doesn't contain, the
// whole network.
#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/layer/max_pool.hpp>
#include <npt/nn/layer/res_block.hpp>
#include <npt/nn/layer/tanh.hpp>
#include <npt/nn/train/gradient_check.hpp>

#include <array>

namespace {

void expect_right(const npt::GradientReport& report) {
  CAPTURE(report.where);
  CHECK(report.entries > 0);
  CHECK(report.worst < 5e-6);  // of differences, which round as the compiler contracts sums
}

/// y = max(x, 0) + slope min(x, 0) with a slope for each channel, or one for all.
template <int Slopes, bool Wrong = false>
struct PRelu : npt::kernel::Pointwise {
  static constexpr const char* name = "prelu";
  static constexpr bool increasing = true;  // as long as no slope is negative
  static constexpr std::array<bool, 4> per_channel{Slopes != 1};
  npt::Parameter slope{Slopes};
  static constexpr void visit(auto& self, auto&& visitor) { visitor("slope", self.slope); }
  template <class T>
  static npt::simd::Batch<T> row(const npt::kernel::PointwiseArgs<T>& args, int c) {
    return npt::simd::broadcast(args.parameters[0][Slopes == 1 ? 0 : c]);
  }
  template <class T>
  static npt::simd::Batch<T> apply(npt::simd::Batch<T> x, const npt::simd::Batch<T>& slope, Nothing) {
    const npt::simd::Batch<T> positive = npt::simd::relu(x);
    return npt::simd::fma(slope, x - positive, positive);
  }
  static constexpr int sums_per_channel = 1;
  template <class T>
  static npt::simd::Batch<T> vjp(const npt::simd::Batch<T>& x, const npt::simd::Batch<T>& dy,
                                 const npt::simd::Batch<T>& slope, Nothing, npt::simd::Batch<T>* sums) {
    const npt::simd::Batch<T> above = npt::simd::zero_where_not_positive(x, dy);
    const npt::simd::Batch<T> below = dy - above;
    sums[0] = npt::simd::fma(below, Wrong ? x + npt::simd::broadcast(T(0.01)) : x, sums[0]);
    return npt::simd::fma(slope, below, above);
  }
};

/// Two convolutions of the identity and one behind them, for compositions in between.
template <class Compose>
struct Composed {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 6> a, b;
  npt::SPAdaIN<6> s;
  npt::Conv1x1<6, 6> c;
  npt::Conv1x1<6, 3> d;
  PRelu<6> p;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("s", self.s);
    visitor("c", self.c);
    visitor("d", self.d);
    visitor("p", self.p);
  }
  constexpr auto operator()(auto pose, auto identity) const { return Compose::compose(*this, pose, identity); }
};

struct NormOfSum {  // has to be stored first
  static constexpr auto compose(const auto& n, auto pose, auto identity) {
    return ((pose | n.a) + (identity | n.b)) | npt::instance_norm | npt::relu | n.d;
  }
};
struct Skip {  // identity shortcuts: a tensor with and without a norm
  static constexpr auto compose(const auto& n, auto pose, auto identity) {
    const auto h = (pose | n.a) + (identity | n.b);
    const auto g = h + (n.s(h, identity) | npt::relu | n.c);
    return ((g | npt::instance_norm | npt::tanh) + g) | n.d;
  }
};
struct NormTwice {
  static constexpr auto compose(const auto& n, auto pose, auto identity) {
    return ((n.s(pose | n.a | npt::instance_norm | npt::tanh, identity) | npt::relu) + (identity | n.b)) | n.d;
  }
};
struct LayersInFrontOfNorm {
  static constexpr auto compose(const auto& n, auto pose, auto identity) {
    const auto x = pose | n.a | n.p | npt::instance_norm | npt::tanh;
    return (x + (identity | n.b)) | n.d;
  }
};
struct OneLayerTwice {  // weights that two places share
  static constexpr auto compose(const auto& n, auto pose, auto identity) {
    const auto x = n.s(pose | n.a, identity) | n.c | npt::relu;
    return ((n.s(x, identity) | n.c) + (identity | n.b | n.c)) | n.d;
  }
};
struct ConditionedOnHidden {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 5> a, b;
  npt::SPAdaIN<5, 5> s;
  npt::Conv1x1<5, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("s", self.s);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    return s(pose | a, identity | b | npt::tanh) | npt::relu | d;
  }
};
struct ConditionedInFrontOfNorm {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 5> a, b;
  npt::SPAdaIN<5, 5, npt::Norm::none> s;
  npt::SPAdaIN<5> t;
  npt::Conv1x1<5, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("s", self.s);
    visitor("t", self.t);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    return t(s(pose | a, identity | b | npt::tanh), identity) | npt::relu | d;
  }
};
template <class Compose>
struct PooledNet {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 7> a;
  npt::Conv1x1<10, 8> c;
  npt::Conv1x1<8, 3> d;
  PRelu<1> p;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("c", self.c);
    visitor("d", self.d);
    visitor("p", self.p);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    return cat(Compose::pool(*this, pose), identity) | c | npt::relu | d;
  }
};
struct PlainPool {
  static constexpr auto pool(const auto& n, auto pose) { return pose | n.a | npt::max_pool; }
};
struct NormPool {
  static constexpr auto pool(const auto& n, auto pose) {
    return pose | n.a | npt::instance_norm | npt::relu | npt::max_pool;
  }
};
struct LayersBehindPool {
  static constexpr auto pool(const auto& n, auto pose) {
    return pose | n.a | npt::instance_norm | npt::max_pool | n.p | npt::tanh;
  }
};
struct ParameterPool {
  static constexpr auto pool(const auto& n, auto pose) { return pose | n.a | npt::instance_norm | n.p | npt::max_pool; }
};

/// A layer over maxima and per-vertex channels together, beside the plain maxima.
struct LayerBehindCat {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 7> a;
  PRelu<10> p;
  npt::Conv1x1<10, 8> c;
  npt::Conv1x1<15, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("p", self.p);
    visitor("c", self.c);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto f = pose | a | npt::max_pool;
    return cat(cat(identity, f) | p | npt::tanh | c, f) | npt::tanh | d;
  }
};

}  // namespace

TEST_CASE("layers have right gradients") {
  expect_right(npt::check_layer<npt::InstanceNorm, 5>());
  expect_right(npt::check_layer<npt::Relu, 5>());
  expect_right(npt::check_layer<npt::Tanh, 5>());
  expect_right(npt::check_layer<npt::ScaledTanh, 5>());
  expect_right(npt::check_layer<npt::Conv1x1<5, 5>, 5>());
  expect_right(npt::check_layer<npt::SPAdaIN<5>, 5>());
  expect_right(npt::check_layer<npt::SPAdaIN<5, 3, npt::Norm::none>, 5>());
  expect_right(npt::check_layer<npt::ResBlock<5>, 5>());
  expect_right(npt::check_layer<npt::ResBlock<5, npt::ReluConv>, 5>());
  expect_right(npt::check_layer<PRelu<5>, 5>());
  expect_right(npt::check_layer<PRelu<1>, 5>());
}

TEST_CASE("a wrong gradient is found and named") {
  const auto report = npt::check_layer<PRelu<5, true>, 5>();
  CHECK(report.worst > 1e-4);
  CHECK(report.where.starts_with("layer.slope["));
}

TEST_CASE("compositions have right gradients") {
  expect_right(npt::check_gradients<Composed<NormOfSum>>());
  expect_right(npt::check_gradients<Composed<Skip>>());
  expect_right(npt::check_gradients<Composed<NormTwice>>());
  expect_right(npt::check_gradients<Composed<LayersInFrontOfNorm>>());
  expect_right(npt::check_gradients<Composed<OneLayerTwice>>());
  expect_right(npt::check_gradients<ConditionedOnHidden>());
  expect_right(npt::check_gradients<ConditionedInFrontOfNorm>());
  expect_right(npt::check_gradients<PooledNet<PlainPool>>());
  expect_right(npt::check_gradients<PooledNet<NormPool>>());
  expect_right(npt::check_gradients<PooledNet<ParameterPool>>());
  expect_right(npt::check_gradients<PooledNet<LayersBehindPool>>());
  expect_right(npt::check_gradients<LayerBehindCat>());
}

TEST_CASE("gradients are right for any vertex count") {
  for (const int vertices : {3, 31, 32, 33, 95, 96, 97, 200}) {
    CAPTURE(vertices);
    expect_right(npt::check_gradients<Composed<NormOfSum>>({.vertices = vertices}));
    expect_right(npt::check_gradients<PooledNet<NormPool>>({.vertices = vertices}));
  }
}

namespace {

/// Three inputs of several channels: one read through a maximum, one that a layer is conditioned on, one both ways.
struct ThreeInputs {
  static constexpr npt::Input inputs[] = {{"points", 3}, {"cloud", 4}, {"condition", 2}};
  npt::Conv1x1<4, 9> encode;
  npt::Conv1x1<14, 6> join;
  npt::SPAdaIN<6, 2, npt::Norm::none> modulate;
  npt::Conv1x1<6, 3> out;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("encode", self.encode);
    visitor("join", self.join);
    visitor("modulate", self.modulate);
    visitor("out", self.out);
  }
  constexpr auto operator()(auto points, auto cloud, auto condition) const {
    const auto x = cat(cat(points, condition), cloud | encode | npt::instance_norm | npt::max_pool) | join;
    return modulate(x, condition) | out;
  }
};

/// One input, of five channels.
struct OneInput {
  static constexpr npt::Input inputs[] = {{"features", 5}};
  npt::Conv1x1<5, 4> in;
  npt::Conv1x1<4, 3> out;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("in", self.in);
    visitor("out", self.out);
  }
  constexpr auto operator()(auto features) const { return features | in | npt::instance_norm | npt::tanh | out; }
};

}  // namespace

TEST_CASE("networks of one and of three inputs have right gradients, the inputs' too") {
  expect_right(npt::check_gradients<OneInput>());
  expect_right(npt::check_gradients<ThreeInputs>({.vertices = 130}));
}

TEST_CASE("the pose transfer network has right gradients") {
  const npt::GradientCheckOptions few{.most_entries = 40};
  expect_right(npt::check_gradients<npt::PoseTransferNet<5>>(few));
  expect_right(npt::check_gradients<npt::PoseTransferNet<5, npt::ReluConv>>(few));
  expect_right(npt::check_gradients<npt::PoseTransferNet<5, npt::ConvRelu, npt::Pooled>>(few));
  expect_right(npt::check_gradients<npt::PoseTransferNet<5, npt::ReluConv, npt::Pooled>>(few));
}
