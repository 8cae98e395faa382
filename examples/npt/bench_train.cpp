#include "bench_train.hpp"

#include "networks.hpp"
#include "precision_option.hpp"
#include "subcommand.hpp"
#include "training_networks.hpp"

#include <bench/peak.hpp>
#include <host/host.hpp>

#include <npt/base/error.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/body_sampler.hpp>
#include <npt/nn/train/initialise.hpp>
#include <npt/nn/train/trainer.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

struct Options {
  std::size_t vertices = 6890, batch = 8;
  int threads = 0, repeats = 5;
  program::Variant variant;
  std::string precision = "auto", optimiser = "adam";
  std::optional<std::uint64_t> seed;
  bool json = false;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

npt::BodySampler sampler(std::size_t vertices, std::uint64_t seed) {
  npt::BodySamplerOptions options;
  options.seed = seed;
  options.vertices = vertices == npt::mannequin().vertex_count() ? 0 : vertices;
  options.topology = false;
  return npt::BodySampler(npt::borrowed(npt::mannequin()), options);
}

std::vector<float> initial_weights(const program::NetworkType& network, std::uint64_t seed) {
  std::vector<float> values(network.buffer_size);
  npt::set_attributes(*network.parameters, std::span(values));
  npt::initialise<float>(*network.parameters, std::span(values), npt::Initialisation::small, seed);
  return values;
}

/// A loss and its gradient by the parameters, for the same weights and samples in either precision.
template <class T, class Core>
class Problem {
 public:
  Problem(Core gradients, std::span<const npt::Sample> samples) : gradients_(std::move(gradients)) {
    for (const npt::Sample& s : samples) {
      poses_.emplace_back(npt::pose_of(s).begin(), npt::pose_of(s).end());
      identities_.emplace_back(npt::identity_of(s).begin(), npt::identity_of(s).end());
      truths_.emplace_back(s.truth.begin(), s.truth.end());
      results_.emplace_back(s.truth.size());
      result_gradients_.emplace_back(s.truth.size());
    }
    for (std::size_t i = 0; i < samples.size(); ++i) calls_.push_back({{poses_[i], identities_[i]}, results_[i]});
    for (const std::vector<T>& g : result_gradients_) result_gradient_spans_.push_back(g);
  }

  double loss(std::span<const T> parameters) {
    gradients_.load(parameters);
    gradients_.forward(calls_);
    double sum = 0;
    for (std::size_t i = 0; i < calls_.size(); ++i) {
      std::fill(result_gradients_[i].begin(), result_gradients_[i].end(), T(0));
      sum += npt::reconstruction_loss<T>(results_[i], truths_[i], npt::LossScaling::sum, 1, result_gradients_[i]);
    }
    return sum;
  }
  std::vector<T> gradient(std::span<const T> parameters) {
    loss(parameters);
    std::vector<T> gradient(parameters.size());
    gradients_.backward(result_gradient_spans_, gradient);
    return gradient;
  }

