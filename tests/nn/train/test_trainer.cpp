#include <doctest/doctest.h>

#include <npt/nn/train/checkpoint.hpp>
#include <npt/nn/train/initialise.hpp>
#include <npt/nn/train/slices.hpp>
#include <npt/nn/train/trainer.hpp>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "nn/train/linear_core.hpp"

namespace {

using support::LinearCore;
using support::LinearSource;
using Buffer = npt::AlignedBuffer<float>;

const LinearSource few_vertices(6), many_vertices(40);

npt::TrainerOptions options(std::uint64_t steps) {
  npt::TrainerOptions o;
  o.stages = {{.begin = 0, .batch = 8, .source = &few_vertices}, {.begin = 0.7, .batch = 2, .source = &many_vertices}};
  o.steps = steps;
  o.rate = npt::CosineRate{.rate = 0.05};
  o.average = 0.9;
  o.clip = 1;
  return o;
}

Buffer initial(std::uint64_t seed = 3) {
  Buffer buffer(LinearCore::size);
  buffer[48] = 2;
  npt::initialise<float>(LinearCore::parameters(), buffer.span(), npt::Initialisation::small, seed);
  return buffer;
}

/// A LinearCore with a hidden matrix that the result doesn't depend on; its gradient is its value.
class MatrixCore : public LinearCore {
 public:
  static constexpr std::size_t size = LinearCore::size + 16;
  static std::vector<npt::NamedParameter> parameters() {
    std::vector<npt::NamedParameter> list = LinearCore::parameters();
    npt::Parameter matrix(4, 4, 1);
    matrix.offset = LinearCore::size;
    list.push_back({"hidden.weight", matrix});
    return list;
  }
  void load(std::span<const float> parameters) {
    LinearCore::load(parameters.first(LinearCore::size));
    matrix_.assign(parameters.begin() + LinearCore::size, parameters.end());
  }
  void backward(std::span<const std::span<const float>> result_gradients, std::span<float> gradient) {
    LinearCore::backward(result_gradients, gradient.first(LinearCore::size));
    std::ranges::copy(matrix_, gradient.begin() + LinearCore::size);
  }

 private:
  std::vector<float> matrix_;
};

struct MatrixRun {
  Buffer parameters{MatrixCore::size};
  MatrixCore core;
  npt::Trainer<MatrixCore> trainer;
  explicit MatrixRun(double matrix_rate) : trainer(core, MatrixCore::parameters(), filled(), with(matrix_rate)) {}

 private:
  std::span<float> filled() {
    for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i] = 0.1F + 0.01F * static_cast<float>(i * i % 7);
    return parameters.span();
  }
  static npt::TrainerOptions with(double matrix_rate) {
    npt::TrainerOptions o = options(10);
    o.matrix_rate = matrix_rate;
    return o;
  }
};

struct Run {
  Buffer parameters = initial();
  LinearCore core;
  npt::Trainer<LinearCore> trainer;
  explicit Run(npt::TrainerOptions o, int threads = 1)
      : core(threads), trainer(core, LinearCore::parameters(), parameters.span(), std::move(o)) {}
  void finish() {
    while (!trainer.finished()) trainer.step();
  }
};

bool equal(std::span<const float> a, std::span<const float> b) { return std::ranges::equal(a, b); }

template <class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const npt::Error& e) {
    return e.what();
  }
  return "no error";
}

