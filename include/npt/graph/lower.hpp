/// From a recorded network to a program, in a constant expression.
///
/// 1. Every convolution becomes a stage. Its epilogue absorbs what follows and needs no moments: activations, and the
/// sum with
///    an earlier stage's output.
/// 2. Its sources are what its operand resolves to: stored activations, each read through the pointwise layers in between.
/// 3. A convolution that reads a sum of convolutions, with nothing in between, takes their weights into its own: in the
///    ReLU-before-conv order conv2, conv_res and the next decoder convolution become one, and a third of the work goes.
/// 4. A stage runs in the first sweep in which the moments and maxima that it needs are known, or later if its output
/// is
///    only used later: a residual branch then lives and dies inside one task.
/// 5. Tensors used within their sweep get a scratch tile, others a buffer; both are shared by lifetime.
#pragma once

#include <npt/config.hpp>
#include <npt/graph/program.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::graph {

/// How a network is lowered.
struct LoweringOptions {
  /// Convolutions are multiplied together where that saves work. Training needs them apart.
  bool fold = true;
  /// Operands are always packed by a prologue, never read as they lie: needed where the product has another format.
  bool pack_every_operand = false;
};

namespace internal {

class Lowering {
 public:
  constexpr Lowering(const Graph& graph, const LoweringOptions& options) : graph_(graph), options_(options) {}

