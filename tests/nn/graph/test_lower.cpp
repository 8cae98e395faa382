#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/graph/inputs.hpp>
#include <npt/nn/graph/lower.hpp>

namespace graph = npt::graph;
using graph::Storage;

namespace {

template <class Net>
constexpr const graph::Program& program = graph::program_of<Net>;

/// Stages that follow one another in a sweep.
constexpr int stages_in_sweep(const graph::Program& p, int sweep) { return p.sweep(sweep).stage_count; }

constexpr int count_storage(const graph::Program& p, Storage storage) {
  int n = 0;
  for (int t = 0; t < p.activation_count; ++t) n += p.activation(t).storage == storage ? 1 : 0;
  return n;
}

}  // namespace

TEST_CASE("the paper's network lowers to 16 stages in 10 sweeps with two feature maps, at compile time") {
  constexpr const graph::Program& p = program<npt::PoseTransferNet<>>;
  static_assert(p.stage_count == 16);
  static_assert(p.sweep_count == 10);
  static_assert(p.encoder_sweeps == 3);
  static_assert(p.multiply_adds == 6035762);  // docs/performance.md counts the same by hand
  static_assert(p.paired);
  static_assert(p.code_count == 1);
  // h and the residual unit's output; the code takes the place of h when nobody else needs it.
  static_assert(p.buffer_count == 2);
  static_assert(p.code_alias >= 0);
  static_assert(p.scratch_count == 2);
  CHECK(p.activation(p.output).channels == 3);
}

TEST_CASE("a block's second half and the next convolution run in one sweep, without a feature map in between") {
  constexpr const graph::Program& p = program<npt::PoseTransferNet<>>;
  static_assert(stages_in_sweep(p, 5) == 3);
  constexpr int first = p.sweep(5).first_stage;
  CHECK(p.activation(p.stage(first).output).storage == Storage::scratch);
  CHECK(p.activation(p.stage(first + 1).output).storage == Storage::scratch);
  CHECK(p.stage(first + 2).direct);  // reads the sum as it lies
  // The sum rides in the skip branch's epilogue: relu, then add.
  CHECK(p.stage(first + 1).epilogue.count == 2);
  CHECK(p.stage(first + 1).epilogue.steps[1].other == p.stage(first).output);
}

TEST_CASE("biases that only reach an instance norm are dead") {
  const auto dead = [](const graph::Program& p) {
    int rows = 0;
    for (int i = 0; i < p.stage_count; ++i) rows += p.stage(i).bias_is_dead ? p.stage(i).rows : 0;
    return rows;
  };
  CHECK(dead(program<npt::PoseTransferNet<>>) == 64 + 128 + 1024 + 1027 + 513 + 256);
  CHECK(dead(program<npt::PoseTransferNet<1024, npt::ReluConv>>) == 64 + 128 + 1024 + 2 * (1027 + 513 + 256));
}

TEST_CASE("in the released order the sum of two convolutions and the one behind it fold into one") {
  constexpr const graph::Program& p = program<npt::PoseTransferNet<1024, npt::ReluConv>>;
  static_assert(p.stage_count == 10);
  static_assert(p.multiply_adds == 6035762);  // the plain algorithm's, as ever
  double work = 0;
  for (int i = 0; i < p.stage_count; ++i) work += static_cast<double>(p.stage(i).rows) * p.stage(i).columns;
  CHECK(work < 0.66 * p.multiply_adds);
  constexpr graph::Program plain =
      graph::lower(graph::record(graph::bound_network<npt::PoseTransferNet<1024, npt::ReluConv>>), {.fold = false});
  static_assert(plain.stage_count == 16);
  // The paper's order has an activation in between: nothing folds.
  static_assert(program<npt::PoseTransferNet<>>.stage_count == 16);
}

TEST_CASE("the pooled feature needs no pairing, stores no encoder output, and merges its first block into one sweep") {
  constexpr const graph::Program& p = program<npt::PoseTransferNet<1024, npt::ConvRelu, npt::Pooled>>;
  static_assert(!p.paired);
  static_assert(p.code_count == 0);
  static_assert(count_storage(p, Storage::none) == 1);
  static_assert(count_storage(p, Storage::pooled) == 1);
  static_assert(p.sweep_count == 8);
  static_assert(stages_in_sweep(p, 3) == 5);
  CHECK(p.stage(2).gathers_maxima);
}

