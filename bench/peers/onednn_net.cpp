/// The paper's network on oneDNN, assembled as well as its interface allows: vertex-major [V, C] maps, weights
/// reordered once into the layout that the library likes best, bias, ReLU and the residual sum as post-operations of
/// the product; between products one pass for the moments and one that normalises and modulates, with gamma and beta
/// evaluated on the fly, vectorised and on all threads by OpenMP.
#include <npt/io/safetensors.hpp>

#include <oneapi/dnnl/dnnl.hpp>

#include <omp.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using dnnl::memory;
using Floats = std::vector<float>;

constexpr auto f32 = memory::data_type::f32;

struct Options {
  std::filesystem::path input;
  int threads = 1, repeats = 9;
};

enum class Behind { nothing, relu, relu_and_sum };  ///< relu_and_sum adds to what the destination holds

/// dst = src [V, K] times weight [M, K] transposed, plus bias.
class Product {
 public:
  Product(const dnnl::engine& engine, dnnl::stream& stream, const npt::SafetensorsFile& file, const std::string& name,
          memory::dim vertices, Behind behind)
      : stream_(stream),
        weight_values_(npt::to_float(file.at(name + ".weight"))),
        bias_values_(npt::to_float(file.at(name + ".bias"))) {
    using tag = memory::format_tag;
    const auto rows = static_cast<memory::dim>(bias_values_.size());
    const auto columns = static_cast<memory::dim>(weight_values_.size()) / rows;
    const memory::desc source({vertices, columns}, f32, tag::ab), target({vertices, rows}, f32, tag::ab),
        bias({1, rows}, f32, tag::ab), any({columns, rows}, f32, tag::any);
    dnnl::primitive_attr attributes;
    if (behind != Behind::nothing) {
      dnnl::post_ops after;
      after.append_eltwise(1.0F, dnnl::algorithm::eltwise_relu, 0, 0);
      if (behind == Behind::relu_and_sum) after.append_sum(1.0F);
      attributes.set_post_ops(after);
    }
    const dnnl::matmul::primitive_desc description(dnnl::matmul::desc(source, any, bias, target), attributes, engine);
    implementation = description.impl_info_str();
    product_ = dnnl::matmul(description);
    memory plain({{columns, rows}, f32, tag::ba}, engine, weight_values_.data());
    weight_ = memory(description.weights_desc(), engine);
    dnnl::reorder(plain, weight_).execute(stream_, plain, weight_);
    stream_.wait();
    bias_ = memory(bias, engine, bias_values_.data());
    source_ = memory(source, engine, nullptr);
    target_ = memory(target, engine, nullptr);
  }

  void operator()(const Floats& source, Floats& target) {
    source_.set_data_handle(const_cast<float*>(source.data()));
    target_.set_data_handle(target.data());
    product_.execute(
        stream_,
        {{DNNL_ARG_SRC, source_}, {DNNL_ARG_WEIGHTS, weight_}, {DNNL_ARG_BIAS, bias_}, {DNNL_ARG_DST, target_}});
    stream_.wait();
  }

  std::string implementation;

 private:
  dnnl::stream& stream_;
  Floats weight_values_, bias_values_;
  dnnl::matmul product_;
  memory weight_, bias_, source_, target_;
};

/// Mean and 1 / deviation of each channel of a [V, C] map. Sums of differences from the first vertex, which are small
/// beside the values, so that one pass in fp32 with partial sums in double is exact enough.
struct Moments {
  Floats mean, inverse;

  void of(const Floats& map, int channels) {
    const auto count = static_cast<std::size_t>(channels);
    const int vertices = static_cast<int>(map.size() / count);
    std::vector<double> sums(count), squares(count);
#pragma omp parallel
    {
      Floats s(count), q(count);
      std::vector<double> ds(count), dq(count);
      const auto flush = [&] {
        for (std::size_t c = 0; c < count; ++c) {
          ds[c] += double{s[c]};
          dq[c] += double{q[c]};
          s[c] = q[c] = 0;
        }
      };
      int pending = 0;
#pragma omp for schedule(static) nowait
      for (int v = 0; v < vertices; ++v) {
        const float* row = map.data() + static_cast<std::size_t>(v) * count;
        const float* pivot = map.data();
        float *sum = s.data(), *square = q.data();
#pragma omp simd
        for (std::size_t c = 0; c < count; ++c) {
          const float d = row[c] - pivot[c];
          sum[c] += d;
          square[c] += d * d;
        }
        if (++pending % 64 == 0) flush();
      }
      flush();
#pragma omp critical
      for (std::size_t c = 0; c < count; ++c) {
        sums[c] += ds[c];
        squares[c] += dq[c];
      }
    }
    mean.resize(count);
    inverse.resize(count);
    for (std::size_t c = 0; c < count; ++c) {
      const double m = sums[c] / vertices;
      mean[c] = static_cast<float>(double{map[c]} + m);
      inverse[c] = static_cast<float>(1 / std::sqrt(std::max(squares[c] / vertices - m * m, 0.0) + 1e-5));
    }
  }
};