  constexpr Program run() {
    count_uses();
    add_inputs();
    for (int n = 0; n < graph_.count; ++n)
      if (graph_[n].kind == NodeKind::conv) add_stage(n);
    program_.output = activation_of_[index(graph_.output)];
    if (program_.output < 0 || activation(program_.output).stage < 0)
      throw "npt: a network must end in a convolution, with activations that need no moments behind it";
    if (options_.fold) fold_convolutions();
    if (options_.pack_every_operand)
      for (int i = 0; i < program_.stage_count; ++i) stage(i).direct = false;
    mark_moments();
    assign_levels();
    sort_stages();
    make_sweeps();
    assign_storage();
    assign_signatures();
    count_work();
    return program_;
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
  constexpr Stage& stage(int i) { return program_.stages[index(i)]; }
  constexpr Activation& activation(int i) { return program_.activations[index(i)]; }

  struct Operand {
    std::array<Source, max_sources> sources{};
    int count = 0;
    constexpr void push(const Source& source) {
      if (count == max_sources) throw "npt: more than graph::max_sources operands in one concatenation";
      sources[static_cast<std::size_t>(count++)] = source;
    }
  };

  constexpr void count_uses() {
    for (int n = 0; n < graph_.count; ++n)
      for (const int operand : {graph_[n].first, graph_[n].second})
        if (operand >= 0) {
          ++uses_[index(operand)];
          user_[index(operand)] = n;
        }
    ++uses_[index(graph_.output)];
    for (int& t : activation_of_) t = -1;
  }

  constexpr int add_activation(const Activation& t) {
    if (program_.activation_count == max_activations)
      throw "npt: a network has more than graph::max_activations stored activations";
    program_.activations[index(program_.activation_count)] = t;
    return program_.activation_count++;
  }

  constexpr void add_inputs() {
    for (int n = 0; n < 2; ++n)
      activation_of_[index(n)] =
          add_activation({.channels = graph_[n].channels, .storage = Storage::input, .place = n, .from_pose = n == 0});
  }

  /// `first` and `channels`: the part of the node's channels that the step is applied to.
  constexpr Step step_of(const Node& node, int first, int channels) const {
    Step step{.operation = node.operation, .normalises = node.normalises};
    if (node.second >= 0) {
      step.other = activation_of_[index(node.second)];
      if (step.other < 0) throw "npt: a layer can only be conditioned on a network input or a stored activation";
    }
    for (std::size_t i = 0; i < step.parameters.size(); ++i) {
      if (node.parameters[i] < 0) continue;
      const int size = node.parameter_sizes[i];
      const int a_channel = size % node.channels == 0 ? size / node.channels : 0;  // 0: not per channel
      step.parameters[i] = node.parameters[i] + first * a_channel;
      step.sizes[i] = a_channel == 0 ? size : channels * a_channel;
    }
    return step;
  }

  /// Stored activations and the chains through which node n is read from them.
  constexpr Operand resolve(int n) {
    const Node& node = graph_[n];
    Operand operand;
    if (activation_of_[index(n)] >= 0) {
      operand.push({.activation = activation_of_[index(n)], .channels = node.channels});
    } else if (node.kind == NodeKind::pointwise) {
      operand = resolve(node.first);
      for (int s = 0; s < operand.count; ++s) {
        Source& source = operand.sources[index(s)];
        if (node.normalises && source.chain.count != 0)
          throw "npt: instance_norm must follow a convolution and activations that nothing else uses";
        const Step step = step_of(node, source.first, source.channels);
        if (activation(source.activation).pooled_from >= 0)
          source.activation = behind_pool(source.activation, step);
        else
          source.chain.push(step);
      }
    } else if (node.kind == NodeKind::cat) {
      operand = resolve(node.first);
      const Operand second = resolve(node.second);
      for (int s = 0; s < second.count; ++s) {
        Source source = second.sources[index(s)];
        source.first += graph_[node.first].channels;
        operand.push(source);
      }
    } else if (node.kind == NodeKind::max_pool) {
      operand.push({.activation = pool(n), .channels = node.channels});
    } else {
      throw "npt: one operand of a sum must be a convolution, with activations behind it that nothing else uses";
    }
    return operand;
  }

  /// The maximum is taken before the increasing layers in front of it, while the convolution's output is written.
  constexpr int pool(int n) {
    const Operand operand = resolve(graph_[n].first);
    const Source& source = operand.sources[0];
    if (operand.count != 1 || activation(source.activation).stage < 0)
      throw "npt: max_pool must follow a convolution and increasing layers (instance_norm, relu, tanh)";
    for (int m = graph_[n].first; activation_of_[index(m)] < 0; m = graph_[m].first)
      if (!graph_[m].increasing || graph_[m].second >= 0)
        throw "npt: only increasing layers may stand between a convolution and max_pool";
    stage(activation(source.activation).stage).gathers_maxima = true;
    const int pooled = add_activation({.channels = graph_[n].channels,
                                       .storage = Storage::pooled,
                                       .stage = activation(source.activation).stage,
                                       .pooled_from = source.activation,
                                       .chain = source.chain,
                                       .from_pose = graph_[n].depends == depends_on_pose});
    activation_of_[index(n)] = pooled;
    return pooled;
  }

  /// Pooled activation t with one more layer behind it, which the pooled values go through like those in front of max_pool.
  constexpr int behind_pool(int t, const Step& step) {
    if (step.normalises || step.other >= 0)
      throw "npt: behind max_pool no layer may need values per vertex: instance_norm, or one that is conditioned on others";
    Activation longer = activation(t);
    longer.chain.push(step);
    for (int p = 0; p < program_.activation_count; ++p)
      if (activation(p).pooled_from == longer.pooled_from && activation(p).chain == longer.chain) return p;
    return add_activation(longer);
  }

  constexpr void add_stage(int conv) {
    if (program_.stage_count == max_stages) throw "npt: a network has more than graph::max_stages convolutions";
    const Node& node = graph_[conv];
    Stage s{.node = conv, .weight = node.weight, .bias = node.bias, .rows = node.channels};
    s.columns = graph_[node.first].channels;
    const Operand operand = resolve(node.first);
    s.source_count = operand.count;
    s.sources = operand.sources;
    s.direct = operand.count == 1 && operand.sources[0].chain.count == 0;
    const int out = absorb_epilogue(conv, s.epilogue);
    s.output = add_activation(
        {.channels = s.rows, .stage = program_.stage_count, .from_pose = graph_[out].depends == depends_on_pose});
    activation_of_[index(out)] = s.output;
    stage(program_.stage_count++) = s;
  }

  /// Moves into the epilogue what follows the convolution; returns the node that the stage's output is.
  constexpr int absorb_epilogue(int conv, Chain& epilogue) {
    int n = conv;
    while (uses_[index(n)] == 1 && n != graph_.output) {
      const int next = user_[index(n)];
      const Node& user = graph_[next];
      if (user.kind == NodeKind::pointwise && user.first == n && !user.normalises) {
        if (user.second >= 0 && activation_of_[index(user.second)] < 0) break;  // its condition isn't stored yet
        epilogue.push(step_of(user, 0, user.channels));
      } else if (user.kind == NodeKind::sum) {
        const int other = activation_of_[index(user.first == n ? user.second : user.first)];
        if (other < 0) break;
        epilogue.push({.operation = operation_id<kernel::AddTile>, .other = other});
      } else {
        break;
      }
      n = next;
    }
    return n;
  }

  /// Calls f(activation, whether it is needed complete: its moments or its maxima) for everything stage i reads.
  template <class F>
  constexpr void for_each_use(int i, F&& f) {
    const auto others = [&](const Chain& chain) {
      for (int c = 0; c < chain.count; ++c)
        if (chain.steps[index(c)].other >= 0) f(chain.steps[index(c)].other, false);
    };
    for (int s = 0; s < stage(i).source_count; ++s) {
      const Source& source = stage(i).sources[index(s)];
      bool complete = activation(source.activation).storage == Storage::pooled;
      for (int c = 0; c < source.chain.count; ++c) complete = complete || source.chain.steps[index(c)].normalises;
      f(source.activation, complete);
      others(source.chain);
    }
    others(stage(i).epilogue);
  }

  constexpr int uses_of(int t) {
    int uses = t == program_.output ? 1 : 0;
    for (int i = 0; i < program_.stage_count; ++i) for_each_use(i, [&](int u, bool) { uses += u == t ? 1 : 0; });
    for (int p = 0; p < program_.activation_count; ++p) uses += activation(p).pooled_from == t ? 1 : 0;
    return uses;
  }

  /// The convolutions whose sum stage d reads and nobody else does, last first; none where there is anything else.
  struct Summands {
    std::array<int, 2> stages{};
    int count = 0;
  };
  constexpr Summands summands(int d) {
    Summands found;
    if (!stage(d).direct || stage(d).folded_count != 0) return {};
    for (int t = stage(d).sources[0].activation;;) {
      const int s = activation(t).stage;
      if (s < 0 || found.count == 2 || uses_of(t) != 1 || activation(t).storage == Storage::pooled ||
          activation(t).from_pose != activation(stage(d).output).from_pose || stage(s).folded_count != 0)
        return {};
      found.stages[index(found.count++)] = s;
      const Chain& epilogue = stage(s).epilogue;
      if (epilogue.count == 0) return found;
      if (epilogue.count != 1 || epilogue.steps[0].operation != operation_id<kernel::AddTile>) return {};
      t = epilogue.steps[0].other;
    }
  }

  constexpr void fold_convolutions() {
    std::array<bool, max_stages> gone{};
    for (int d = 0; d < program_.stage_count; ++d) {
      const Summands inner = summands(d);
      int plain = stage(d).rows * stage(d).columns, folded = 0, sources = 0;
      for (int k = 0; k < inner.count; ++k) {
        const Stage& s = stage(inner.stages[index(k)]);
        plain += s.rows * s.columns;
        folded += stage(d).rows * s.columns;
        sources += s.source_count;
      }
      if (inner.count == 0 || folded >= plain || sources > max_sources) continue;
      Stage& outer = stage(d);
      outer.source_count = outer.columns = 0;
      for (int k = inner.count - 1; k >= 0; --k) {
        const Stage& s = stage(inner.stages[index(k)]);
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
    for (int i = 0; i < program_.stage_count; ++i) {
      moved[index(i)] = gone[index(i)] ? -1 : count;
      if (!gone[index(i)]) stage(count++) = Stage(stage(i));
    }
    program_.stage_count = count;
    for (int t = 0; t < program_.activation_count; ++t)
      if (activation(t).stage >= 0) activation(t).stage = moved[index(activation(t).stage)];
  }

  constexpr void mark_moments() {
    const auto mark = [this](int t, const Chain& chain) {
      for (int i = 0; i < chain.count; ++i)
        if (chain.steps[index(i)].normalises) {
          if (activation(t).stage < 0 || activation(t).storage == Storage::pooled)
            throw "npt: instance_norm needs the output of a convolution";
          activation(t).moments = true;
        }
    };
    for (int i = 0; i < program_.stage_count; ++i)
      for (int s = 0; s < stage(i).source_count; ++s)
        mark(stage(i).sources[index(s)].activation, stage(i).sources[index(s)].chain);
    for (int t = 0; t < program_.activation_count; ++t)
      if (activation(t).pooled_from >= 0) mark(activation(t).pooled_from, activation(t).chain);
  }

  constexpr void assign_levels() {
    int encoder_end = 0;
    for (const bool encoder : {true, false}) {
      for (int i = 0; i < program_.stage_count; ++i) {
        if (activation(stage(i).output).from_pose != encoder) continue;
        int level = encoder ? 0 : encoder_end;
        for_each_use(i, [&](int t, bool complete) {
          if (activation(t).stage < 0) return;
          const int needed = stage(activation(t).stage).level + (complete ? 1 : 0);
          if (needed > level) level = needed;
        });
        stage(i).level = level;
      }
      if (encoder)
        for (int i = 0; i < program_.stage_count; ++i)
          if (activation(stage(i).output).from_pose && stage(i).level + 1 > encoder_end)
            encoder_end = stage(i).level + 1;
    }
    delay_stages();
  }

  /// A stage moves to the sweep of its first user if no user needs its output complete.
  constexpr void delay_stages() {
    for (int i = program_.stage_count - 1; i >= 0; --i) {
      const int out = stage(i).output;
      if (activation(out).from_pose || out == program_.output || activation(out).moments || stage(i).gathers_maxima)
        continue;
      int latest = 1 << 20;
      for (int j = i + 1; j < program_.stage_count; ++j)
        for_each_use(j, [&](int t, bool) {
          if (t == out && stage(j).level < latest) latest = stage(j).level;
        });
      if (latest != 1 << 20) stage(i).level = latest;
    }
  }

  constexpr void sort_stages() {
    std::array<Stage, max_stages> sorted{};
    std::array<int, max_stages> moved{};
    int count = 0;
    for (int level = 0; count < program_.stage_count; ++level)
      for (int i = 0; i < program_.stage_count; ++i)
        if (stage(i).level == level) {
          moved[index(i)] = count;
          sorted[index(count++)] = stage(i);
        }
    program_.stages = sorted;
    for (int t = 0; t < program_.activation_count; ++t)
      if (activation(t).stage >= 0) activation(t).stage = moved[index(activation(t).stage)];
  }

  constexpr void make_sweeps() {
    for (int i = 0; i < program_.stage_count; ++i) {
      if (i == 0 || stage(i).level != stage(i - 1).level) {
        program_.sweeps[index(program_.sweep_count)] = {.first_stage = i,
                                                        .over_pose = activation(stage(i).output).from_pose};
        ++program_.sweep_count;
      }
      ++program_.sweeps[index(program_.sweep_count - 1)].stage_count;
      stage(i).level = program_.sweep_count - 1;
    }
    while (program_.encoder_sweeps < program_.sweep_count && program_.sweeps[index(program_.encoder_sweeps)].over_pose)
      ++program_.encoder_sweeps;
  }

  // Lifetimes are counted in quarter stages: a prologue writes its operand at 4 i and reads its sources then, the
  // product and the epilogue end at 4 i + 2, where the output appears. What the epilogue adds is read just before the
  // output takes its place, row by row, so that both may share memory: it ends at 4 i + 1. What its other steps read is
  // needed for every row.
  struct Lifetime {
    int begin = 0, end = 0;
    constexpr bool overlaps(const Lifetime& o) const { return begin <= o.end && o.begin <= end; }
  };

  constexpr Lifetime lifetime(int t) {
    Lifetime life{4 * activation(t).stage + 2, 4 * activation(t).stage + 2};
    const auto extend = [&life](int end) {
      if (end > life.end) life.end = end;
    };
    for (int i = 0; i < program_.stage_count; ++i) {
      const Stage& s = stage(i);
      for (int k = 0; k < s.source_count; ++k) {
        const Source& source = s.sources[index(k)];
        if (source.activation == t) extend(s.direct ? 4 * i + 2 : 4 * i);
        for (int c = 0; c < source.chain.count; ++c)
          if (source.chain.steps[index(c)].other == t) extend(4 * i);
      }
      for (int c = 0; c < s.epilogue.count; ++c)
        if (s.epilogue.steps[index(c)].other == t)
          extend(s.epilogue.steps[index(c)].operation == operation_id<kernel::AddTile> ? 4 * i + 1 : 4 * i + 2);
    }
    if (t == program_.output) extend(4 * activation(t).stage + 3);
    return life;
  }

  constexpr bool used_after_sweep(int t) {
    const int sweep = stage(activation(t).stage).level;
    bool later = false;
    for (int i = 0; i < program_.stage_count; ++i)
      if (stage(i).level > sweep) for_each_use(i, [&](int u, bool) { later = later || u == t; });
    return later;
  }
  constexpr bool used_at_all(int t) {
    bool used = t == program_.output;
    for (int i = 0; i < program_.stage_count; ++i) for_each_use(i, [&](int u, bool) { used = used || u == t; });
    return used;
  }

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

  static constexpr void widen(int& channels, int with) {
    if (with > channels) channels = with;
  }

  constexpr void assign_storage() {
    Allocation buffers, scratch;
    Lifetime code_life;
    for (int i = 0; i < program_.stage_count; ++i) {
      Stage& s = stage(i);
      if (!s.direct) {
        s.operand_scratch = scratch.take({4 * i, 4 * i + 2}, max_stages);
        widen(program_.scratch_channels[index(s.operand_scratch)], s.columns);
      }
      Activation& out = activation(s.output);
      const Lifetime life = lifetime(s.output);
      if (!used_at_all(s.output) || !used_after_sweep(s.output)) {
        out.storage = used_at_all(s.output) ? Storage::scratch : Storage::none;
        out.place = scratch.take(life, max_stages);
        widen(program_.scratch_channels[index(out.place)], out.channels);
      } else if (out.from_pose && used_by_decoder(s.output)) {
        if (program_.code_count == max_buffers)
          throw "npt: more than graph::max_buffers feature maps of the pose meet the identity";
        out.storage = Storage::code;
        out.place = program_.code_count++;
        if (out.place == 0) code_life = life;
      } else {
        out.storage = Storage::buffer;
        out.place = buffers.take(life, max_buffers);
        widen(program_.buffer_channels[out.from_pose ? 0 : 1][index(out.place)], out.channels);
      }
    }
    program_.buffer_count = buffers.places;
    program_.scratch_count = scratch.places;
    for (int b = 0; program_.code_count == 1 && b < buffers.places && program_.code_alias < 0; ++b)
      if (buffers.tenants[index(b)][0].begin > code_life.end) program_.code_alias = b;
    find_pairing();
    find_dead_biases();
  }

  constexpr bool used_by_decoder(int t) {
    bool used = false;
    for (int i = 0; i < program_.stage_count; ++i)
      if (!activation(stage(i).output).from_pose) for_each_use(i, [&](int u, bool) { used = used || u == t; });
    return used;
  }

  constexpr void find_pairing() {
    for (int i = 0; i < program_.stage_count; ++i)
      if (!activation(stage(i).output).from_pose)
        for_each_use(i, [&](int t, bool) {
          if (activation(t).from_pose && activation(t).storage != Storage::pooled) program_.paired = true;
        });
  }

  constexpr void find_dead_biases() {
    for (int i = 0; i < program_.stage_count; ++i) {
      const int out = stage(i).output;
      bool dead = stage(i).epilogue.count == 0 && activation(out).moments && out != program_.output;
      const auto check = [&](const Chain& chain) { dead = dead && chain.count > 0 && chain.steps[0].normalises; };
      const auto check_others = [&](const Chain& chain) {
        for (int c = 0; c < chain.count; ++c) dead = dead && chain.steps[index(c)].other != out;
      };
      for (int j = 0; j < program_.stage_count; ++j) {
        for (int s = 0; s < stage(j).source_count; ++s) {
          if (stage(j).sources[index(s)].activation == out) check(stage(j).sources[index(s)].chain);
          check_others(stage(j).sources[index(s)].chain);
        }
        check_others(stage(j).epilogue);
      }
      for (int t = 0; t < program_.activation_count; ++t)
        if (activation(t).pooled_from == out) check(activation(t).chain);
      stage(i).bias_is_dead = dead;
    }
  }

  constexpr void sign(Chain& chain) {
    for (int s = 0; s < program_.signature_count && chain.signature < 0; ++s) {
      const Signature& known = program_.signatures[index(s)];
      bool same = known.count == chain.count;
      for (int c = 0; same && c < chain.count; ++c)
        same = known.operations[index(c)] == chain.steps[index(c)].operation;
      if (same) chain.signature = s;
    }
    if (chain.signature >= 0) return;
    if (program_.signature_count == max_signatures) throw "npt: more than graph::max_signatures kinds of chains";
    Signature& fresh = program_.signatures[index(program_.signature_count)];
    fresh.count = chain.count;
    for (int c = 0; c < chain.count; ++c) fresh.operations[index(c)] = chain.steps[index(c)].operation;
    chain.signature = program_.signature_count++;
  }

  constexpr void assign_signatures() {
    for (int i = 0; i < program_.stage_count; ++i) {
      for (int s = 0; s < stage(i).source_count; ++s) sign(stage(i).sources[index(s)].chain);
      sign(stage(i).epilogue);
    }
    for (int t = 0; t < program_.activation_count; ++t)
      if (activation(t).storage == Storage::pooled) sign(activation(t).chain);
  }

  constexpr void count_work() {
    for (int n = 0; n < graph_.count; ++n) {
      const Node& node = graph_[n];
      if (node.kind == NodeKind::conv)
        program_.multiply_adds += static_cast<double>(node.channels) * graph_[node.first].channels;
      if (node.kind == NodeKind::pointwise && node.second >= 0)
        program_.multiply_adds += 2.0 * node.channels * graph_[node.second].channels;
    }
  }

  const Graph& graph_;
  LoweringOptions options_;
  Program program_{};
  std::array<int, max_nodes> uses_{};
  std::array<int, max_nodes> user_{};
  std::array<int, max_nodes> activation_of_{};
};

}  // namespace internal

constexpr Program lower(const Graph& graph, const LoweringOptions& options = {}) {
  return internal::Lowering(graph, options).run();
}

/// The network with its parameters' places, and its program. Both are constants of the network's type.
template <class Net>
inline constexpr Net bound_network = bind_parameters<Net>();
template <class Net>
inline constexpr Program program_of = lower(record(bound_network<Net>));
/// The program for products of bfloat16 pairs.
template <class Net>
inline constexpr Program bf16_program_of = lower(record(bound_network<Net>), {.pack_every_operand = true});

}  // namespace npt::inline NPT_ABI::graph
