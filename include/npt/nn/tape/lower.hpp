/// From a recorded network to a tape, in a constant expression.
///
/// 1. Every convolution becomes a stage that stores its output.
/// 2. Its paths are what its operand resolves to: stored activations through pointwise layers; the parts of a
///    concatenation side by side, those of a sum on top of each other.
/// 3. What can't be read that way is gathered first, by a stage without a product: a sum with a layer behind it, a
///    second norm in a chain, an input of a conditioned layer that is no stored activation. The network's result is
///    gathered last.
/// 4. Each path gets the adjoint into which its gradient goes; adjoints share buffers by lifetime.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/tape/tape.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::tape {

using graph::Graph;
using graph::index;
using graph::max_nodes;
using graph::Node;
using graph::NodeKind;

namespace internal {

class Lowering {
 public:
  constexpr explicit Lowering(const Graph& graph) : graph_(graph) {}

  constexpr Tape run() {
    for (int& t : activation_of_) t = -1;
    tape_.inputs = graph_.inputs;
    for (int n = 0; n < graph_.inputs.count; ++n)
      activation_of_[index(n)] =
          add_activation({.channels = graph_[n].channels, .encoded = graph_.is_encoded(n), .input = n});
    for (int n = 0; n < graph_.count; ++n)
      if (graph_[n].kind == NodeKind::conv) add_product(n);
    gather(graph_.output);
    assign_adjoints();
    find_dead_biases();
    assign_buffers();
    assign_signatures();
    find_pairing();
    tape_.multiply_adds = graph::multiply_adds(graph_);
    return tape_;
  }

 private:
  constexpr Stage& stage(int i) { return tape_.stages[index(i)]; }
  constexpr Activation& activation(int i) { return tape_.activations[index(i)]; }
  constexpr Adjoint& adjoint(int i) { return tape_.adjoints[index(i)]; }

  struct Operand {
    std::array<ReadPath, max_paths> paths{};
    int count = 0;
    bool sum = false;  ///< some rows have several paths
    constexpr void push(const ReadPath& path) {
      if (count == max_paths) throw "npt: more than max_paths operands in one concatenation or sum";
      paths[index(count++)] = path;
    }
  };

  constexpr int add_activation(const Activation& t) {
    if (tape_.activation_count == max_activations)
      throw "npt: a network has too many activations to train (nn/tape/tape.hpp)";
    tape_.activations[index(tape_.activation_count)] = t;
    return tape_.activation_count++;
  }

  constexpr int add_stage(Stage s, const Operand& operand, bool encodes) {
    if (tape_.stage_count == max_stages) throw "npt: a network has too many stages to train (nn/tape/tape.hpp)";
    s.path_count = operand.count;
    s.paths = operand.paths;
    s.encodes = encodes;
    int width = 0;
    for (int r = 0; r < s.path_count; ++r) {
      ReadPath& path = s.paths[index(r)];
      if (activation(path.activation).pooled_from >= 0) {
        if (!s.product) throw "npt: a pooled feature must be read by a convolution where a network is trained";
        continue;
      }
      path.row = path.column;
      for (int other = 0; other < s.path_count; ++other) {
        const ReadPath& before = s.paths[index(other)];
        if (activation(before.activation).pooled_from >= 0 && before.column < path.column) path.row -= before.channels;
      }
      if (path.row + path.channels > width) width = path.row + path.channels;
    }
    s.operand_rows = width;
    s.output = add_activation({.channels = s.rows, .encoded = encodes, .stage = tape_.stage_count});
    stage(tape_.stage_count) = s;
    ++tape_.stage_count;
    return s.output;
  }

  constexpr void add_product(int n) {
    const Node& node = graph_[n];
    const Operand operand = resolve(node.first);
    activation_of_[index(n)] = add_stage({.node = n,
                                          .weight = node.weight,
                                          .bias = node.bias,
                                          .rows = node.channels,
                                          .columns = graph_[node.first].channels},
                                         operand, graph_.is_encoded(n));
  }

  /// Node n as a stored activation.
  constexpr int gather(int n) {
    const Operand operand = resolve(n);
    const int channels = graph_[n].channels;
    activation_of_[index(n)] =
        add_stage({.node = n, .product = false, .rows = channels, .columns = channels}, operand, graph_.is_encoded(n));
    return activation_of_[index(n)];
  }
  constexpr int stored(int n) { return activation_of_[index(n)] >= 0 ? activation_of_[index(n)] : gather(n); }

