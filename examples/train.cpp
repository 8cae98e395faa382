// A training loop of one's own on the headers: data, network, gradients, trainer, and what comes out of it.
//
//   train [--body FILE] [--seconds S] [--out FILE] [--threads N]
//
// `npt train` does the same with options for everything, checkpoints, validation and a log. Here is what a host needs
// that has its own idea of when to stop, what to show and where to keep things.
#include <npt/body/body_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/lab/body_sampler.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/train/gradients.hpp>
#include <npt/nn/train/initialise.hpp>
#include <npt/nn/train/trainer.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

namespace {

// The network is a type. The pooled feature learns fastest, and takes meshes of any vertex counts.
using Net = npt::PoseTransferNet<64, npt::ConvRelu, npt::Pooled>;

struct Arguments {
  std::optional<std::filesystem::path> body;
  std::filesystem::path out = "train.safetensors";
  double seconds = 20;
  int threads = 0;
};

/// PMD on eight pairs of shapes and poses that no training ever shows, at full resolution, in square metres.
double unseen_pmd(const npt::Model<Net>& model, const std::shared_ptr<const npt::BodyModel>& body, int threads) {
  const npt::Engine engine(model, threads);
  const auto pairs = npt::body_pairs(body, npt::fresh_pairs(8, 1, body->shape_count()), "unseen");
  const auto transfer = npt::normalised_transfer(
      [&engine](auto pose, auto identity, auto result) {
        engine({pose, identity}, result);
      },
      npt::Normalisation::centre);
  return npt::evaluate(pairs, transfer).pmd();
}

void run(const Arguments& arguments) {
  // 1. Where samples come from: a body model, in a new shape and pose each time; 120 random vertices of each mesh are
  // enough to
  //    learn from, and let a step hold many meshes.
  const std::shared_ptr<const npt::BodyModel> body =
      arguments.body ? std::make_shared<const npt::BodyModel>(npt::load_body(*arguments.body))
                     : npt::borrowed(npt::mannequin());
  npt::BodySamplerOptions data;
  data.seed = 1;
  data.vertices = 120;
  const npt::BodySampler samples(body, data);

  // 2. The network's values, and its gradients.
  npt::Model<Net> model;
  npt::initialise<float>(model.parameters(), model.buffer(), npt::Initialisation::small, 1);
  npt::Gradients<Net> gradients(arguments.threads);

  // 3. The course: 48 meshes a step, a rate that rises, falls and is nearly zero when the time is over.
  npt::TrainerOptions options;
  options.stages = {{.begin = 0, .batch = 48, .source = &samples}};
  options.seconds = arguments.seconds;
  options.rate = npt::CosineRate{.rate = 3e-3};
  options.clip = 1;
  npt::Trainer trainer(gradients, model.parameters(), model.buffer(), options);

  std::printf("%zu vertices in the body, %.0f s of training.\n", body->vertex_count(), arguments.seconds);
  std::printf("before: %6.1f cm root mean square error on unseen shapes and poses\n",
              100 * std::sqrt(unseen_pmd(model, body, arguments.threads)));

  // 4. The loop. Each step says what it did; the host may look, save, or leave at any time.
  double mean = 0;
  int steps = 0, tenths = 0;
  while (!trainer.finished()) {
    const npt::StepReport report = trainer.step();
    mean += report.pmd;
    ++steps;
    if (trainer.progress() * 10 < tenths + 1) continue;
    tenths = static_cast<int>(trainer.progress() * 10);
    std::printf("step %5llu: %6.1f cm on the last %d batches, rate %.1e, %2.0f %% of the time for making samples\n",
                static_cast<unsigned long long>(report.step), 100 * std::sqrt(mean / steps), steps, report.rate,
                100 * report.seconds.data / report.seconds.whole);
    mean = 0;
    steps = 0;
  }

  // 5. What it learned. The metadata say how meshes were normalised, which `npt transfer --weights` reads.
  std::printf("after:  %6.1f cm on unseen shapes and poses\n",
              100 * std::sqrt(unseen_pmd(model, body, arguments.threads)));
  npt::save(model, arguments.out, {{"normalisation", "centre"}, {"unit", "metre"}});
  std::printf("Wrote %s after %llu steps.\n", arguments.out.string().c_str(),
              static_cast<unsigned long long>(trainer.steps()));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A training loop of one's own: data, network, gradients, trainer");
  Arguments arguments;
  app.add_option("--body", arguments.body, "Body model (.safetensors); without: the built-in mannequin");
  app.add_option("--seconds", arguments.seconds, "Of training")->check(CLI::Range(0.1, 1e6))->capture_default_str();
  app.add_option("--out", arguments.out, "Weights file to write")->capture_default_str();
  app.add_option("--threads", arguments.threads, "0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(arguments);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "train: %s\n", e.what());
    return 1;
  }
}
