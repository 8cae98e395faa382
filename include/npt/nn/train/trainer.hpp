/// The training loop's body: one call is one step of a training. It knows the network only through its gradients and
/// the list of its parameters, so that it compiles once, however many networks a program trains.
///   npt::Model<Net> model;
///   npt::initialise<float>(model.parameters(), model.buffer(), npt::Initialisation::small, seed);
///   npt::Gradients<Net> gradients;
///   npt::Trainer trainer(gradients, model.parameters(), model.buffer(), options);
///   while (!trainer.finished()) trainer.step();
/// A step: samples, forward, losses, backward, clipping, Adam (and Muon) with the schedule's rate, moving average.
/// Numerics  The batch's loss is the mean over its meshes, in the network's units. Samples depend on (seed, step,
///           index) only and every sum has a fixed order: the weights are the same bits for any number of threads. With
///           TrainerOptions::steps a training that was stopped and restored ends with the same bits as one that was
///           not; with TrainerOptions::seconds the rate follows the clock, and no two runs are equal.
/// Errors    npt::Error for options without sense, and for a loss or gradient that is not finite: it names the step,
///           and the weights are still those before it.
/// Source    Wang et al., CVPR 2020, section 4.1 (Adam at 5e-5, batch 8, L = reconstruction + 5e-4 edges)
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/tape/gradient_core.hpp>
#include <npt/nn/train/adam.hpp>
#include <npt/nn/train/checkpoint.hpp>
#include <npt/nn/train/clip.hpp>
#include <npt/nn/train/group.hpp>
#include <npt/nn/train/losses.hpp>
#include <npt/nn/train/moving_average.hpp>
#include <npt/nn/train/muon.hpp>
#include <npt/nn/train/sample.hpp>
#include <npt/nn/train/schedule.hpp>
#include <npt/nn/train/slices.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

enum class EdgeLoss { none, length, relative };

struct LossOptions {
  double distance = 0;  ///< above 0: the mean distance in place of the squares, turning quadratic there; network units
  LossScaling scaling = LossScaling::mean;  ///< of the reconstruction and of the edge lengths
  EdgeLoss edge = EdgeLoss::none;           ///< takes effect on whole meshes only: a subset of vertices has no edges
  double edge_weight = paper_edge_weight;
};

/// A part of the training with batches of its own. `source` must outlive the trainer.
struct TrainingStage {
  double begin = 0;  ///< progress, 0 .. 1, from which on it holds
  std::size_t batch = 8;
  const SampleSource* source = nullptr;
};

struct TrainerOptions {
  std::vector<TrainingStage> stages;  ///< by ascending begin, the first at 0
  std::uint64_t steps = 0;            ///< length of the training; or
  double seconds = 0;                 ///< length in time that is spent on it, over all its runs
  /// Learning rate at a progress of 0 .. 1: ConstantRate, CosineRate, or the host's own.
  std::function<double(double)> rate = ConstantRate{paper_learning_rate};
  AdamOptions adam{};
  /// Rate of Muon on the hidden matrices, relative to that of Adam on the rest; 0: Adam on everything.
  double matrix_rate = 0;
  MuonOptions muon{};
  LossOptions loss{};
  double clip = 0;                       ///< longest gradient; 0: any
  double average = 0;                    ///< decay of the moving average of the weights; 0: none is kept
  const TrainingGroup* group = nullptr;  ///< processes that share the batches; must outlive the trainer
};

/// What a step did. Losses are those of the weights before it.
struct StepReport {
  std::uint64_t step = 0;     ///< counted from 1
  double progress = 0;        ///< before the step
  double loss = 0;            ///< reconstruction + edge_weight * edge
  double reconstruction = 0;  ///< mean over the batch's meshes, as LossOptions::scaling says
  double edge = 0;            ///< likewise, not weighted
  double pmd = 0;             ///< mean over the batch of the squared distance a vertex, in squares of the meshes' unit
  double gradient_norm = 0;   ///< before clipping
  double rate = 0;
  std::size_t batch = 0, vertices = 0;  ///< meshes in the step, the most vertices of a result
  struct {
    double data = 0, forward = 0, loss = 0, backward = 0, optimise = 0, whole = 0;
  } seconds;
};

