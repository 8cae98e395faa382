/// Storage: activations used within their sweep get a scratch tile, others a buffer; both are shared by lifetime.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/graph/uses.hpp>

#include <array>

namespace npt::inline NPT_ABI::graph {

namespace internal {

// Lifetimes are counted in quarter stages: a prologue writes its operand at 4 i and reads its sources then, the
// product and the epilogue end at 4 i + 2, where the output appears. What the epilogue adds is read just before the
// output takes its place, row by row, so that both may share memory: it ends at 4 i + 1. What its other steps read is
// needed for every row.
struct Lifetime {
  int begin = 0, end = 0;
  constexpr bool overlaps(const Lifetime& o) const { return begin <= o.end && o.begin <= end; }
};

constexpr Lifetime lifetime(const Program& program, int t) {
  Lifetime life{4 * program.activation(t).stage + 2, 4 * program.activation(t).stage + 2};
  const auto extend = [&life](int end) {
    if (end > life.end) life.end = end;
  };
  for (int i = 0; i < program.stage_count; ++i) {
    const Stage& s = program.stage(i);
    for (int k = 0; k < s.source_count; ++k) {
      const Source& source = s.sources[index(k)];
      if (source.activation == t) extend(s.direct ? 4 * i + 2 : 4 * i);
      for_each_other(source.chain, [&](int other) {
        if (other == t) extend(4 * i);
      });
    }
    for (int c = 0; c < s.epilogue.count; ++c)
      if (s.epilogue.steps[index(c)].other == t)
        extend(s.epilogue.steps[index(c)].operation == operation_id<kernel::AddTile> ? 4 * i + 1 : 4 * i + 2);
  }
  if (t == program.output) extend(4 * program.activation(t).stage + 3);
  return life;
}

constexpr bool decodes(const Program& program, int i) { return !program.activation(program.stage(i).output).encoded; }

/// Places that activations share whose lifetimes don't overlap.
struct Allocation {
  std::array<std::array<Lifetime, max_stages>, max_stages> tenants{};
  std::array<int, max_stages> counts{};
  int places = 0;
  constexpr int take(const Lifetime& life, int limit) {
    int place = 0;
    for (; place < places; ++place) {
      bool free = true;
      for (int k = 0; k < counts[index(place)]; ++k) free = free && !tenants[index(place)][index(k)].overlaps(life);
      if (free) break;
    }
    if (place == limit) throw "npt: a network needs more than graph::max_buffers stored activations at a time";
    if (place == places) ++places;
    tenants[index(place)][index(counts[index(place)]++)] = life;
    return place;
  }
};

constexpr void widen(int& channels, int with) {
  if (with > channels) channels = with;
}

}  // namespace internal

/// Gives every activation and every operand that a prologue makes its place.
constexpr void assign_storage(Program& program) {
  internal::Allocation buffers, scratch;
  internal::Lifetime code_life;
  for (int i = 0; i < program.stage_count; ++i) {
    Stage& s = program.stage(i);
    if (!s.direct) {
      s.operand_scratch = scratch.take({4 * i, 4 * i + 2}, max_stages);
      internal::widen(program.scratch_channels[index(s.operand_scratch)], s.columns);
    }
    Activation& out = program.activation(s.output);
    const internal::Lifetime life = internal::lifetime(program, s.output);
    const bool used = s.output == program.output || is_used(program, s.output, [](int) { return true; });
    if (!is_used(program, s.output, [&](int j) { return program.stage(j).level > s.level; })) {
      out.storage = used ? Storage::scratch : Storage::none;
      out.place = scratch.take(life, max_stages);
      internal::widen(program.scratch_channels[index(out.place)], out.channels);
    } else if (out.encoded && is_used(program, s.output, [&](int j) { return internal::decodes(program, j); })) {
      if (program.code_count == max_buffers)
        throw "npt: more than graph::max_buffers feature maps of the encoded input meet the others";
      out.storage = Storage::code;
      out.place = program.code_count++;
      if (out.place == 0) code_life = life;
    } else {
      out.storage = Storage::buffer;
      out.place = buffers.take(life, max_buffers);
      internal::widen(program.buffer_channels[out.encoded ? 0 : 1][index(out.place)], out.channels);
    }
  }
  program.buffer_count = buffers.places;
  program.scratch_count = scratch.places;
  for (int b = 0; program.code_count == 1 && b < buffers.places && program.code_alias < 0; ++b)
    if (buffers.tenants[index(b)][0].begin > code_life.end) program.code_alias = b;
}

/// Whether the encoded input's vertices meet those of the others.
constexpr void find_pairing(Program& program) {
  for (int i = 0; i < program.stage_count; ++i)
    if (internal::decodes(program, i))
      for_each_use(program, i, [&](int t, bool) {
        if (program.activation(t).encoded && program.activation(t).storage != Storage::pooled) program.paired = true;
      });
}

/// Biases that only reach an instance norm have no effect.
constexpr void find_dead_biases(Program& program) {
  for (int i = 0; i < program.stage_count; ++i) {
    const int out = program.stage(i).output;
    bool dead = program.stage(i).epilogue.count == 0 && program.activation(out).moments && out != program.output;
    const auto check = [&](const Chain& chain) { dead = dead && chain.count > 0 && chain.steps[0].normalises; };
    const auto check_others = [&](const Chain& chain) {
      for_each_other(chain, [&](int other) { dead = dead && other != out; });
    };
    for (int j = 0; j < program.stage_count; ++j) {
      for (int s = 0; s < program.stage(j).source_count; ++s) {
        if (program.stage(j).sources[index(s)].activation == out) check(program.stage(j).sources[index(s)].chain);
        check_others(program.stage(j).sources[index(s)].chain);
      }
      check_others(program.stage(j).epilogue);
    }
    for (int t = 0; t < program.activation_count; ++t)
      if (program.activation(t).pooled_from == out) check(program.activation(t).chain);
    program.stage(i).bias_is_dead = dead;
  }
}

}  // namespace npt::inline NPT_ABI::graph
