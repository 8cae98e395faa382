/// npt train: trains a network from body models or families of meshes, with checkpoints, a log and its plot.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "precision_option.hpp"
#include "progress.hpp"
#include "status_line.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"
#include "training_arguments.hpp"
#include "training_course.hpp"
#include "training_networks.hpp"

#include <render/png.hpp>
#include <training/group.hpp>
#include <training/log.hpp>

#include <npt/nn/train/checkpoint.hpp>
#include <npt/nn/train/initialise.hpp>
#include <npt/nn/train/trainer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace train_command {

namespace fs = std::filesystem;
using program::TrainingArguments;

/// The files of a training: W.safetensors and what lies beside it.
struct Files {
  fs::path weights, checkpoint, log, plot;

  explicit Files(const fs::path& out) : weights(out) {
    static constexpr std::array<std::string_view, 1> extension{".safetensors"};
    program::expect_extension(out, extension);
    const fs::path stem = out.parent_path() / out.stem();
    checkpoint = stem.string() + ".checkpoint.safetensors";
    log = stem.string() + ".log.csv";
    plot = stem.string() + ".log.png";
  }
};

/// Means over the steps between two rows of the log.
class Window {
 public:
  void add(const npt::StepReport& r) {
    ++steps_;
    row_.loss += r.loss;
    row_.reconstruction += r.reconstruction;
    row_.edge += r.edge;
    row_.pmd += r.pmd;
    row_.gradient_norm += r.gradient_norm;
    data_ += r.seconds.data;
    whole_ += r.seconds.whole;
    row_.rate = r.rate;
    row_.batch = r.batch;
    row_.vertices = r.vertices;
  }
  bool empty() const { return steps_ == 0; }
  double pmd() const { return row_.pmd / static_cast<double>(steps_); }
  double loss() const { return row_.loss / static_cast<double>(steps_); }
  double steps_per_second() const { return static_cast<double>(steps_) / whole_; }

  training::LogRow take() {
    training::LogRow row = row_;
    for (double* mean : {&row.loss, &row.reconstruction, &row.edge, &row.pmd, &row.gradient_norm})
      *mean /= static_cast<double>(steps_);
    row.data_share = data_ / whole_;
    *this = {};
    return row;
  }

 private:
  std::size_t steps_ = 0;
  double data_ = 0, whole_ = 0;
  training::LogRow row_;
};

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

/// A PMD in square metres as the paper's tables print it.
std::string pmd_text(double pmd) { return fixed(1e4 * pmd, 2) + "e-4"; }

class Training {
 public:
  Training(const TrainingArguments& arguments, const CLI::App& command, const npt::SafetensorsFile* checkpoint,
           std::unique_ptr<npt::TrainingGroup>& group)
      : arguments_(arguments),
        files_(arguments.out),
        group_(group),
        network_(*program::find_network(arguments.variant)),
        list_(*network_.parameters),
        course_(program::make_training_course(arguments, network_.program->paired)),
        parameters_(network_.buffer_size),
        options_(program::stored_options(command)) {
    options_["command"] = program::command_text(command);
    initialise();
    gradients_.emplace(program::find_trainable(arguments.variant)->gradients(arguments.threads));
    gradients_->set_precision(program::precision_from(arguments.precision));
    trainer_.emplace(*gradients_, list_, parameters_.span(), trainer_options());
    if (checkpoint != nullptr) restore(*checkpoint);
    if (first()) {
      program::check_output(files_.weights, {});
      program::check_output(files_.plot, {});
      validation_ = course_.validation(arguments.validation_pairs);
      log_.emplace(files_.log, checkpoint != nullptr ? std::optional(trainer_->steps()) : std::nullopt);
    }
  }