/// `Core`: Gradients<Net>, or the tape::GradientCore that it is behind the network's type.
template <class Core>
class Trainer {
 public:
  /// `gradients` and `parameters` (a model's buffer, which the steps change) must outlive the trainer.
  Trainer(Core& gradients, std::span<const NamedParameter> list, std::span<float> parameters, TrainerOptions options)
      : gradients_(gradients),
        list_(list.begin(), list.end()),
        slices_(learned_slices(list_)),
        parameters_(parameters),
        options_(std::move(options)),
        adam_(parameters.size(), options_.adam),
        gradient_(parameters.size()) {
    check_options();
    if (options_.matrix_rate > 0) {
      muon_.emplace(list_, options_.muon);
      if (!muon_->matrices().empty()) momentum_ = AlignedBuffer<float>(parameters.size());
    }
    std::vector<NamedParameter> others;
    std::ranges::copy_if(list_, std::back_inserter(others),
                         [this](const NamedParameter& p) { return !muon_ || !is_hidden_matrix(p.parameter); });
    adam_slices_ = learned_slices(others);
    if (options_.average > 0) average_.emplace(parameters, options_.average);
    gradients_.load(parameters_);
  }

  StepReport step() {
    const Clock clock;
    StepReport report;
    report.progress = progress();
    const TrainingStage& stage = stage_at(report.progress);
    report.batch = stage.batch;
    report.vertices = stage.source->max_vertices();
    report.rate = options_.rate(report.progress);
    draw(stage);
    report.seconds.data = clock.lap();
    gradients_.forward(calls_);
    report.seconds.forward = clock.lap();
    losses(stage.batch, report);
    report.seconds.loss = clock.lap();
    gradients_.backward(result_gradients_, gradient_.span());
    if (options_.group != nullptr) options_.group->sum(gradient_.span());
    report.seconds.backward = clock.lap();
    report.gradient_norm =
        npt::gradient_norm(std::span<const float>(gradient_.span()), slices_, gradients_.executor(), partial_);
    report.step = step_ + 1;
    expect_finite(report);
    optimise(report);
    report.seconds.optimise = clock.lap();
    report.seconds.whole = clock.total();
    ++step_;
    seconds_ += report.seconds.whole;
    return report;
  }

  std::uint64_t steps() const { return step_; }
  /// Training time over all runs: that of the steps, and what was added.
  double seconds() const { return seconds_; }
  /// Counts time that belongs to the training without being a step's: validation, checkpoints.
  void spend(double seconds) { seconds_ += seconds; }

  /// The part of the training that is done. In a group all processes ask together, as for finished() and stage().
  double progress() const {
    const double done = options_.steps > 0 ? static_cast<double>(step_) / static_cast<double>(options_.steps)
                                           : seconds_ / options_.seconds;
    return std::min(1.0, options_.group != nullptr ? options_.group->of_first(done) : done);
  }
  bool finished() const { return progress() >= 1; }
  const TrainingStage& stage() const { return stage_at(progress()); }
  const TrainerOptions& options() const { return options_; }

  /// The weights to use: the moving average where one is kept.
  std::span<const float> weights() const { return average_ ? std::as_const(*average_).values() : parameters_; }

  /// Everything that a later run needs; `best_pmd` and `options` are the owner's to fill in.
  Checkpoint<float> checkpoint() const {
    Checkpoint<float> c;
    c.parameters = copy_of(parameters_);
    c.mean = copy_of(adam_.mean());
    c.square = copy_of(adam_.square());
    c.momentum = copy_of(momentum_.span());
    if (average_) c.average = copy_of(std::as_const(*average_).values());
    c.step = step_;
    c.seconds = seconds_;
    return c;
  }

  /// Goes on from a checkpoint of a trainer for the same network. `name` stands in the message of an error.
  /// Errors  npt::Error for one of another network, for one with a moving average where none is kept and the reverse,
  ///         and for one of Adam on all parameters where Muon takes the matrices and the reverse
  void restore(const Checkpoint<float>& c, const std::string& name = "checkpoint") {
    if (c.parameters.size() != parameters_.size() || c.mean.size() != parameters_.size() ||
        c.square.size() != parameters_.size() || (!c.momentum.empty() && c.momentum.size() != parameters_.size()))
      throw Error({.file = name,
                   .found = std::to_string(c.parameters.size()) + " numbers",
                   .expected = std::to_string(parameters_.size()) + ", those of this network"});
    if (average_.has_value() == c.average.empty())
      throw Error({.file = name,
                   .found = c.average.empty() ? "no moving average" : "a moving average of the weights",
                   .expected = average_ ? "one, which this training keeps" : "none, which this training doesn't keep"});
    if (momentum_.empty() != c.momentum.empty())
      throw Error({.file = name,
                   .found = c.momentum.empty() ? "Adam's means of the hidden matrices"
                                               : "Muon's momentum of the hidden matrices",
                   .expected = c.momentum.empty() ? "Muon's momentum, since this training has a matrix rate"
                                                  : "Adam's means, since this training has a matrix rate of 0"});
    std::ranges::copy(c.parameters.span(), parameters_.begin());
    std::ranges::copy(c.mean.span(), adam_.mean().begin());
    std::ranges::copy(c.square.span(), adam_.square().begin());
    std::ranges::copy(c.momentum.span(), momentum_.span().begin());
    adam_.set_steps(c.step);
    if (average_) {
      std::ranges::copy(c.average.span(), average_->values().begin());
      average_->set_steps(c.step);
    }
    step_ = c.step;
    seconds_ = c.seconds;
    gradients_.load(parameters_);
  }

