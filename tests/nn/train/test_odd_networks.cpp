// Networks that are composed in unusual ways: engine, tape and plain loops agree, and a second backward pass gives the
// bits of the first. Each was once wrong.
#include <doctest/doctest.h>

#include <npt/nn/train/gradient_check.hpp>
#include <npt/nn/train/gradients.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <span>
#include <vector>

#include "support/nets.hpp"
#include "support/plain_loops.hpp"

namespace {

using npt::Conv1x1;

/// A layer that is conditioned on a narrower tensor of the same task, in an epilogue.
struct ConditionedEpilogue {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  Conv1x1<3, 5> b;
  Conv1x1<3, 16> a;
  npt::SPAdaIN<16, 5, npt::Norm::none> s;
  Conv1x1<16, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("b", self.b);
    visitor("a", self.a);
    visitor("s", self.s);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto, auto identity) const {
    const auto condition = identity | b | npt::tanh;
    return s(identity | a, condition) | d;
  }
};

/// The condition is recorded behind the convolution that it modulates.
struct LateCondition : ConditionedEpilogue {
  constexpr auto operator()(auto, auto identity) const {
    const auto x = identity | a;
    return s(x, identity | b | npt::tanh) | d;
  }
};

/// A wider condition, and a sum behind the modulation.
struct ConditionedSum {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  Conv1x1<3, 16> b;
  Conv1x1<16, 16> a, c;
  npt::SPAdaIN<16, 16, npt::Norm::none> s;
  Conv1x1<16, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("b", self.b);
    visitor("a", self.a);
    visitor("c", self.c);
    visitor("s", self.s);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto x = pose | b | npt::instance_norm | npt::relu | c;
    const auto y = identity | b | npt::tanh;
    return (s(x | a, y) + (y | c | npt::relu)) | d;
  }
};

/// Convolutions and a pooled feature that nobody uses, between others.
struct Unused {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  Conv1x1<3, 8> a;
  Conv1x1<8, 8> b, c;
  Conv1x1<8, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("c", self.c);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto h = identity | a | npt::instance_norm | npt::relu;
    static_cast<void>(h | b);
    static_cast<void>(pose | a | npt::relu | npt::max_pool);
    const auto y = h | c | npt::relu;
    static_cast<void>(y | b | npt::instance_norm | c);
    return y | d;
  }
};

/// A convolution's output that is normalised by one reader and conditions a layer of another: its bias counts.
struct NormalisedCondition {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  Conv1x1<3, 4> b;
  Conv1x1<4, 16> a;
  npt::SPAdaIN<16, 4> s;
  Conv1x1<16, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("b", self.b);
    visitor("a", self.a);
    visitor("s", self.s);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto, auto identity) const {
    const auto h = identity | b;
    return s(h | npt::instance_norm | a, h) | d;
  }
};

/// Layers with learned parameters, and with a hidden condition, on inputs whose own gradients nobody asks for.
struct LearnedOnInputs {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::SPAdaIN<3, 3, npt::Norm::none> s;
  npt::SPAdaIN<3, 5, npt::Norm::none> t;
  Conv1x1<3, 5> b;
  Conv1x1<6, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("s", self.s);
    visitor("t", self.t);
    visitor("b", self.b);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    return cat(s(identity, pose), t(pose, identity | b)) | d;
  }
};

/// y = a_0 x + a_1 x^2 + ... with coefficients that all channels share.
template <int Count>
struct Polynomial : npt::kernel::Pointwise {
  static constexpr const char* name = "polynomial";
  static constexpr std::array<bool, 4> per_channel{false};
  npt::Parameter coefficients{Count};
  static constexpr void visit(auto& self, auto&& visitor) { visitor("coefficients", self.coefficients); }
  template <class T>
  struct Row {
    npt::simd::Batch<T> a[std::size_t{Count}];
  };
  template <class T>
  static Row<T> row(const npt::kernel::PointwiseArgs<T>& args, int) {
    Row<T> row;
    for (int k = 0; k < Count; ++k) row.a[k] = npt::simd::broadcast(args.parameters[0][k]);
    return row;
  }
  template <class T>
  static npt::simd::Batch<T> apply(npt::simd::Batch<T> x, const Row<T>& row, Nothing) {
    npt::simd::Batch<T> y = row.a[Count - 1] * x;
    for (int k = Count - 2; k >= 0; --k) y = (y + row.a[k]) * x;
    return y;
  }
  static constexpr int sums_per_channel = Count;
  template <class T>
  static npt::simd::Batch<T> vjp(const npt::simd::Batch<T>& x, const npt::simd::Batch<T>& dy, const Row<T>& row,
                                 Nothing, npt::simd::Batch<T>* sums) {
    npt::simd::Batch<T> power = dy, slope = npt::simd::broadcast(T(0));
    for (int k = 0; k < Count; ++k) {
      slope = npt::simd::fma(power * npt::simd::broadcast(T(k + 1)), row.a[k], slope);
      power = power * x;
      sums[k] += power;
    }
    return slope;
  }
};