 private:
  Core gradients_;
  std::vector<std::vector<T>> poses_, identities_, truths_, results_, result_gradients_;
  std::vector<npt::NetworkCall<T>> calls_;
  std::vector<std::span<const T>> result_gradient_spans_;
};

struct Errors {
  double gradient = 0;           ///< of fp32 against double, norm of the difference over norm
  double finite_difference = 0;  ///< of double's slope along a random direction against central differences
};

/// On two small calls: the same code runs for any number of vertices.
Errors check_gradients(const program::NetworkType& network, const Options& o, std::uint64_t seed) {
  const program::TrainableNetwork& trainable = *program::find_trainable(o.variant);
  const npt::BodySampler source = sampler(std::min<std::size_t>(o.vertices, 230), seed);
  const npt::Sample samples[] = {source.draw(0, 0), source.draw(0, 1)};
  const std::vector<float> weights = initial_weights(network, seed);
  std::vector<double> point(weights.begin(), weights.end());
  const npt::Precision precision = program::precision_from(o.precision);
  program::FloatGradients gradients = trainable.gradients(o.threads);
  gradients.set_precision(precision);
  Problem<float, program::FloatGradients> in_float(std::move(gradients), samples);
  Problem<double, program::DoubleGradients> in_double(trainable.double_gradients(o.threads), samples);
  const std::vector<float> found = in_float.gradient(weights);
  const std::vector<double> expected = in_double.gradient(point);
  Errors errors;
  double difference = 0, norm = 0, slope = 0;
  std::vector<double> direction(point.size());
  npt::Random random(seed, 99);
  for (const npt::Slice& s : npt::learned_slices(*network.parameters))
    for (std::size_t i = s.first; i < s.last; ++i) {
      difference += std::pow(static_cast<double>(found[i]) - expected[i], 2);
      norm += expected[i] * expected[i];
      // Along the gradient with some noise: a direction that is merely random hardly changes the loss.
      direction[i] = expected[i] * random.uniform(0.5, 1.5);
      slope += direction[i] * expected[i];
    }
  errors.gradient = std::sqrt(difference / norm);
  const double step = 1e-6 / std::sqrt(norm);
  const auto loss_at = [&](double t) {
    std::vector<double> moved = point;
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += t * direction[i];
    return in_double.loss(moved);
  };
  errors.finite_difference = std::abs((loss_at(step) - loss_at(-step)) / (2 * step) / slope - 1);
  const double bound = precision == npt::Precision::bf16 ? 0.2 : precision == npt::Precision::bf16x2 ? 1e-2 : 1e-3;
  if (!(errors.gradient < bound) || !(errors.finite_difference < 1e-4))
    throw npt::Error({.file = "bench train",
                      .found = "a gradient that is off by " + std::to_string(errors.gradient) + ", a slope by " +
                               std::to_string(errors.finite_difference),
                      .expected = "less than " + std::to_string(bound) + " and 1e-4 before timing"});
  return errors;
}

void run(Options o) {
  if (o.threads == 0) o.threads = npt::DefaultExecutor().slots();
  if (o.vertices > npt::mannequin().vertex_count())
    throw npt::Error({.file = "--vertices",
                      .found = std::to_string(o.vertices),
                      .expected = "at most " + std::to_string(npt::mannequin().vertex_count()) +
                                  ", those of the mannequin that samples are drawn from"});
  const std::uint64_t seed =
      o.seed.value_or(static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count()));
  const program::NetworkType& network = *program::find_network(o.variant);
  const Errors errors = check_gradients(network, o, seed);

