// Layers in networks of one's own, against plain loops: compositions that the pose transfer network doesn't contain.
#include <doctest/doctest.h>

#include <npt/nn/engine/engine.hpp>
#include <npt/nn/layer/max_pool.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/res_block.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <algorithm>
#include <cmath>

#include "support/nets.hpp"

namespace {

using reference::Map;
using reference::Weights;

/// Error of a custom network's engine against `expected(weights, pose, identity)`.
template <class Net, class Expected>
double error_of(Expected&& expected, std::size_t pose_vertices = 150, std::size_t vertices = 150) {
  npt::Model<Net, double> model;
  npt::randomise(model, 3);
  const auto pose = support::random_points<double>(pose_vertices, 1);
  const auto identity = support::random_points<double>(vertices, 2);
  std::vector<double> result(identity.size());
  npt::Engine(model, 2)({pose, identity}, result);
  const Map map = expected(support::weights_of(model), support::to_map(pose), support::to_map(identity));
  return support::relative_error(result, map);
}

Map tanh_of(Map x) {
  for (double& v : x.values) v = std::tanh(v);
  return x;
}
Map sum(Map a, const Map& b) {
  for (std::size_t i = 0; i < a.values.size(); ++i) a.values[i] += b.values[i];
  return a;
}
Map cat_maps(const Map& a, const Map& b) {
  Map c(a.channels + b.channels, a.vertices);
  std::copy(a.values.begin(), a.values.end(), c.values.begin());
  std::copy(b.values.begin(), b.values.end(), c.values.begin() + static_cast<std::ptrdiff_t>(a.values.size()));
  return c;
}
Map maxima_over(const Map& x, std::size_t vertices) {
  Map y(x.channels, vertices);
  for (std::size_t c = 0; c < x.channels; ++c)
    std::fill_n(y.row(c), vertices, *std::max_element(x.row(c), x.row(c) + x.vertices));
  return y;
}

/// A user's pointwise layer with a parameter for each channel: max(x, slope x).
template <int C>
struct PRelu : npt::kernel::Pointwise {
  static constexpr const char* name = "prelu";
  static constexpr int channels = C;
  npt::Parameter slope{C};
  static constexpr void visit(auto& self, auto&& visitor) { visitor("slope", self.slope); }
  template <class T>
  static npt::simd::Batch<T> row(const npt::kernel::PointwiseArgs<T>& args, int c) {
    return npt::simd::broadcast(args.parameters[0][c]);
  }
  template <class T>
  static npt::simd::Batch<T> apply(npt::simd::Batch<T> x, const npt::simd::Batch<T>& slope, Nothing) {
    return npt::simd::running_max(x, slope * x);
  }
};

struct PReluNet {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 37> a;
  PRelu<37> p;
  npt::Conv1x1<40, 3> b;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("p", self.p);
    visitor("b", self.b);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    return cat(pose | a | npt::instance_norm | p, identity) | b | npt::tanh;
  }
};

/// Residuals of several kinds: the input itself, a normalised branch behind a sum, a sum of three.
struct ResidualNet {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 20> a;
  npt::Conv1x1<20, 20> b, c, d;
  npt::Conv1x1<20, 3> e;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("c", self.c);
    visitor("d", self.d);
    visitor("e", self.e);
  }
  constexpr auto operator()(auto, auto identity) const {
    const auto h = identity | a;
    const auto r = h + (h | npt::instance_norm | npt::relu | b | npt::relu);
    const auto s = r + (r | c | npt::tanh) + (h | npt::relu | d);
    return identity + (s | npt::instance_norm | e);
  }
};

/// Two pooled features, one of each mesh, and the pose's coordinates used again by the decoder.
struct GlobalNet {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 24> a;
  npt::Conv1x1<3, 10> b;
  npt::Conv1x1<40, 17> c;
  npt::Conv1x1<17, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("c", self.c);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto f = pose | a | npt::instance_norm | npt::relu | npt::max_pool;
    const auto g = identity | b | npt::tanh | npt::max_pool;
    return cat(cat(f, identity), cat(g, pose)) | c | npt::relu | d;
  }
};

