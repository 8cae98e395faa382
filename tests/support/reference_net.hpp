/// The network of the paper in plain double loops, written from its text and without any of the library's kernels: what
/// the fused engine is compared with.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace reference {

/// [C, V], row major.
struct Map {
  std::size_t channels = 0, vertices = 0;
  std::vector<double> values;
  Map() = default;
  Map(std::size_t c, std::size_t v) : channels(c), vertices(v), values(c * v) {}
  double* row(std::size_t c) { return values.data() + c * vertices; }
  const double* row(std::size_t c) const { return values.data() + c * vertices; }
};

/// Tensors by the names of the public state dict, row major.
using Weights = std::map<std::string, std::vector<double>>;

#if defined(__GNUC__) && !defined(__clang__)
#define REFERENCE_OPTIMISED __attribute__((optimize("O3")))  // tests are compiled at -O1, and this runs for seconds
#else
#define REFERENCE_OPTIMISED
#endif

/// y[v] += w0 a[v] + w1 b[v] + w2 c[v] + w3 d[v], in this order.
REFERENCE_OPTIMISED inline void add_four(double* __restrict__ y, const double* w, const double* a, const double* b,
                                         const double* c, const double* d, std::size_t count) {
  for (std::size_t v = 0; v < count; ++v) y[v] = (((y[v] + w[0] * a[v]) + w[1] * b[v]) + w[2] * c[v]) + w[3] * d[v];
}

/// The same for four rows of y and of w, which reads a to d once for all, in half the time.
REFERENCE_OPTIMISED inline void add_four_to_four(double* __restrict__ y0, double* __restrict__ y1,
                                                 double* __restrict__ y2, double* __restrict__ y3, const double* w,
                                                 std::size_t w_row, const double* a, const double* b, const double* c,
                                                 const double* d, std::size_t count) {
  const double *w0 = w, *w1 = w0 + w_row, *w2 = w1 + w_row, *w3 = w2 + w_row;
  for (std::size_t v = 0; v < count; ++v) {
    y0[v] = (((y0[v] + w0[0] * a[v]) + w0[1] * b[v]) + w0[2] * c[v]) + w0[3] * d[v];
    y1[v] = (((y1[v] + w1[0] * a[v]) + w1[1] * b[v]) + w1[2] * c[v]) + w1[3] * d[v];
    y2[v] = (((y2[v] + w2[0] * a[v]) + w2[1] * b[v]) + w2[2] * c[v]) + w2[3] * d[v];
    y3[v] = (((y3[v] + w3[0] * a[v]) + w3[1] * b[v]) + w3[2] * c[v]) + w3[3] * d[v];
  }
}

inline Map conv(const Weights& weights, const std::string& name, const Map& x) {
  const std::vector<double>& w = weights.at(name + ".weight");
  const std::vector<double>& b = weights.at(name + ".bias");
  Map y(b.size(), x.vertices);
  constexpr std::size_t strip = 128;  // vertices at a time, for the cache
  for (std::size_t begin = 0; begin < x.vertices; begin += strip) {
    const std::size_t count = std::min(strip, x.vertices - begin);
    const auto in = [&](std::size_t i) { return x.row(i) + begin; };
    const auto out_of = [&](std::size_t o) { return y.row(o) + begin; };
    const std::size_t in_fours = x.channels / 4 * 4, out_fours = y.channels / 4 * 4;
    for (std::size_t o = 0; o < y.channels; ++o) std::fill_n(out_of(o), count, b[o]);
    for (std::size_t o = 0; o < out_fours; o += 4)
      for (std::size_t i = 0; i < in_fours; i += 4)
        add_four_to_four(out_of(o), out_of(o + 1), out_of(o + 2), out_of(o + 3), w.data() + o * x.channels + i,
                         x.channels, in(i), in(i + 1), in(i + 2), in(i + 3), count);
    for (std::size_t o = 0; o < y.channels; ++o) {
      double* out = out_of(o);
      const double* row = w.data() + o * x.channels;
      std::size_t i = o < out_fours ? in_fours : 0;
      for (; i + 4 <= x.channels; i += 4) add_four(out, row + i, in(i), in(i + 1), in(i + 2), in(i + 3), count);
      for (; i < x.channels; ++i)
        for (std::size_t v = 0; v < count; ++v) out[v] += row[i] * in(i)[v];
    }
  }
  return y;
}