TEST_CASE("widths follow the bottleneck by integer division") {
  constexpr const graph::Program& p = program<npt::PoseTransferNet<61>>;
  CHECK(p.stage(3).rows == 64);
  CHECK(p.stage(7).rows == 32);
  CHECK(p.stage(11).rows == 16);
}

namespace {

/// An expression used three times.
struct SharedNet {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, 8> a;
  npt::Conv1x1<8, 8> b, c;
  npt::Conv1x1<8, 3> last;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("c", self.c);
    visitor("last", self.last);
  }
  constexpr auto operator()(auto points) const {
    const auto x = points | a | npt::relu;
    return (x + (x | b | npt::relu) + (x | c)) | last;
  }
};

/// A layer that is conditioned on a hidden tensor, in an epilogue.
struct ConditionedNet {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, 5> b;
  npt::Conv1x1<3, 16> a;
  npt::SPAdaIN<16, 5, npt::Norm::none> s;
  npt::Conv1x1<16, 3> last;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("b", self.b);
    visitor("a", self.a);
    visitor("s", self.s);
    visitor("last", self.last);
  }
  constexpr auto operator()(auto points) const {
    const auto condition = points | b | npt::tanh;
    return s(points | a, condition) | last;
  }
};

}  // namespace

TEST_CASE("an expression that is used several times is computed once") {
  constexpr const graph::Program& p = program<SharedNet>;
  static_assert(p.stage_count == 4);
  static_assert(p.sweep_count == 1);  // nothing needs moments: one sweep, no barrier
  static_assert(count_storage(p, Storage::buffer) == 0);
  static_assert(p.multiply_adds == 24 + 64 + 64 + 24);
  CHECK(p.encoder_sweeps == 0);
}

TEST_CASE("scratch tiles and buffers that are alive at the same time never share memory") {
  const auto check = [](const graph::Program& p) {
    // Replay: when a stage runs, whatever it reads must still hold the tensor that it means.
    std::array<int, graph::max_stages> scratch{}, buffers{};
    scratch.fill(-1);
    buffers.fill(-1);
    const auto holds = [&](int t) {
      const graph::Activation& activation = p.activation(t);
      const auto place = static_cast<std::size_t>(activation.place);
      if (activation.storage == Storage::scratch) return scratch[place] == t;
      if (activation.storage == Storage::buffer) return buffers[place] == t;
      return true;
    };
    for (int i = 0; i < p.stage_count; ++i) {
      const graph::Stage& stage = p.stage(i);
      for (int s = 0; s < stage.source_count; ++s) {
        const graph::Source& source = stage.sources[static_cast<std::size_t>(s)];
        CHECK(holds(source.activation));
        for (int c = 0; c < source.chain.count; ++c)
          if (source.chain.steps[static_cast<std::size_t>(c)].other >= 0)
            CHECK(holds(source.chain.steps[static_cast<std::size_t>(c)].other));
      }
      if (!stage.direct) scratch[static_cast<std::size_t>(stage.operand_scratch)] = 1000 + i;
      for (int c = 0; c < stage.epilogue.count; ++c)
        if (stage.epilogue.steps[static_cast<std::size_t>(c)].other >= 0)
          CHECK(holds(stage.epilogue.steps[static_cast<std::size_t>(c)].other));
      const graph::Activation& out = p.activation(stage.output);
      if (stage.direct) CHECK(holds(stage.sources[0].activation));
      if (!stage.direct && out.storage == Storage::scratch) CHECK(out.place != stage.operand_scratch);
      // Rows of the output are written while others are still to come: what these read must lie elsewhere.
      for (int c = 0; c < stage.epilogue.count; ++c) {
        const graph::Step& step = stage.epilogue.steps[static_cast<std::size_t>(c)];
        if (step.other < 0 || step.operation == graph::operation_id<npt::kernel::AddTile>) continue;
        CHECK((p.activation(step.other).storage != out.storage || p.activation(step.other).place != out.place));
      }
      if (out.storage == Storage::scratch) scratch[static_cast<std::size_t>(out.place)] = stage.output;
      if (out.storage == Storage::buffer) buffers[static_cast<std::size_t>(out.place)] = stage.output;
    }
  };
  check(program<npt::PoseTransferNet<>>);
  check(program<npt::PoseTransferNet<128, npt::ReluConv>>);
  check(program<npt::PoseTransferNet<128, npt::ConvRelu, npt::Pooled>>);
  check(program<npt::PoseTransferNet<128, npt::ReluConv, npt::Pooled>>);
  check(program<SharedNet>);
  check(program<ConditionedNet>);
}