  void run() {
    program::catch_interrupts();
    const std::uint64_t begin = trainer_->steps();
    double progress = trainer_->progress();
    validations_ = validations_due(progress);
    if (first() && begin > 0) say("going on at step " + std::to_string(begin));
    bool stopped = false;
    while (progress < 1 && !stopped) {
      const npt::StepReport report = trainer_->step();
      window_.add(report);
      progress = trainer_->progress();
      stopped = agreed(program::interrupt_flag().load());
      if (first()) after_step(progress, stopped);
    }
    if (first()) finish(progress, stopped);
    group_.reset();  // waits for the first process, before an exception would end them all
    if (stopped) throw program::Interrupted();
  }

 private:
  bool first() const { return group_ == nullptr || group_->rank() == 0; }
  /// A decision of the first process, for all.
  bool agreed(bool decision) const { return group_ == nullptr ? decision : group_->of_first(decision ? 1 : 0) != 0; }

  void say(const std::string& text) {
    status_.clear();
    std::cout << text << std::endl;
  }

  void initialise() {
    for (const npt::NamedParameter& p : list_)
      if (p.parameter.attribute)
        parameters_[static_cast<std::size_t>(p.parameter.offset)] =
            static_cast<float>(p.name == "output_scale" ? arguments_.output_scale : p.parameter.initial);
    if (!arguments_.start || arguments_.resume)
      return npt::initialise<float>(list_, parameters_.span(), npt::parse_initialisation(arguments_.init, "--init"),
                                    arguments_.seed);
    const npt::SafetensorsFile file = npt::SafetensorsFile::read(*arguments_.start);
    // Weights of people hold the correspondence network beside the other.
    const npt::SafetensorsFile part = file.part("correspondence/");
    const bool joined = arguments_.variant.net == "correspondence" && !part.tensors().empty();
    npt::load_values(joined ? part : file, network_.variant, list_, parameters_.span());
  }

  npt::TrainerOptions trainer_options() const {
    const TrainingArguments& a = arguments_;
    npt::TrainerOptions o;
    o.stages = course_.stages;
    if (a.steps)
      o.steps = *a.steps;
    else
      o.seconds = 60 * a.minutes.value();
    const double rate = program::learning_rate(a);
    if (a.schedule == "constant")
      o.rate = npt::ConstantRate{rate};
    else
      o.rate = npt::CosineRate{.rate = rate, .warm_up = a.warm_up, .last = a.last_rate};
    o.adam = {.beta1 = a.beta1, .beta2 = a.beta2, .epsilon = a.epsilon};
    if (a.optimiser == "muon") o.matrix_rate = a.matrix_rate / rate;
    o.muon.momentum = a.matrix_momentum;
    o.muon.parts = std::min(1, npt::parts_of(gradients_->precision()));
    o.loss = {.distance = course_.distance_loss,
              .scaling = a.loss_scaling == "sum" ? npt::LossScaling::sum : npt::LossScaling::mean,
              .edge = a.edge_loss == "length"     ? npt::EdgeLoss::length
                      : a.edge_loss == "relative" ? npt::EdgeLoss::relative
                                                  : npt::EdgeLoss::none,
              .edge_weight = a.edge_weight};
    o.clip = a.clip;
    o.average = a.average;
    o.group = group_.get();
    return o;
  }

  void restore(const npt::SafetensorsFile& file) {
    const auto checkpoint = npt::load_checkpoint<float>(file, list_, parameters_.size());
    trainer_->restore(checkpoint, file.name());
    best_ = checkpoint.best_pmd;
    if (const auto command = checkpoint.options.find("command"); command != checkpoint.options.end())
      options_["command"] = command->second;
  }

  /// How many validations should have been made at this progress, where their number is what counts.
  static std::size_t validations_due(double progress) { return static_cast<std::size_t>(20 * progress + 1e-9); }

  void after_step(double progress, bool stopped) {
    const std::uint64_t step = trainer_->steps();
    bool validate = arguments_.validate_every > 0
                        ? step % arguments_.validate_every == 0
                        : validations_due(progress) > std::exchange(validations_, validations_due(progress));
    validate = (validate || progress >= 1) && !validation_.empty() && !stopped;
    if (validate || step % arguments_.log_every == 0) log(progress, validate);
    const bool due =
        arguments_.checkpoint_every > 0 ? step % arguments_.checkpoint_every == 0 : since_checkpoint_.seconds() > 60;
    if (due) save_checkpoint();
    if (status_.due()) status_.show(status(progress));
  }