/// Threads that wait for each other. Not std::barrier: where the system has no futex, libstdc++ 12 compares, then goes
/// to sleep without a lock over both, and misses wake-ups (mingw-w64 under wine: 7 of 24 runs of 20000 rounds stood
/// still, none of 24 with this).
class Barrier {
 public:
  explicit Barrier(int threads) : threads_(threads) {}
  void arrive_and_wait() {
    std::unique_lock lock(mutex_);
    const int round = round_;
    if (++arrived_ == threads_) {
      arrived_ = 0;
      ++round_;
      all_here_.notify_all();
    }
    all_here_.wait(lock, [&] { return round_ != round; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable all_here_;
  int threads_, arrived_ = 0, round_ = 0;
};

/// Processes of a group, played by threads.
struct Meeting {
  explicit Meeting(int n) : barrier(n), floats(static_cast<std::size_t>(n)), doubles(floats.size()) {}
  Barrier barrier;
  std::vector<std::span<float>> floats;
  std::vector<std::span<double>> doubles;
  double first = 0;
};

class Member final : public npt::TrainingGroup {
 public:
  Member(Meeting& meeting, int rank) : meeting_(meeting), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(meeting_.floats.size()); }
  void sum(std::span<float> values) const override { add(meeting_.floats, values); }
  void sum(std::span<double> values) const override { add(meeting_.doubles, values); }
  double of_first(double value) const override {
    if (rank_ == 0) meeting_.first = value;
    meeting_.barrier.arrive_and_wait();
    value = meeting_.first;
    meeting_.barrier.arrive_and_wait();
    return value;
  }

 private:
  template <class T>
  void add(std::vector<std::span<T>>& all, std::span<T> values) const {
    all[static_cast<std::size_t>(rank_)] = values;
    meeting_.barrier.arrive_and_wait();
    std::vector<T> sum(values.size());
    for (const auto& part : all)
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += part[i];
    meeting_.barrier.arrive_and_wait();
    std::ranges::copy(sum, values.begin());
    meeting_.barrier.arrive_and_wait();
  }
  Meeting& meeting_;
  int rank_;
};

}  // namespace

TEST_CASE("a trainer learns what can be learned, and reports what it did") {
  Run run(options(400));
  npt::StepReport first = run.trainer.step(), last;
  CHECK(first.step == 1);
  CHECK(first.progress == 0);
  CHECK(first.rate == 0);
  CHECK(first.batch == 8);
  CHECK(first.edge == 0);
  CHECK(first.loss == first.reconstruction);
  CHECK(std::abs(first.pmd - 3 * first.reconstruction / 4) < 1e-12);  // samples say 2 network units a unit
  while (!run.trainer.finished()) last = run.trainer.step();
  CHECK(last.step == 400);
  CHECK(last.batch == 2);
  CHECK(last.pmd < 1e-5 * first.pmd);
  CHECK(std::abs(run.parameters[1] - 0.5F) < 0.01F);
  CHECK(std::abs(run.trainer.weights()[1] - 0.5F) < 0.01F);
  CHECK(run.trainer.seconds() > 0);
  CHECK(last.seconds.whole >= last.seconds.data + last.seconds.forward);
}

TEST_CASE("attributes and padding are never touched") {
  Run run(options(30));
  run.finish();
  CHECK(run.parameters[48] == 2);
  CHECK(run.trainer.weights()[48] == 2);
  for (const std::size_t i : {9U, 15U, 31U, 35U, 63U}) CHECK(run.parameters[i] == 0);
}

TEST_CASE("any number of threads gives the same bits") {
  Run one(options(50), 1);
  one.finish();
#if NPT_HAS_TBB
  Run three(options(50), 3);
  three.finish();
  CHECK(equal(one.parameters.span(), three.parameters.span()));
  CHECK(equal(one.trainer.weights(), three.trainer.weights()));
#endif
}

TEST_CASE("stopped, written to a file, read and continued: the same bits as without a stop") {
  const auto path = std::filesystem::temp_directory_path() / "npt_test_trainer.checkpoint.safetensors";
  Run whole(options(40));
  whole.finish();
  for (const int stop : {0, 1, 13, 28, 39}) {
    CAPTURE(stop);
    Run before(options(40));
    for (int i = 0; i < stop; ++i) before.trainer.step();
    npt::save_checkpoint<float>(path, LinearCore::parameters(), before.trainer.checkpoint());
    Run after(options(40));
    after.trainer.step();  // whatever it did before is forgotten
    after.trainer.restore(npt::load_checkpoint<float>(path, LinearCore::parameters(), LinearCore::size), "file");
    CHECK(after.trainer.steps() == static_cast<std::uint64_t>(stop));
    CHECK(after.trainer.seconds() == before.trainer.seconds());
    after.finish();
    CHECK(equal(whole.parameters.span(), after.parameters.span()));
    CHECK(equal(whole.trainer.weights(), after.trainer.weights()));
  }
  std::filesystem::remove(path);
}

TEST_CASE("a checkpoint of another optimiser is refused") {
  MatrixRun muon(0.5), adam(0);
  for (int i = 0; i < 3; ++i) {
    muon.trainer.step();
    adam.trainer.step();
  }
  const std::string to_adam = error_of([&] { MatrixRun(0).trainer.restore(muon.trainer.checkpoint(), "x"); });
  const std::string to_muon = error_of([&] { MatrixRun(0.5).trainer.restore(adam.trainer.checkpoint(), "x"); });
  CHECK(to_adam.find("x: found Muon's momentum") == 0);
  CHECK(to_muon.find("x: found Adam's means") == 0);
  // The same optimiser with another rate goes on.
  CHECK_NOTHROW(MatrixRun(0.1).trainer.restore(muon.trainer.checkpoint()));
  CHECK_NOTHROW(MatrixRun(0).trainer.restore(adam.trainer.checkpoint()));
}

TEST_CASE("Muon's momentum has tensors of its own in a checkpoint, and a training goes on from it") {
  const auto path = std::filesystem::temp_directory_path() / "npt_test_trainer_muon.safetensors";
  MatrixRun whole(0.5), stopped(0.5), resumed(0.5);
  for (int i = 0; i < 3; ++i) whole.trainer.step(), stopped.trainer.step();
  npt::save_checkpoint<float>(path, MatrixCore::parameters(), stopped.trainer.checkpoint());
  const auto file = npt::SafetensorsFile::read(path);
  std::filesystem::remove(path);
  CHECK(file.find("muon.momentum.hidden.weight") != nullptr);
  CHECK(file.find("adam.mean.hidden.weight") == nullptr);
  CHECK(file.find("adam.square.hidden.weight") == nullptr);
  CHECK(file.find("muon.momentum.a.weight") == nullptr);
  CHECK(file.find("adam.square.a.weight") != nullptr);
  resumed.trainer.restore(npt::load_checkpoint<float>(file, MatrixCore::parameters(), MatrixCore::size));
  for (int i = 0; i < 2; ++i) whole.trainer.step(), resumed.trainer.step();
  for (const npt::Slice& s : npt::learned_slices(MatrixCore::parameters()))
    CHECK(equal(whole.parameters.span().subspan(s.first, s.size()),
                resumed.parameters.span().subspan(s.first, s.size())));
}

TEST_CASE("a training by the clock ends when its time is spent, whoever spent it") {
  npt::TrainerOptions o = options(0);
  o.seconds = 1000;
  Run run(o);
  run.trainer.step();
  CHECK(run.trainer.progress() < 0.1);
  CHECK(run.trainer.stage().batch == 8);
  run.trainer.spend(750);
  CHECK(run.trainer.progress() >= 0.75);
  CHECK(run.trainer.stage().batch == 2);
  run.trainer.spend(250);
  CHECK(run.trainer.finished());
  CHECK(run.trainer.progress() == 1);
}

TEST_CASE("a process's share of the batch: two train as one does, up to the order of sums") {
  Run one(options(40));
  std::vector<npt::StepReport> alone, together;
  while (!one.trainer.finished()) alone.push_back(one.trainer.step());
  Meeting meeting(2);
  std::unique_ptr<Run> runs[2];
  std::vector<std::thread> threads;
  for (int rank = 0; rank < 2; ++rank)
    threads.emplace_back([&, rank] {
      const Member member(meeting, rank);
      npt::TrainerOptions o = options(40);
      o.group = &member;
      auto& run = runs[rank];
      run = std::make_unique<Run>(o);
      while (!run->trainer.finished()) {
        const npt::StepReport report = run->trainer.step();
        if (rank == 0) together.push_back(report);
      }
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(equal(runs[0]->parameters.span(), runs[1]->parameters.span()));
  REQUIRE(alone.size() == together.size());
  for (std::size_t i = 0; i < alone.size(); ++i)
    CHECK(std::abs(alone[i].loss - together[i].loss) < 1e-4 * alone[0].loss);
  for (std::size_t i = 0; i < one.parameters.size(); ++i)
    CHECK(std::abs(one.parameters[i] - runs[0]->parameters[i]) < 1e-4F);
}

TEST_CASE("edge losses are added with their weight") {
  for (const npt::EdgeLoss edge : {npt::EdgeLoss::length, npt::EdgeLoss::relative}) {
    npt::TrainerOptions o = options(5);
    o.loss = {.scaling = npt::LossScaling::sum, .edge = edge, .edge_weight = 0.5};
    Run run(o);
    run.trainer.step();
    const npt::StepReport report = run.trainer.step();
    CHECK(report.edge > 0);
    CHECK(std::abs(report.loss - report.reconstruction - 0.5 * report.edge) < 1e-12);
    CHECK(std::abs(report.pmd - report.reconstruction / 6 / 4) < 1e-12);  // six vertices, scale 2
  }
}

TEST_CASE("a loss that is not finite ends the training before it spoils the weights") {
  npt::TrainerOptions o = options(100);
  o.rate = npt::ConstantRate{0.1};
  Run run(o);
  for (int i = 0; i < 3; ++i) run.trainer.step();
  const Buffer before = run.parameters;
  Buffer broken = run.parameters;
  broken[33] = std::numeric_limits<float>::quiet_NaN();
  run.core.load(broken.span());
  const std::string message = error_of([&] { run.trainer.step(); });
  CHECK(message.find("training: step 4: found a loss of") == 0);
  CHECK(equal(before.span(), run.parameters.span()));
  CHECK(run.trainer.steps() == 3);
}

TEST_CASE("options without sense are refused") {
  const auto refused = [](auto&& change, const char* what) {
    npt::TrainerOptions o = options(10);
    change(o);
    const std::string message = error_of([&] { Run run(o); });
    CAPTURE(message);
    CHECK(message.find(what) == 0);
  };
  refused([](auto& o) { o.seconds = 5; }, "length of the training");
  refused([](auto& o) { o.steps = 0; }, "length of the training");
  refused([](auto& o) { o.stages.clear(); }, "stages");
  refused([](auto& o) { o.stages[0].begin = 0.1; }, "stages");
  refused([](auto& o) { o.stages[1].begin = 0; }, "stages");
  refused([](auto& o) { o.stages[1].source = nullptr; }, "stages");
  refused([](auto& o) { o.stages[1].batch = 0; }, "batch");
  refused([](auto& o) { o.average = 1; }, "average");
  refused([](auto& o) { o.clip = -1; }, "clip");
  refused([](auto& o) { o.rate = nullptr; }, "rate");
  npt::TrainerOptions o = options(10);
  Run with(o);
  o.average = 0;
  Run without(o);
  CHECK(error_of([&] { with.trainer.restore(without.trainer.checkpoint(), "x"); }).find("x: found no moving average") ==
        0);
  CHECK(error_of([&] { without.trainer.restore(with.trainer.checkpoint(), "x"); }).find("x: found a moving") == 0);
}