 private:
  class Clock {
   public:
    double lap() const {
      const auto now = std::chrono::steady_clock::now();
      return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
    }
    double total() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

   private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    mutable std::chrono::steady_clock::time_point last_ = start_;
  };

  /// Sums over a batch.
  struct Losses {
    double reconstruction = 0, edge = 0, pmd = 0;
  };

  static AlignedBuffer<float> copy_of(std::span<const float> values) {
    AlignedBuffer<float> copy(values.size());
    std::ranges::copy(values, copy.span().begin());
    return copy;
  }

  void check_options() const {
    const auto refuse = [](const char* what, std::string found, const char* expected) {
      throw Error({.file = what, .found = std::move(found), .expected = expected});
    };
    const auto& o = options_;
    if ((o.steps > 0) == (o.seconds > 0)) refuse("length of the training", "steps and seconds", "one of them above 0");
    if (!o.rate) refuse("rate", "nothing", "a function");
    if (o.stages.empty() || o.stages.front().begin != 0) refuse("stages", "none that begins at 0", "one");
    for (std::size_t i = 0; i < o.stages.size(); ++i) {
      const TrainingStage& s = o.stages[i];
      if (s.source == nullptr) refuse("stages", "no source of samples", "one for each stage");
      if (s.batch == 0) refuse("batch", "0", "at least 1");
      if (o.group != nullptr && s.batch % static_cast<std::size_t>(o.group->size()) != 0)
        refuse("batch", std::to_string(s.batch), "a multiple of the number of processes");
      if (i > 0 && !(s.begin > o.stages[i - 1].begin && s.begin < 1))
        refuse("stages", "a begin of " + std::to_string(s.begin), "ascending numbers below 1");
    }
    if (!(o.average >= 0 && o.average < 1)) refuse("average", std::to_string(o.average), "0, or a decay below 1");
    if (!(o.matrix_rate >= 0 && std::isfinite(o.matrix_rate)))
      refuse("matrix rate", std::to_string(o.matrix_rate), "0, or a factor");
    if (!(o.clip >= 0)) refuse("clip", std::to_string(o.clip), "0, or a length");
  }

  const TrainingStage& stage_at(double progress) const {
    const TrainingStage* stage = &options_.stages.front();
    for (const TrainingStage& s : options_.stages)
      if (s.begin <= progress) stage = &s;
    return *stage;
  }

  /// This process's share of the batch.
  void draw(const TrainingStage& stage) {
    const auto processes = static_cast<std::size_t>(options_.group != nullptr ? options_.group->size() : 1);
    const auto rank = static_cast<std::size_t>(options_.group != nullptr ? options_.group->rank() : 0);
    const std::size_t count = stage.batch / processes;
    samples_.resize(count);
    results_.resize(count);
    gradients_of_results_.resize(count);
    gradients_.executor().for_each(static_cast<int>(count), [&](int i, int) {
      const auto k = static_cast<std::size_t>(i);
      stage.source->fill(step_, rank * count + k, samples_[k]);
      results_[k].resize(samples_[k].truth.size());
    });
    calls_.clear();
    result_gradients_.clear();
    for (std::size_t k = 0; k < count; ++k) {
      NetworkCall<float>& call = calls_.emplace_back();
      for (const std::vector<float>& input : samples_[k].inputs) call.inputs.push_back(input);
      call.result = results_[k];
    }
  }