  void log(double progress, bool validate) {
    const double rate = window_.steps_per_second();
    training::LogRow row = window_.take();
    row.step = trainer_->steps();
    row.progress = progress;
    if (validate) {
      const program::Stopwatch watch;
      row.validation_pmd = last_pmd_ = measure(validation_);
      best_ = std::min(best_, *row.validation_pmd);
      trainer_->spend(watch.seconds());
    }
    row.seconds = trainer_->seconds();
    log_->append(row);
    if (!validate) return;
    say("step " + std::to_string(row.step) + ", " + program::duration_text(row.seconds) + ", " +
        fixed(100 * progress, 0) + " %: PMD " + pmd_text(*row.validation_pmd) + " unseen, " + pmd_text(row.pmd) +
        " in training, " + fixed(rate, rate < 10 ? 2 : 0) + " steps/s");
  }

  std::string status(double progress) const {
    std::string text = "step " + std::to_string(trainer_->steps()) + ", " + fixed(100 * progress, 1) + " %";
    if (!window_.empty()) {
      char loss[32];
      std::snprintf(loss, sizeof loss, "%.3g", window_.loss());
      const double rate = window_.steps_per_second();
      text += std::string(", loss ") + loss + ", PMD " + pmd_text(window_.pmd()) + ", " +
              fixed(rate, rate < 10 ? 2 : 0) + " steps/s";
    }
    if (std::isfinite(last_pmd_)) text += ", unseen " + pmd_text(last_pmd_);
    if (progress > 0) text += ", " + program::duration_text(trainer_->seconds() * (1 / progress - 1)) + " left";
    return text;
  }

  /// Mean over all pairs of the sets, of the weights that would be written now.
  double measure(const std::vector<npt::EvaluationSet>& sets) const {
    const program::FloatEngine engine =
        network_.pack(trainer_->weights(), npt::DefaultExecutor(arguments_.threads), npt::Precision::automatic);
    const auto transfer = npt::normalised_transfer(
        [&engine](auto pose, auto identity, auto result) {
          engine({pose, identity}, result);
        },
        course_.normalisation);
    double sum = 0;
    std::size_t count = 0;
    for (const npt::EvaluationSet& set : sets) {
      sum += npt::evaluate(set, transfer).pmd() * static_cast<double>(set.count);
      count += set.count;
    }
    return sum / static_cast<double>(count);
  }

  void save_checkpoint() {
    npt::Checkpoint<float> checkpoint = trainer_->checkpoint();
    checkpoint.best_pmd = best_;
    checkpoint.options = options_;
    npt::save_checkpoint<float>(files_.checkpoint, list_, checkpoint);
    since_checkpoint_ = {};
  }

  void save_weights(std::optional<double> pmd, std::size_t pairs) const {
    npt::Metadata metadata{{"normalisation", to_string(course_.normalisation)},
                           {"trained_on", course_.trained_on},
                           {"unit", course_.unit},
                           {"command", options_.at("command")},
                           {"seed", std::to_string(arguments_.seed)},
                           {"steps", std::to_string(trainer_->steps())}};
    if (course_.with_negatives) metadata["negatives"] = "yes";
    if (!arguments_.domain.empty()) metadata["domain"] = arguments_.domain;
    // A training by steps ends with the same bytes, however long it took.
    if (!arguments_.steps) metadata["training_seconds"] = fixed(trainer_->seconds(), 0);
    if (pmd) {
      metadata["pmd"] = npt::number_text(*pmd);
      metadata["pmd_on"] = std::to_string(pairs) + " pairs of " + course_.validated_on +
                           "; eq. 7, bounding boxes centred, squares of the unit";
    }
    npt::save_values<float>(files_.weights, network_.variant, list_, trainer_->weights(), metadata);
  }

