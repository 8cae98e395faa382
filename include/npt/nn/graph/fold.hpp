/// Folding: a convolution that reads a sum of convolutions with nothing in between takes their weights into its own,
/// when the engine packs them. In the ReLU-before-conv order conv2, conv_res and the next decoder convolution become
/// one: a third of the work goes.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/graph/uses.hpp>

#include <array>

namespace npt::inline NPT_ABI::graph {

namespace internal {

/// The convolutions whose sum stage d reads and nobody else does, last first; none where there is anything else.
struct Summands {
  std::array<int, 2> stages{};
  int count = 0;
};
constexpr Summands summands(const Program& program, int d) {
  Summands found;
  if (!program.stage(d).direct || program.stage(d).folded_count != 0) return {};
  for (int t = program.stage(d).sources[0].activation;;) {
    const int s = program.activation(t).stage;
    if (s < 0 || found.count == 2 || count_uses(program, t) != 1 || program.activation(t).storage == Storage::pooled ||
        program.activation(t).encoded != program.activation(program.stage(d).output).encoded ||
        program.stage(s).folded_count != 0)
      return {};
    found.stages[index(found.count++)] = s;
    const Chain& epilogue = program.stage(s).epilogue;
    if (epilogue.count == 0) return found;
    if (epilogue.count != 1 || epilogue.steps[0].operation != operation_id<kernel::AddTile>) return {};
    t = epilogue.steps[0].other;
  }
}

}  // namespace internal

/// Multiplies convolutions into the weights of the one behind them where that saves work.
constexpr void fold_convolutions(Program& program) {
  std::array<bool, max_stages> gone{};
  for (int d = 0; d < program.stage_count; ++d) {
    const internal::Summands inner = internal::summands(program, d);
    int plain = program.stage(d).rows * program.stage(d).columns, folded = 0, sources = 0;
    for (int k = 0; k < inner.count; ++k) {
      const Stage& s = program.stage(inner.stages[index(k)]);
      plain += s.rows * s.columns;
      folded += program.stage(d).rows * s.columns;
      sources += s.source_count;
    }
    if (inner.count == 0 || folded >= plain || sources > max_sources) continue;
    Stage& outer = program.stage(d);
    outer.source_count = outer.columns = 0;
    for (int k = inner.count - 1; k >= 0; --k) {
      const Stage& s = program.stage(inner.stages[index(k)]);
      for (int source = 0; source < s.source_count; ++source) {
        Source moved = s.sources[index(source)];
        moved.first += outer.columns;
        outer.sources[index(outer.source_count++)] = moved;
      }
      outer.folded[index(outer.folded_count++)] = {s.weight, s.bias, s.rows, s.columns};
      outer.columns += s.columns;
      gone[index(inner.stages[index(k)])] = true;
    }
    outer.direct = outer.source_count == 1 && outer.sources[0].chain.count == 0;
  }
  std::array<int, max_stages> moved{};
  int count = 0;
  for (int i = 0; i < program.stage_count; ++i) {
    moved[index(i)] = gone[index(i)] ? -1 : count;
    if (!gone[index(i)]) program.stage(count++) = Stage(program.stage(i));
  }
  program.stage_count = count;
  for (int t = 0; t < program.activation_count; ++t)
    if (program.activation(t).stage >= 0) program.activation(t).stage = moved[index(program.activation(t).stage)];
}

}  // namespace npt::inline NPT_ABI::graph
