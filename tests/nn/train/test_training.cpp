/// Whole networks in training: what the gradients, the samples and the trainer do together.
#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/body_sampler.hpp>
#include <npt/lab/transfer_sample.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/train/gradients.hpp>
#include <npt/nn/train/initialise.hpp>
#include <npt/nn/train/trainer.hpp>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace {

/// One sample, again and again.
class OneSample final : public npt::SampleSource {
 public:
  explicit OneSample(npt::Sample sample) : sample_(std::move(sample)) {}
  void fill(std::uint64_t, std::uint64_t, npt::Sample& sample) const override { sample = sample_; }
  std::size_t max_vertices() const override { return sample_.vertex_count(); }
  bool equal_counts() const override { return true; }

 private:
  npt::Sample sample_;
};

npt::BodySampler sampler(std::size_t vertices) {
  npt::BodySamplerOptions options;
  options.seed = 11;
  options.vertices = vertices;
  return npt::BodySampler(npt::borrowed(npt::mannequin()), options);
}

template <class Net>
npt::Model<Net> initial_model() {
  npt::Model<Net> model;
  npt::initialise<float>(model.parameters(), model.buffer(), npt::Initialisation::small, 5);
  return model;
}

template <class Net>
std::vector<float> train(npt::TrainerOptions options, int threads, std::uint64_t stop_at = 0) {
  npt::Model<Net> model = initial_model<Net>();
  npt::Gradients<Net> gradients(threads);
  npt::Trainer trainer(gradients, model.parameters(), model.buffer(), options);
  while (!trainer.finished()) {
    trainer.step();
    if (trainer.steps() != stop_at) continue;
    // Everything but the checkpoint is thrown away.
    const npt::Checkpoint<float> checkpoint = trainer.checkpoint();
    npt::Model<Net> other = initial_model<Net>();
    npt::Gradients<Net> others_gradients(threads);
    npt::Trainer resumed(others_gradients, other.parameters(), other.buffer(), options);
    resumed.restore(checkpoint);
    while (!resumed.finished()) resumed.step();
    return {resumed.weights().begin(), resumed.weights().end()};
  }
  return {trainer.weights().begin(), trainer.weights().end()};
}

}  // namespace

TEST_CASE("one pair is learned by heart: PMD below 1e-6 square metres") {
  using Net = npt::PoseTransferNet<64>;
  const npt::Sample sample = sampler(150).draw(0, 0);
  const OneSample source(sample);
  npt::TrainerOptions options;
  options.stages = {{.begin = 0, .batch = 1, .source = &source}};
  options.steps = 2500;
  options.rate = npt::CosineRate{.rate = 3e-3, .warm_up = 0.05, .last = 0.001};
  const std::vector<float> weights = train<Net>(options, 1);
  npt::Model<Net> model;
  std::ranges::copy(weights, model.buffer().begin());
  std::vector<float> result(sample.truth.size());
  npt::Engine<Net>(model, 1)({npt::pose_of(sample), npt::identity_of(sample)}, result);
  const double pmd = npt::pmd(result, sample.truth) / (sample.scale * sample.scale);
  MESSAGE("PMD ", pmd);
  CHECK(pmd < 1e-6);
}

TEST_CASE("a network's training: the same bits for any number of threads, and after a stop") {
  const auto few = sampler(40), many = sampler(130);
  npt::TrainerOptions options;
  options.stages = {{.begin = 0, .batch = 6, .source = &few}, {.begin = 0.5, .batch = 3, .source = &many}};
  options.steps = 12;
  options.rate = npt::CosineRate{.rate = 1e-3};
  options.average = 0.9;
  options.clip = 0.1;
  const auto check = [&]<class Net>(Net) {
    const std::vector<float> weights = train<Net>(options, 1);
    CHECK(std::ranges::any_of(weights, [](float w) { return w != 0; }));
    CHECK(weights == train<Net>(options, 1, 5));
    CHECK(weights == train<Net>(options, 1, 8));
#if NPT_HAS_TBB
    CHECK(weights == train<Net>(options, 2));
    CHECK(weights == train<Net>(options, 2, 3));
#endif
  };
  check(npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>());
  check(npt::PoseTransferNet<16, npt::ReluConv, npt::PerVertex>());
}

TEST_CASE("fresh samples are learned, too") {
  using Net = npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>;
  const auto source = sampler(60);
  npt::TrainerOptions options;
  options.stages = {{.begin = 0, .batch = 16, .source = &source}};
  options.steps = 300;
  options.rate = npt::CosineRate{.rate = 3e-3};
  npt::Model<Net> model = initial_model<Net>();
  npt::Gradients<Net> gradients(1);
  npt::Trainer trainer(gradients, model.parameters(), model.buffer(), options);
  double first = 0, last = 0;
  while (!trainer.finished()) {
    const npt::StepReport report = trainer.step();
    if (report.step <= 10) first += report.pmd / 10;
    if (report.step > 290) last += report.pmd / 10;
  }
  MESSAGE("PMD of samples ", first, " -> ", last);
  CHECK(last < 0.35 * first);
}