  /// What every run ends with: checkpoint, weights and plot.
  void finish(double progress, bool stopped) {
    status_.clear();
    if (stopped && !window_.empty()) log(progress, false);
    save_checkpoint();
    std::optional<double> pmd;
    std::size_t pairs = 0;
    if (arguments_.validation_pairs > 0 && !stopped) {
      const auto sets = course_.validation(4 * arguments_.validation_pairs);
      for (const npt::EvaluationSet& set : sets) pairs += set.count;
      if (pairs > 0) pmd = measure(sets);
    }
    save_weights(pmd, pairs);
    const auto rows = training::read_log(files_.log);
    render::write_png(files_.plot,
                      training::plot_log(rows, npt::variant_name(network_.variant) + ", " + course_.trained_on));
    std::string text = files_.weights.string() + ": " + npt::variant_name(network_.variant) + ", " +
                       std::to_string(trainer_->steps()) + " steps in " + program::duration_text(trainer_->seconds());
    if (pmd)
      text += ", PMD " + pmd_text(*pmd) + " (" + fixed(npt::root_pmd_mm(*pmd), 1) + " mm) on " + std::to_string(pairs) +
              " unseen pairs";
    say(text);
    if (stopped) say("stopped; npt train --resume --out " + files_.weights.string() + " goes on from here");
  }

  const TrainingArguments& arguments_;
  Files files_;
  std::unique_ptr<npt::TrainingGroup>& group_;  ///< nothing: alone
  const program::NetworkType& network_;
  std::vector<npt::NamedParameter> list_;
  program::TrainingCourse course_;
  npt::AlignedBuffer<float> parameters_;
  npt::Metadata options_;
  std::optional<program::FloatGradients> gradients_;
  std::optional<npt::Trainer<program::FloatGradients>> trainer_;

  std::vector<npt::EvaluationSet> validation_;
  std::optional<training::Log> log_;
  Window window_;
  program::StatusLine status_;
  std::size_t validations_ = 0;
  double best_ = std::numeric_limits<double>::infinity(), last_pmd_ = best_;
  program::Stopwatch since_checkpoint_;
};

void run(TrainingArguments& arguments, CLI::App& command) {
  const Files files(arguments.out);
  std::optional<npt::SafetensorsFile> checkpoint;
  if (arguments.resume) {
    checkpoint = npt::SafetensorsFile::read(files.checkpoint);
    program::restore_options(command, npt::checkpoint_options(*checkpoint), checkpoint->name());
  } else if (!arguments.overwrite && fs::exists(files.checkpoint)) {
    throw npt::Error({files.checkpoint.string(),
                      {},
                      "the checkpoint of an earlier training",
                      "--resume to go on with it, --overwrite to begin anew, or another --out"});
  }
  if (!arguments.steps && !arguments.minutes) throw CLI::RequiredError("--minutes or --steps");
  if (CLI::Option* feature = command.get_option("--feature");
      arguments.variant.net != "full" && arguments.variant.net != "correspondence" && feature->count() == 0) {
    feature->add_result("per-vertex");  // which is not the default, but what there is of the ablations
    feature->run_callback();
  }
  if (program::find_network(arguments.variant) == nullptr)
    throw npt::Error({"--net " + arguments.variant.net,
                      {},
                      arguments.variant.order + ", " + arguments.variant.feature,
                      "conv_relu and per-vertex, in which the ablations are compiled"});
  std::unique_ptr<npt::TrainingGroup> group = training::join_group();
  const std::string process = group ? "npt: process " + std::to_string(group->rank()) + ": " : "";
  try {
    Training(arguments, command, checkpoint ? &*checkpoint : nullptr, group).run();
  } catch (const program::Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    // Leaving ends the others, and none of them may come to print anything.
    if (group) std::cerr << process << error.what() << std::endl;
    throw;
  }
}

void add(CLI::App& command) {
  auto arguments = std::make_shared<TrainingArguments>();
  program::add_training_options(command, *arguments);
  command.callback([arguments, &command] { run(*arguments, command); });
}

const program::Subcommand registered("train", "Train a network on bodies, rigged characters or families of meshes",
                                     add);

}  // namespace train_command