inline Map instance_norm(Map x) {
  for (std::size_t c = 0; c < x.channels; ++c) {
    double* row = x.row(c);
    const double n = static_cast<double>(x.vertices);
    double mean = 0, variance = 0;
    for (std::size_t v = 0; v < x.vertices; ++v) mean += row[v] / n;
    for (std::size_t v = 0; v < x.vertices; ++v) variance += (row[v] - mean) * (row[v] - mean) / n;
    for (std::size_t v = 0; v < x.vertices; ++v) row[v] = (row[v] - mean) / std::sqrt(variance + 1e-5);
  }
  return x;
}

inline Map relu(Map x) {
  for (double& value : x.values) value = value < 0 ? 0 : value;
  return x;
}

struct Variant {
  bool relu_conv = false;
  bool pooled = false;
  double output_scale = 1;
};

inline Map spadain(const Weights& w, const std::string& name, const Map& x, const Map& identity, bool normalise) {
  const Map gamma = conv(w, name + ".conv_weight", identity);
  const Map beta = conv(w, name + ".conv_bias", identity);
  Map y = normalise ? instance_norm(x) : x;
  for (std::size_t i = 0; i < y.values.size(); ++i) y.values[i] = gamma.values[i] * y.values[i] + beta.values[i];
  return y;
}

inline Map unit(const Weights& w, const std::string& block, const std::string& norm, const std::string& convolution,
                const Map& x, const Map& identity, const Variant& variant, bool normalise) {
  const Map y = spadain(w, block + "." + norm, x, identity, normalise);
  return variant.relu_conv ? conv(w, block + "." + convolution, relu(y)) : relu(conv(w, block + "." + convolution, y));
}

inline Map block(const Weights& w, const std::string& name, const Map& x, const Map& identity, const Variant& variant,
                 bool normalise) {
  const Map first = unit(w, name, "spadain1", "conv1", x, identity, variant, normalise);
  Map y = unit(w, name, "spadain2", "conv2", first, identity, variant, normalise);
  const Map skip = unit(w, name, "spadain_res", "conv_res", x, identity, variant, normalise);
  for (std::size_t i = 0; i < y.values.size(); ++i) y.values[i] += skip.values[i];
  return y;
}

inline Map encode(const Weights& w, Map x) {
  for (const char* name : {"encoder.conv1", "encoder.conv2", "encoder.conv3"})
    x = relu(instance_norm(conv(w, name, x)));
  return x;
}

/// pose [3, Vp], identity [3, V] -> [3, V].
inline Map forward(const Weights& w, const Map& pose, const Map& identity, const Variant& variant) {
  const Map feature = encode(w, pose);
  Map x(feature.channels + 3, identity.vertices);
  for (std::size_t c = 0; c < feature.channels; ++c)
    for (std::size_t v = 0; v < identity.vertices; ++v)
      x.row(c)[v] =
          variant.pooled ? *std::max_element(feature.row(c), feature.row(c) + feature.vertices) : feature.row(c)[v];
  for (std::size_t c = 0; c < 3; ++c) std::copy_n(identity.row(c), identity.vertices, x.row(feature.channels + c));
  x = conv(w, "decoder.conv1", x);
  x = block(w, "decoder.spadain_block1", x, identity, variant, !variant.pooled);
  x = conv(w, "decoder.conv2", x);
  x = block(w, "decoder.spadain_block2", x, identity, variant, true);
  x = conv(w, "decoder.conv3", x);
  x = block(w, "decoder.spadain_block3", x, identity, variant, true);
  x = conv(w, "decoder.conv4", x);
  for (double& value : x.values) value = variant.output_scale * std::tanh(value);
  return x;
}

}  // namespace reference