/// Layers behind max_pool: directly, with a parameter a channel, and behind a concatenation with per-vertex channels;
/// the plain maxima are used as well.
struct BehindPoolNet {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 21> a;
  PRelu<21> p;
  PRelu<24> q;
  npt::Conv1x1<24, 17> b;
  npt::Conv1x1<41, 19> c;
  npt::Conv1x1<40, 3> d;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("p", self.p);
    visitor("q", self.q);
    visitor("b", self.b);
    visitor("c", self.c);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto f = pose | a | npt::max_pool;
    const auto y = cat(identity, f | npt::tanh | p) | q | npt::tanh | b;
    const auto z = cat(cat(f, y) | npt::relu, identity) | c;
    return cat(f | npt::tanh, z) | npt::relu | d;
  }
};

}  // namespace

TEST_CASE("a pointwise layer of the user's own, with parameters, equals plain loops") {
  CHECK(error_of<PReluNet>([](const Weights& w, const Map& pose, const Map& identity) {
          Map h = reference::instance_norm(reference::conv(w, "a", pose));
          for (std::size_t c = 0; c < h.channels; ++c)
            for (std::size_t v = 0; v < h.vertices; ++v)
              h.row(c)[v] = std::max(h.row(c)[v], w.at("p.slope")[c] * h.row(c)[v]);
          return tanh_of(reference::conv(w, "b", cat_maps(h, identity)));
        }) < 1e-13);
}

TEST_CASE("residual connections of several kinds equal plain loops") {
  CHECK(error_of<ResidualNet>([](const Weights& w, const Map&, const Map& identity) {
          using reference::conv, reference::instance_norm, reference::relu;
          const Map h = conv(w, "a", identity);
          const Map r = sum(h, relu(conv(w, "b", relu(instance_norm(h)))));
          const Map s = sum(sum(r, tanh_of(conv(w, "c", r))), conv(w, "d", relu(h)));
          return sum(identity, conv(w, "e", instance_norm(s)));
        }) < 1e-13);
}

TEST_CASE("maxima of both meshes, and the pose's own coordinates in the decoder, equal plain loops") {
  CHECK(error_of<GlobalNet>([](const Weights& w, const Map& pose, const Map& identity) {
          using reference::conv, reference::instance_norm, reference::relu;
          const Map f = maxima_over(relu(instance_norm(conv(w, "a", pose))), identity.vertices);
          const Map g = maxima_over(tanh_of(conv(w, "b", identity)), identity.vertices);
          const Map x = cat_maps(cat_maps(f, identity), cat_maps(g, pose));
          return conv(w, "d", relu(conv(w, "c", x)));
        }) < 1e-13);
}

TEST_CASE("pointwise layers behind maxima equal plain loops") {
  CHECK(error_of<BehindPoolNet>(
            [](const Weights& w, const Map& pose, const Map& identity) {
              using reference::conv, reference::relu;
              const auto prelu = [&w](const char* slopes, Map x) {
                for (std::size_t c = 0; c < x.channels; ++c)
                  for (std::size_t v = 0; v < x.vertices; ++v)
                    x.row(c)[v] = std::max(x.row(c)[v], w.at(slopes)[c] * x.row(c)[v]);
                return x;
              };
              const Map f = maxima_over(conv(w, "a", pose), identity.vertices);
              const Map x = cat_maps(identity, prelu("p.slope", tanh_of(f)));
              const Map y = conv(w, "b", tanh_of(prelu("q.slope", x)));
              const Map z = conv(w, "c", cat_maps(relu(cat_maps(f, y)), identity));
              return conv(w, "d", relu(cat_maps(tanh_of(f), z)));
            },
            230, 150) < 1e-13);
}

TEST_CASE("the pose's coordinates in the decoder also come out of an encoded pose") {
  npt::Model<GlobalNet> model;
  npt::randomise(model, 3);
  const npt::Engine engine(model, 1);
  const auto pose = support::random_points<float>(150, 1), identity = support::random_points<float>(150, 2);
  std::vector<float> direct(450), decoded(450);
  engine({pose, identity}, direct);
  engine.decode(engine.encode(pose), {identity}, decoded);
  CHECK(direct == decoded);
}