/// gamma's and beta's weights by coordinate, so that the loop over channels is contiguous.
class Modulation {
 public:
  Modulation(const npt::SafetensorsFile& file, const std::string& name) {
    for (const char* part : {".conv_weight", ".conv_bias"}) {
      const Floats weight = npt::to_float(file.at(name + part + ".weight"));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Floats column;
        for (std::size_t c = 0; c < weight.size() / 3; ++c) column.push_back(weight[3 * c + axis]);
        weights_.push_back(std::move(column));
      }
      weights_.push_back(npt::to_float(file.at(name + part + ".bias")));
    }
  }

  /// out = gamma(p) * (map - mean) * inverse + beta(p).
  void operator()(const Floats& map, const Moments& moments, const Floats& points, Floats& out) const {
    const std::size_t count = weights_[0].size();
    const int vertices = static_cast<int>(map.size() / count);
#pragma omp parallel for schedule(static)
    for (int v = 0; v < vertices; ++v) {
      const float* h = map.data() + static_cast<std::size_t>(v) * count;
      float* o = out.data() + static_cast<std::size_t>(v) * count;
      const float* p = points.data() + 3 * static_cast<std::size_t>(v);
      const float x = p[0], y = p[1], z = p[2];
      const float *g0 = weights_[0].data(), *g1 = weights_[1].data(), *g2 = weights_[2].data(),
                  *g3 = weights_[3].data();
      const float *b0 = weights_[4].data(), *b1 = weights_[5].data(), *b2 = weights_[6].data(),
                  *b3 = weights_[7].data();
      const float *mean = moments.mean.data(), *inverse = moments.inverse.data();
#pragma omp simd
      for (std::size_t c = 0; c < count; ++c)
        o[c] = (g0[c] * x + g1[c] * y + g2[c] * z + g3[c]) * ((h[c] - mean[c]) * inverse[c]) +
               (b0[c] * x + b1[c] * y + b2[c] * z + b3[c]);
    }
  }

 private:
  std::vector<Floats> weights_;
};

/// ReLU of the normalised map into rows of out, and the points behind them if the rows are longer.
void normalise_relu(const Floats& map, int channels, const Moments& moments, const Floats& points, Floats& out) {
  const auto count = static_cast<std::size_t>(channels);
  const int vertices = static_cast<int>(map.size() / count);
  const std::size_t stride = out.size() / static_cast<std::size_t>(vertices);
#pragma omp parallel for schedule(static)
  for (int v = 0; v < vertices; ++v) {
    const float* h = map.data() + static_cast<std::size_t>(v) * count;
    float* o = out.data() + static_cast<std::size_t>(v) * stride;
    const float *mean = moments.mean.data(), *inverse = moments.inverse.data();
#pragma omp simd
    for (std::size_t c = 0; c < count; ++c) {
      const float n = (h[c] - mean[c]) * inverse[c];
      o[c] = n > 0 ? n : 0;
    }
    for (std::size_t axis = 0; axis < stride - count; ++axis)
      o[count + axis] = points[3 * static_cast<std::size_t>(v) + axis];
  }
}

class Net {
 public:
  Net(const npt::SafetensorsFile& file, int bottleneck)
      : file_(file),
        engine_(dnnl::engine::kind::cpu, 0),
        stream_(engine_),
        points_(npt::to_float(file.at("identity"))),
        pose_(npt::to_float(file.at("pose"))),
        vertices_(static_cast<int>(pose_.size() / 3)) {
    const int w = bottleneck + 3;
    for (const int channels : {64, 128, bottleneck})
      encoder_.push_back(stage("encoder.conv" + std::to_string(encoder_.size() + 1), channels, Behind::nothing));
    entry_ = stage("decoder.conv1", w, Behind::nothing);
    joined_ = map(w);
    int channels = w;
    for (const int number : {1, 2, 3}) {
      const std::string name = "decoder.spadain_block" + std::to_string(number);
      const std::string next = "decoder.conv" + std::to_string(number + 1);
      const int after = number == 3 ? 3 : channels / 2;
      blocks_.push_back({Modulation(file, name + ".spadain1"), Modulation(file, name + ".spadain2"),
                         Modulation(file, name + ".spadain_res"), stage(name + ".conv1", channels, Behind::relu),
                         product(name + ".conv2", Behind::relu), product(name + ".conv_res", Behind::relu_and_sum),
                         stage(next, after, Behind::nothing), map(channels), map(channels)});
      channels = after;
    }
  }

