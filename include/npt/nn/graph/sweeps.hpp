/// Sweeps: a stage runs in the first one in which the moments and maxima that it needs are known, or later if its
/// output is only used later: a residual branch then lives and dies inside one task.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/graph/uses.hpp>

#include <array>

namespace npt::inline NPT_ABI::graph {

namespace internal {

constexpr void mark_moments(Program& program) {
  const auto mark = [&program](int t, const Chain& chain) {
    for (int i = 0; i < chain.count; ++i)
      if (chain.steps[index(i)].normalises) {
        if (program.activation(t).stage < 0 || program.activation(t).storage == Storage::pooled)
          throw "npt: instance_norm needs the output of a convolution";
        program.activation(t).moments = true;
      }
  };
  for (int i = 0; i < program.stage_count; ++i)
    for (int s = 0; s < program.stage(i).source_count; ++s)
      mark(program.stage(i).sources[index(s)].activation, program.stage(i).sources[index(s)].chain);
  for (int t = 0; t < program.activation_count; ++t)
    if (program.activation(t).pooled_from >= 0) mark(program.activation(t).pooled_from, program.activation(t).chain);
}

/// The first sweep in which the moments and maxima that a stage needs are known; the encoder's sweeps come first.
constexpr void assign_levels(Program& program) {
  int encoder_end = 0;
  for (const bool encoder : {true, false}) {
    for (int i = 0; i < program.stage_count; ++i) {
      if (program.activation(program.stage(i).output).encoded != encoder) continue;
      int level = encoder ? 0 : encoder_end;
      for_each_use(program, i, [&](int t, bool complete) {
        if (program.activation(t).stage < 0) return;
        const int needed = program.stage(program.activation(t).stage).level + (complete ? 1 : 0);
        if (needed > level) level = needed;
      });
      program.stage(i).level = level;
    }
    if (encoder)
      for (int i = 0; i < program.stage_count; ++i)
        if (program.activation(program.stage(i).output).encoded && program.stage(i).level + 1 > encoder_end)
          encoder_end = program.stage(i).level + 1;
  }
}

/// A stage moves to the sweep of its first user if no user needs its output complete.
constexpr void delay_stages(Program& program) {
  for (int i = program.stage_count - 1; i >= 0; --i) {
    const int out = program.stage(i).output;
    if (program.activation(out).encoded || out == program.output || program.activation(out).moments ||
        program.stage(i).gathers_maxima)
      continue;
    int latest = 1 << 20;
    for (int j = i + 1; j < program.stage_count; ++j)
      for_each_use(program, j, [&](int t, bool) {
        if (t == out && program.stage(j).level < latest) latest = program.stage(j).level;
      });
    if (latest != 1 << 20) program.stage(i).level = latest;
  }
}

constexpr void sort_stages(Program& program) {
  std::array<Stage, max_stages> sorted{};
  std::array<int, max_stages> moved{};
  int count = 0;
  for (int level = 0; count < program.stage_count; ++level)
    for (int i = 0; i < program.stage_count; ++i)
      if (program.stage(i).level == level) {
        moved[index(i)] = count;
        sorted[index(count++)] = program.stage(i);
      }
  program.stages = sorted;
  for (int t = 0; t < program.activation_count; ++t)
    if (program.activation(t).stage >= 0) program.activation(t).stage = moved[index(program.activation(t).stage)];
}

constexpr void make_sweeps(Program& program) {
  for (int i = 0; i < program.stage_count; ++i) {
    if (i == 0 || program.stage(i).level != program.stage(i - 1).level) {
      program.sweeps[index(program.sweep_count)] = {.first_stage = i,
                                                    .encodes = program.activation(program.stage(i).output).encoded};
      ++program.sweep_count;
    }
    ++program.sweeps[index(program.sweep_count - 1)].stage_count;
    program.stage(i).level = program.sweep_count - 1;
  }
  while (program.encoder_sweeps < program.sweep_count && program.sweeps[index(program.encoder_sweeps)].encodes)
    ++program.encoder_sweeps;
}

}  // namespace internal

/// Orders the stages by sweeps.
constexpr void assign_sweeps(Program& program) {
  internal::mark_moments(program);
  internal::assign_levels(program);
  internal::delay_stages(program);
  internal::sort_stages(program);
  internal::make_sweeps(program);
}

}  // namespace npt::inline NPT_ABI::graph