/// Shared parameters, as many as there are channels, and a multiple: behind a concatenation, where a chain is applied
/// to some of the channels, and behind a convolution.
struct SharedParameters {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  Conv1x1<3, 5> b;
  Polynomial<8> p;
  Conv1x1<8, 4> c;
  Polynomial<4> q;
  Conv1x1<4, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("b", self.b);
    visitor("p", self.p);
    visitor("c", self.c);
    visitor("q", self.q);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const { return cat(identity, pose | b) | p | c | q | d; }
};

template <class Net>
double engine_error(std::size_t vertices, npt::Precision precision) {
  npt::Model<Net, double> model;
  npt::randomise(model, 5);
  npt::Model<Net> single;
  std::ranges::copy(model.buffer(), single.buffer().begin());
  const auto pose = support::random_points<float>(vertices, 1), identity = support::random_points<float>(vertices, 2);
  std::vector<float> result(identity.size());
  npt::Engine<Net>(single, 1, precision)({pose, identity}, result);
  return support::relative_error(result, plain::forward(model, support::to_map(pose), support::to_map(identity)));
}

/// Engine and tape against plain loops, in double; both backward passes and the gradients.
template <class Net>
void check() {
  npt::Model<Net, double> model;
  npt::randomise(model, 5);
  for (const std::size_t v : std::initializer_list<std::size_t>{1, 33, 96, 230}) {
    CAPTURE(v);
    const auto pose = support::random_points<double>(v, 1), identity = support::random_points<double>(v, 2);
    const auto expected = plain::forward(model, support::to_map(pose), support::to_map(identity));
    std::vector<double> result(identity.size());
    npt::Engine<Net, double>(model, 2)({pose, identity}, result);
    CHECK(support::relative_error(result, expected) < 1e-10);

    std::ranges::fill(result, 0);
    npt::Gradients<Net, double> gradients(2);
    gradients.load(model.buffer());
    const npt::NetworkCall<double> call{{pose, identity}, result};
    npt::Model<Net, double> first, second;
    const auto direction = support::random_points<double>(v, 3);
    const std::span<const double> from(direction);
    gradients.forward({&call, 1});
    CHECK(support::relative_error(result, expected) < 1e-10);
    gradients.backward({&from, 1}, first.buffer());
    gradients.forward({&call, 1});
    gradients.backward({&from, 1}, second.buffer());
    CHECK(std::ranges::equal(first.buffer(), second.buffer()));
    std::vector<double> to_pose(pose.size()), to_identity(identity.size());
    const std::span<double> pose_span(to_pose), identity_span(to_identity);
    gradients.backward({.result = {&from, 1},
                        .parameters = second.buffer(),
                        .inputs = {std::span(&pose_span, 1), std::span(&identity_span, 1)}});
    CHECK(std::ranges::equal(first.buffer(), second.buffer()));

    CHECK(engine_error<Net>(v, npt::Precision::native) < 1e-5);
    for (const npt::Precision precision : {npt::Precision::bf16, npt::Precision::bf16x3})
      if (npt::Engine<Net>::supports(precision))
        CHECK(engine_error<Net>(v, precision) < (precision == npt::Precision::bf16 ? 5e-2 : 1e-5));
  }
  const auto report = npt::check_gradients<Net>();
  CAPTURE(report.where);
  CHECK(report.worst < 1e-6);
}

}  // namespace

