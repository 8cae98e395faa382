/// Who reads which activation of a program that is being made.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/graph/program.hpp>

namespace npt::inline NPT_ABI::graph {

/// Calls f(activation, whether it is needed complete: its moments or its maxima) for everything that stage i reads.
template <class F>
constexpr void for_each_use(const Program& program, int i, F&& f) {
  const Stage& stage = program.stage(i);
  const auto other = [&f](int a) { f(a, false); };
  for (int s = 0; s < stage.source_count; ++s) {
    const Source& source = stage.sources[index(s)];
    bool complete = program.activation(source.activation).storage == Storage::pooled;
    for (int c = 0; c < source.chain.count; ++c) complete = complete || source.chain.steps[index(c)].normalises;
    f(source.activation, complete);
    for_each_other(source.chain, other);
  }
  for_each_other(stage.epilogue, other);
}

/// Whether a stage reads activation a for which `counts(stage number)`.
template <class F>
constexpr bool is_used(const Program& program, int a, F&& counts) {
  bool used = false;
  for (int i = 0; i < program.stage_count; ++i)
    if (counts(i)) for_each_use(program, i, [&](int u, bool) { used = used || u == a; });
  return used;
}

/// Readers of activation a, each time that they read it: stages, maxima of it, the network's result.
constexpr int count_uses(const Program& program, int a) {
  int uses = a == program.output ? 1 : 0;
  for (int i = 0; i < program.stage_count; ++i) for_each_use(program, i, [&](int u, bool) { uses += u == a ? 1 : 0; });
  for (int p = 0; p < program.activation_count; ++p) uses += program.activation(p).pooled_from == a ? 1 : 0;
  return uses;
}

}  // namespace npt::inline NPT_ABI::graph