  const npt::BodySampler source = sampler(o.vertices, seed);
  std::vector<float> weights = initial_weights(network, seed);
  program::FloatGradients gradients = program::find_trainable(o.variant)->gradients(o.threads);
  gradients.set_precision(program::precision_from(o.precision));
  npt::TrainerOptions options;
  options.stages = {{.begin = 0, .batch = o.batch, .source = &source}};
  options.steps = 1'000'000;
  options.rate = npt::ConstantRate{npt::paper_learning_rate};
  if (o.optimiser == "muon") options.matrix_rate = 3;
  options.muon.parts = std::min(1, npt::parts_of(gradients.precision()));
  const std::string products = program::products_text(gradients.precision());
  npt::Trainer trainer(gradients, *network.parameters, std::span(weights), options);
  trainer.step();  // warm
  std::vector<double> seconds, data, forward, losses, backward, optimise, peaks;
  for (int i = 0; i < o.repeats; ++i) {
    const npt::StepReport report = trainer.step();
    seconds.push_back(report.seconds.whole);
    data.push_back(report.seconds.data);
    forward.push_back(report.seconds.forward);
    losses.push_back(report.seconds.loss);
    backward.push_back(report.seconds.backward);
    optimise.push_back(report.seconds.optimise);
    peaks.push_back(bench::measure_peak<float>(o.threads));  // in turn: both see the same machine
  }
  // Of a convolution: the product itself, and those for the gradients of its input and of its weights.
  const double operations = 3 * 2 * network.program->multiply_adds * static_cast<double>(o.vertices * o.batch);
  const double typical = median(seconds), gflops = 1e-9 * operations / typical, peak = median(peaks);
  const double least = *std::min_element(seconds.begin(), seconds.end());
  const double memory = host::peak_memory_mb();
  if (o.json) {
    std::printf(
        "{\"bench\": \"train, %s\", \"isa\": \"%s\", \"precision\": \"%s\", \"products\": \"%s\", \"optimiser\": "
        "\"%s\", "
        "\"threads\": %d, \"vertices\": %zu, \"batch\": %zu, \"seed\": "
        "%llu, \"seconds_min\": %.6g, \"seconds_median\": %.6g, \"gflops\": %.5g, \"peak_gflops\": %.5g, \"share\": "
        "%.4g, \"data_seconds\": %.4g, \"data_share\": %.4g, \"forward_seconds\": %.4g, \"loss_seconds\": %.4g, "
        "\"backward_seconds\": %.4g, \"optimise_seconds\": %.4g, \"gradient_error\": %.3g, "
        "\"finite_difference_error\": %.3g, \"engine_mb\": %.1f, \"peak_memory_mb\": %.1f}\n",
        o.variant.text().c_str(), npt::compiled_isa(), o.precision.c_str(), products.c_str(), o.optimiser.c_str(),
        o.threads, o.vertices, o.batch, static_cast<unsigned long long>(seed), least, typical, gflops, peak,
        gflops / peak, median(data), median(data) / typical, median(forward), median(losses), median(backward),
        median(optimise), errors.gradient, errors.finite_difference, static_cast<double>(gradients.bytes()) * 1e-6,
        memory);
    return;
  }
  std::printf("training step, %s, %s, %s, %zu vertices, batch %zu, %d thread%s, %s\n", o.variant.text().c_str(),
              program::precision_text(o.precision, products).c_str(), o.optimiser.c_str(), o.vertices, o.batch,
              o.threads, o.threads == 1 ? "" : "s", npt::compiled_isa());
  std::printf("gradient       %.2e from double's, whose slope is %.2e from finite differences (seed %llu)\n",
              errors.gradient, errors.finite_difference, static_cast<unsigned long long>(seed));
  std::printf("seconds        %.4f min, %.4f median of %zu\n", least, typical, seconds.size());
  std::printf("  data         %.4f (%.1f %%)\n", median(data), 100 * median(data) / typical);
  std::printf("  forward      %.4f\n", median(forward));
  std::printf("  losses       %.4f\n", median(losses));
  std::printf("  backward     %.4f\n", median(backward));
  std::printf("  optimiser    %.4f\n", median(optimise));
  std::printf("GFLOP/s        %.0f by the plain algorithm's count\n", gflops);
  std::printf("peak GFLOP/s   %.0f in this process; share %.1f %%\n", peak, 100 * gflops / peak);
  std::printf("memory         %.1f MB at most, %.1f MB of it the gradients' own\n", memory,
              static_cast<double>(gradients.bytes()) * 1e-6);
}

}  // namespace

namespace program {

void add_bench_train(CLI::App& bench) {
  auto o = std::make_shared<Options>();
  CLI::App* train = bench.add_subcommand("train", "Time a training step: data, forward, losses, backward, optimiser");
  train->add_option("--vertices", o->vertices, "Draw this many of the mannequin's vertices for each mesh")
      ->check(CLI::Range(std::size_t{2}, std::size_t{10000000}))
      ->capture_default_str();
  train->add_option("--batch", o->batch, "Put this many pairs into a step")
      ->check(CLI::Range(std::size_t{1}, std::size_t{4096}))
      ->capture_default_str();
  train->add_option("--bottleneck", o->variant.bottleneck, "Give the pose feature this many channels")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->capture_default_str();
  train->add_option("--order", o->variant.order, "Order layers as the paper (conv_relu) or its code (relu_conv)")
      ->check(CLI::IsMember({"conv_relu", "relu_conv"}))
      ->capture_default_str();
  train->add_option("--feature", o->variant.feature, "Use this pose feature")
      ->check(CLI::IsMember({"per-vertex", "pooled"}))
      ->capture_default_str();
  program::add_precision_option(*train, o->precision);
  train->add_option("--optimiser", o->optimiser, "Optimise with Adam (the paper), or with Muon beside it")
      ->check(CLI::IsMember({"adam", "muon"}))
      ->capture_default_str();
  train->add_option("--threads", o->threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  train->add_option("--repeats", o->repeats, "Time this many steps")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  train->add_option("--seed", o->seed, "Draw weights and samples from this seed (default: another one each time)")
      ->check(whole_number());
  train->add_flag("--json", o->json, "Print one line of JSON");
  train->callback([o] { run(*o); });
}

}  // namespace program