  void losses(std::size_t batch, StepReport& report) {
    const LossOptions& o = options_.loss;
    const double weight = 1.0 / static_cast<double>(batch);
    losses_.assign(samples_.size(), {});
    gradients_.executor().for_each(static_cast<int>(samples_.size()), [&](int i, int) {
      const auto k = static_cast<std::size_t>(i);
      const Sample& sample = samples_[k];
      std::vector<float>& gradient = gradients_of_results_[k];
      gradient.assign(results_[k].size(), 0.0F);
      Losses& sum = losses_[k];
      if (o.distance > 0) {
        sum.reconstruction = distance_loss<float>(results_[k], sample.truth, o.distance, weight, gradient);
        sum.pmd = sum.reconstruction * sum.reconstruction / (sample.scale * sample.scale);
      } else {
        sum.reconstruction = reconstruction_loss<float>(results_[k], sample.truth, o.scaling, weight, gradient);
        const double coordinates = static_cast<double>(results_[k].size());
        sum.pmd =
            sum.reconstruction * (o.scaling == LossScaling::mean ? 3 : 3 / coordinates) / (sample.scale * sample.scale);
      }
      if (o.edge == EdgeLoss::length)
        sum.edge = edge_length_loss<float>(results_[k], sample.edges, o.scaling, weight * o.edge_weight, gradient);
      if (o.edge == EdgeLoss::relative && sample.reference >= 0)
        sum.edge = relative_edge_loss<float>(results_[k], sample.inputs[static_cast<std::size_t>(sample.reference)],
                                             sample.triangles, weight * o.edge_weight, gradient);
    });
    for (const std::vector<float>& gradient : gradients_of_results_) result_gradients_.emplace_back(gradient);
    std::array<double, 3> sums{};
    for (const Losses& l : losses_) {
      sums[0] += l.reconstruction;
      sums[1] += l.edge;
      sums[2] += l.pmd;
    }
    if (options_.group != nullptr) options_.group->sum(sums);
    report.reconstruction = sums[0] * weight;
    report.edge = sums[1] * weight;
    report.pmd = sums[2] * weight;
    report.loss = report.reconstruction + (o.edge == EdgeLoss::none ? 0 : o.edge_weight * report.edge);
  }

  static void expect_finite(const StepReport& report) {
    if (std::isfinite(report.loss) && std::isfinite(report.gradient_norm) && std::isfinite(report.rate)) return;
    throw Error({.file = "training",
                 .place = "step " + std::to_string(report.step),
                 .found = "a loss of " + std::to_string(report.loss) + ", a gradient of length " +
                          std::to_string(report.gradient_norm) + " and a rate of " + std::to_string(report.rate),
                 .expected = "finite numbers: a lower rate, a longer warm-up or clipping keeps a training stable"});
  }

  void optimise(const StepReport& report) {
    const double factor = clip_factor(report.gradient_norm, options_.clip);
    const auto& executor = gradients_.executor();
    adam_.begin_step(report.rate);
    executor.for_each(static_cast<int>(adam_slices_.size()), [&](int i, int) {
      const Slice& s = adam_slices_[static_cast<std::size_t>(i)];
      adam_.update(parameters_, gradient_.span(), s.first, s.last, factor);
    });
    if (muon_)
      muon_->step(parameters_, gradient_.span(), momentum_.span(), options_.matrix_rate * report.rate, factor,
                  executor);
    if (average_) {
      average_->begin_step();
      executor.for_each(static_cast<int>(slices_.size()), [&](int i, int) {
        const Slice& s = slices_[static_cast<std::size_t>(i)];
        average_->update(parameters_, s.first, s.last);
      });
    }
    gradients_.load(parameters_);
  }

  Core& gradients_;
  std::vector<NamedParameter> list_;
  std::vector<Slice> slices_;
  std::span<float> parameters_;
  TrainerOptions options_;
  Adam<float> adam_;
  std::vector<Slice> adam_slices_;
  std::optional<Muon<float>> muon_;
  AlignedBuffer<float> momentum_;  ///< Muon's, laid out as the parameters; empty without it
  std::optional<MovingAverage<float>> average_;
  AlignedBuffer<float> gradient_;
  std::uint64_t step_ = 0;
  double seconds_ = 0;

  // Memory that steps use again.
  std::vector<Sample> samples_;
  std::vector<std::vector<float>> results_, gradients_of_results_;
  std::vector<NetworkCall<float>> calls_;
  std::vector<std::span<const float>> result_gradients_;
  std::vector<Losses> losses_;
  std::vector<double> partial_;
};

#ifdef NPT_COMPILED
extern template class Trainer<tape::GradientCore<float, DefaultExecutor>>;
#endif

}  // namespace npt::inline NPT_ABI