  /// [V, 3]
  const Floats& operator()() {
    const Floats* h = &pose_;
    for (std::size_t i = 0; i < encoder_.size(); ++i) {
      Stage& s = encoder_[i];
      s.run(*h, s.out);
      moments_.of(s.out, s.channels);
      Floats& next = i + 1 == encoder_.size() ? joined_ : s.after;
      normalise_relu(s.out, s.channels, moments_, points_, next);
      h = &next;
    }
    entry_.run(*h, entry_.out);
    h = &entry_.out;
    for (Block& b : blocks_) {
      moments_.of(*h, b.first.channels);
      b.spadain1(*h, moments_, points_, b.operand);
      b.first.run(b.operand, b.first.out);
      b.spadain_res(*h, moments_, points_, b.operand);
      moments_.of(b.first.out, b.first.channels);
      // The second unit's operand may take the place of the first unit's result once that is modulated.
      b.spadain2(b.first.out, moments_, points_, b.first.out);
      b.second(b.first.out, b.sum);
      b.residual(b.operand, b.sum);
      b.next.run(b.sum, b.next.out);
      h = &b.next.out;
    }
    Floats& result = blocks_.back().next.out;
    for (float& x : result) x = std::tanh(x);
    return result;
  }

  /// The library's names of the implementations that it chose.
  const std::vector<std::string>& implementations() const { return implementations_; }

 private:
  struct Stage {
    std::function<void(const Floats&, Floats&)> run;
    int channels;
    Floats out, after;
  };
  struct Block {
    Modulation spadain1, spadain2, spadain_res;
    Stage first;
    std::function<void(const Floats&, Floats&)> second, residual;
    Stage next;
    Floats operand, sum;
  };

  Floats map(int channels) const {
    return Floats(static_cast<std::size_t>(channels) * static_cast<std::size_t>(vertices_));
  }
  std::function<void(const Floats&, Floats&)> product(const std::string& name, Behind behind) {
    auto p = std::make_shared<Product>(engine_, stream_, file_, name, vertices_, behind);
    if (std::ranges::find(implementations_, p->implementation) == implementations_.end())
      implementations_.push_back(p->implementation);
    return [p](const Floats& source, Floats& target) { (*p)(source, target); };
  }
  Stage stage(const std::string& name, int channels, Behind behind) {
    return {product(name, behind), channels, map(channels), map(channels)};
  }

  const npt::SafetensorsFile& file_;
  dnnl::engine engine_;
  dnnl::stream stream_;
  Floats points_, pose_;
  int vertices_;
  std::vector<std::string> implementations_;
  std::vector<Stage> encoder_;
  Stage entry_;
  Floats joined_;
  std::vector<Block> blocks_;
  Moments moments_;
};

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void run(const Options& o) {
  omp_set_num_threads(o.threads);
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(o.input);
  const Floats expected = npt::to_float(file.at("result"));
  Net net(file, static_cast<int>(npt::to_float(file.at("encoder.conv3.bias")).size()));
  const Floats found = net();
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double d = double{found[i]} - double{expected[i]};
    difference += d * d;
    norm += double{expected[i]} * double{expected[i]};
  }
  const double error = std::sqrt(difference / norm);
  if (!(error < 1e-4))
    throw std::runtime_error("another result than expected: relative error " + std::to_string(error));
  std::vector<double> seconds;
  for (int i = 0; i < o.repeats; ++i) {
    const double start = now();
    net();
    seconds.push_back(now() - start);
  }
  std::sort(seconds.begin(), seconds.end());
  std::string names;
  for (const std::string& name : net.implementations()) names += (names.empty() ? "" : " ") + name;
  const dnnl_version_t* version = dnnl_version();
  std::printf(
      "{\"peer\": \"oneDNN %d.%d.%d\", \"threads\": %d, \"seconds_min\": %.6g, \"seconds_median\": %.6g, \"error\": "
      "%.3g, "
      "\"implementations\": \"%s\"}\n",
      version->major, version->minor, version->patch, o.threads, seconds.front(), seconds[seconds.size() / 2], error,
      names.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The paper's network on oneDNN: checks its result, then times it; one line of JSON");
  Options o;
  app.add_option("case", o.input, "File that bench_make_case wrote")->required();
  app.add_option("--threads", o.threads, "Threads")->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_option("--repeats", o.repeats, "Timed runs")->check(CLI::Range(1, 10000))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(o);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "onednn_net: %s\n", e.what());
    return 1;
  }
}