  constexpr Operand resolve(int n) {
    const Node& node = graph_[n];
    Operand operand;
    if (activation_of_[index(n)] >= 0) {
      operand.push({.activation = activation_of_[index(n)], .channels = node.channels});
    } else if (node.kind == NodeKind::pointwise) {
      operand = resolve(node.first);
      bool must_gather = operand.sum;
      for (int r = 0; r < operand.count; ++r) {
        const ReadPath& path = operand.paths[index(r)];
        must_gather = must_gather || (node.normalises && path.norm >= 0) || path.chain.count == max_chain;
        if (node.normalises && activation(path.activation).input >= 0) must_gather = true;
        // An adjoint keeps what the layers in front of its norm do, but not the gradient of a second input of theirs.
        graph::for_each_other(path.chain, [&](int) { must_gather = must_gather || node.normalises; });
      }
      if (must_gather) {
        operand = {};
        operand.push({.activation = gather(node.first), .channels = graph_[node.first].channels});
      }
      for (int r = 0; r < operand.count; ++r) {
        ReadPath& path = operand.paths[index(r)];
        const int condition = node.second < 0 ? -1 : stored(node.second);
        const Step step = graph::step_of(node, path.column, path.channels, condition);
        if (activation(path.activation).pooled_from >= 0) {
          path.activation = behind_pool(path.activation, step);
          continue;
        }
        if (node.normalises) path.norm = path.chain.count;
        path.chain.push(step);
      }
    } else if (node.kind == NodeKind::cat || node.kind == NodeKind::sum) {
      operand = resolve(node.first);
      const Operand second = resolve(node.second);
      const bool sum = node.kind == NodeKind::sum;
      operand.sum = operand.sum || second.sum || sum;
      for (int r = 0; r < second.count; ++r) {
        ReadPath path = second.paths[index(r)];
        if (!sum) path.column += graph_[node.first].channels;
        path.adds = path.adds || sum;
        operand.push(path);
      }
      for (int r = 0; r < operand.count; ++r)
        if (sum && activation(operand.paths[index(r)].activation).pooled_from >= 0)
          throw "npt: a pooled feature can't be added to others where a network is trained";
    } else {
      operand.push({.activation = pool(n), .channels = node.channels});
    }
    return operand;
  }

  constexpr int pool(int n) {
    Operand operand = resolve(graph_[n].first);
    const bool increasing = operand.count == 1 && activation(operand.paths[0].activation).stage >= 0 &&
                            graph::increases_up_to(graph_, graph_[n].first, activation_of_);
    if (!increasing) {
      operand = {};
      operand.push({.activation = gather(graph_[n].first), .channels = graph_[n].channels});
    }
    const ReadPath& path = operand.paths[0];
    activation_of_[index(n)] = add_activation({.channels = graph_[n].channels,
                                               .encoded = graph_.is_encoded(n),
                                               .stage = activation(path.activation).stage,
                                               .pooled_from = path.activation,
                                               .chain = path.chain,
                                               .norm = path.norm});
    return activation_of_[index(n)];
  }

  constexpr int behind_pool(int t, const Step& step) {
    Activation longer = activation(t);
    const int found = graph::find_behind_pool(tape_.activations, tape_.activation_count, longer, step);
    return found >= 0 ? found : add_activation(longer);
  }

  // ---- adjoints ----

  static constexpr bool same_prefix(const Chain& a, const Chain& b) {
    bool same = a.count == b.count;
    for (int i = 0; same && i < a.count; ++i) {
      const Step& x = a.steps[index(i)];
      const Step& y = b.steps[index(i)];
      same = x.operation == y.operation && x.other == y.other && x.parameters == y.parameters;
    }
    return same;
  }

  constexpr int adjoint_of(int t, const Chain& chain, int norm) {
    Adjoint wanted{.activation = t, .normalises = norm >= 0};
    for (int i = 0; i < norm; ++i) wanted.prefix.push(chain.steps[index(i)]);
    for (int p = 0; p < tape_.adjoint_count; ++p)
      if (adjoint(p).activation == t && adjoint(p).normalises == wanted.normalises &&
          same_prefix(adjoint(p).prefix, wanted.prefix))
        return p;
    if (tape_.adjoint_count == max_adjoints) throw "npt: a network is too large to train (max_adjoints)";
    adjoint(tape_.adjoint_count) = wanted;
    return tape_.adjoint_count++;
  }