TEST_CASE("a stage's output never takes the memory that its epilogue is conditioned on") {
  check<ConditionedEpilogue>();
  check<LateCondition>();
  check<ConditionedSum>();
}

TEST_CASE("what doesn't reach the output changes nothing and costs nothing") {
  check<Unused>();
  constexpr const auto& program = npt::graph::program_of<Unused>;
  static_assert(program.stage_count == 3);
  static_assert(npt::tape::tape_of<Unused>.stage_count == 4);  // and one that gathers the result
  static_assert(program.multiply_adds == 24 + 64 + 24);
}

TEST_CASE("a bias is only left out where every reader normalises") { check<NormalisedCondition>(); }

TEST_CASE("parameters that all channels share are no channel's own, whatever their number") {
  // By hand: the plain loops know the library's layers only.
  npt::Model<SharedParameters, double> model;
  npt::randomise(model, 5);
  const SharedParameters& net = model.network();
  const auto values = [&model](const npt::Parameter& p) { return model.values(p); };
  const auto polynomial = [](std::span<const double> a, double x) {
    double y = 0;
    for (std::size_t k = a.size(); k-- > 0;) y = (y + a[k]) * x;
    return y;
  };
  const auto convolve = [&values](const auto& conv, const std::vector<double>& x) {
    std::vector<double> y(values(conv.bias).begin(), values(conv.bias).end());
    for (std::size_t r = 0; r < y.size(); ++r)
      for (std::size_t c = 0; c < x.size(); ++c) y[r] += values(conv.weight)[r * x.size() + c] * x[c];
    return y;
  };
  const std::size_t vertices = 33;
  const auto pose = support::random_points<double>(vertices, 1), identity = support::random_points<double>(vertices, 2);
  std::vector<double> result(identity.size()), expected;
  npt::Engine<SharedParameters, double>(model, 1)({pose, identity}, result);
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto point = [v](const std::vector<double>& xyz) {
      return std::vector<double>(xyz.begin() + static_cast<std::ptrdiff_t>(3 * v),
                                 xyz.begin() + static_cast<std::ptrdiff_t>(3 * v + 3));
    };
    std::vector<double> h = point(identity);
    const std::vector<double> b = convolve(net.b, point(pose));
    h.insert(h.end(), b.begin(), b.end());
    for (double& x : h) x = polynomial(values(net.p.coefficients), x);
    h = convolve(net.c, h);
    for (double& x : h) x = polynomial(values(net.q.coefficients), x);
    for (const double x : convolve(net.d, h)) expected.push_back(x);
  }
  CHECK(support::relative_error(result, support::to_map(expected)) < 1e-10);
  const auto report = npt::check_gradients<SharedParameters>();
  CAPTURE(report.where);
  CHECK(report.worst < 1e-6);
}

TEST_CASE("learned layers on inputs get their gradients whether or not the meshes do") { check<LearnedOnInputs>(); }

namespace {

/// A sum of two concatenations of the same tensors: rows of one come before and behind those of the other.
struct CrossedSum {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  Conv1x1<3, 17> a;
  Conv1x1<3, 4> b;
  Conv1x1<21, 16> c;
  Conv1x1<16, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("c", self.c);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto, auto identity) const {
    const auto x = identity | a | npt::instance_norm;
    const auto y = identity | b;
    return (cat(y, x | npt::relu) + cat(x, y)) | c | npt::relu | d;
  }
};

}  // namespace

TEST_CASE("a tensor that a stage reads twice collects both gradients, whichever rows come first") {
  for (const int vertices : {37, 200}) {
    const auto report = npt::check_gradients<CrossedSum>({.vertices = vertices});
    CAPTURE(report.where);
    CHECK(report.worst < 1e-6);
  }
  npt::Model<CrossedSum, double> model;
  npt::randomise(model, 5);
  const auto points = support::random_points<double>(200, 1);
  std::vector<double> result(points.size());
  npt::Gradients<CrossedSum, double> gradients(1);
  gradients.load(model.buffer());
  const npt::NetworkCall<double> call{{points, points}, result};
  gradients.forward({&call, 1});
  CHECK(support::relative_error(result, plain::forward(model, support::to_map(points), support::to_map(points))) <
        1e-10);
}