  constexpr void assign_adjoints() {
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).path_count; ++r) {
        ReadPath& path = stage(i).paths[index(r)];
        if (activation(path.activation).pooled_from >= 0) continue;
        path.adjoint = adjoint_of(path.activation, path.chain, path.norm);
        adjoint(path.adjoint).dense = true;
        for (int s = 0; s < path.chain.count; ++s) {
          const int other = path.chain.steps[index(s)].other;
          if (other < 0) continue;
          path.other_adjoints[index(s)] = adjoint_of(other, Chain{}, -1);
          adjoint(path.other_adjoints[index(s)]).dense = adjoint(path.other_adjoints[index(s)]).starts_at_zero = true;
        }
      }
    for (int t = 0; t < tape_.activation_count; ++t)
      if (activation(t).pooled_from >= 0)
        activation(t).adjoint = adjoint_of(activation(t).pooled_from, activation(t).chain, activation(t).norm);
    // Rows of the operand come block by block, and in each block the paths in their order. Where one path's rows come
    // before those of an earlier one into the same adjoint, neither is the first for all of them.
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).path_count; ++r)
        for (int before = 0; before < r; ++before) {
          const ReadPath &first = stage(i).paths[index(before)], &second = stage(i).paths[index(r)];
          if (second.adjoint >= 0 && first.adjoint == second.adjoint && second.row < first.row)
            adjoint(second.adjoint).starts_at_zero = true;
        }
    std::array<bool, max_adjoints> open{};
    for (int p = 0; p < tape_.adjoint_count; ++p) open[index(p)] = adjoint(p).starts_at_zero;
    for (int i = tape_.stage_count - 1; i >= 0; --i)
      for (int r = 0; r < stage(i).path_count; ++r) {
        ReadPath& path = stage(i).paths[index(r)];
        if (path.adjoint < 0) continue;
        path.overwrites = !open[index(path.adjoint)];
        open[index(path.adjoint)] = true;
      }
  }

  constexpr void find_dead_biases() {
    for (int i = 0; i < tape_.stage_count; ++i) {
      bool dead = stage(i).product, used = false;
      for (int p = 0; p < tape_.adjoint_count; ++p)
        if (adjoint(p).activation == stage(i).output) {
          used = true;
          dead = dead && adjoint(p).normalises && adjoint(p).prefix.count == 0;
        }
      stage(i).bias_is_dead = dead && used;
    }
  }

  // ---- memory ----

  /// A buffer belongs to an adjoint from the last stage (the first backwards) that reads its activation to the stage
  /// that wrote it.
  constexpr void assign_buffers() {
    struct Life {
      int last = -1, first = 0;
    };
    std::array<Life, max_adjoints> lives{};
    for (int p = 0; p < tape_.adjoint_count; ++p) {
      const int writer = activation(adjoint(p).activation).stage;
      lives[index(p)] = {adjoint(p).starts_at_zero ? max_stages : -1, writer};
    }
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).path_count; ++r)
        if (const int p = stage(i).paths[index(r)].adjoint; p >= 0 && lives[index(p)].last < i)
          lives[index(p)].last = i;
    for (int p = 0; p < tape_.adjoint_count; ++p) {
      if (!adjoint(p).dense) continue;
      const auto side = static_cast<std::size_t>(activation(adjoint(p).activation).encoded ? 0 : 1);
      int b = 0;
      for (; b < tape_.buffer_count[side]; ++b) {
        bool free = true;
        for (int other = 0; other < p; ++other)
          if (adjoint(other).dense && adjoint(other).buffer == b &&
              activation(adjoint(other).activation).encoded == activation(adjoint(p).activation).encoded)
            free = free && (lives[index(other)].last < lives[index(p)].first ||
                            lives[index(p)].last < lives[index(other)].first);
        if (free) break;
      }
      adjoint(p).buffer = b;
      if (b == tape_.buffer_count[side]) ++tape_.buffer_count[side];
      int& widest = tape_.buffer_channels[side][index(b)];
      if (activation(adjoint(p).activation).channels > widest) widest = activation(adjoint(p).activation).channels;
    }
  }

  // ---- loops ----

  constexpr Signature& assign_signature(Chain& chain) {
    const graph::Signature operations = graph::signature_of(chain);
    int& count = tape_.signature_count;
    for (chain.signature = 0; chain.signature < count; ++chain.signature)
      if (Signature& known = tape_.signatures[index(chain.signature)]; known.operations == operations) return known;
    if (count == max_signatures) throw "npt: more than tape::max_signatures kinds of chains";
    tape_.signatures[index(count)].operations = operations;
    return tape_.signatures[index(count++)];
  }

  constexpr void assign_signatures() {
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).path_count; ++r) {
        ReadPath& path = stage(i).paths[index(r)];
        if (activation(path.activation).pooled_from >= 0) continue;
        Signature& signature = assign_signature(path.chain);
        (path.adds ? signature.adds : signature.reads) = true;
      }
    for (int t = 0; t < tape_.activation_count; ++t)
      if (activation(t).pooled_from >= 0) assign_signature(activation(t).chain).reads = true;
    for (int p = 0; p < tape_.adjoint_count; ++p)
      if (adjoint(p).normalises) {
        Signature& signature = assign_signature(adjoint(p).prefix);
        signature.finishes = true;
        signature.reads = true;
      }
  }

  constexpr void find_pairing() {
    for (int i = 0; i < tape_.stage_count; ++i) {
      if (stage(i).encodes) continue;
      for (int r = 0; r < stage(i).path_count; ++r) {
        const ReadPath& path = stage(i).paths[index(r)];
        const auto paired = [&](int t) { return activation(t).encoded && activation(t).pooled_from < 0; };
        if (paired(path.activation)) tape_.paired = true;
        graph::for_each_other(path.chain, [&](int other) { tape_.paired = tape_.paired || paired(other); });
      }
    }
  }

  const Graph& graph_;
  Tape tape_{};
  std::array<int, max_nodes> activation_of_{};
};

}  // namespace internal

constexpr Tape lower_to_tape(const Graph& graph) { return internal::Lowering(graph).run(); }

template <class Net>
inline constexpr Tape tape_of = lower_to_tape(graph::record(graph::bound_network<Net>));

}  // namespace npt::inline NPT_ABI::tape
