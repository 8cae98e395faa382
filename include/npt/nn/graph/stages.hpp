/// The first step of lowering: from a recorded network to stages, of which only what they compute is known.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/graph/program.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::graph {

namespace internal {

/// Makes stages and activations of a graph's nodes, in their order.
class StageBuilder {
 public:
  constexpr explicit StageBuilder(const Graph& graph) : graph_(graph) {}

  constexpr Program run() {
    count_uses();
    add_inputs();
    for (int n = 0; n < graph_.count; ++n)
      if (graph_[n].kind == NodeKind::conv) add_stage(n);
    program_.output = activation_of_[index(graph_.output)];
    if (program_.output < 0 || activation(program_.output).stage < 0)
      throw "npt: a network must end in a convolution, with activations that need no moments behind it";
    return program_;
  }

 private:
  constexpr Stage& stage(int i) { return program_.stage(i); }
  constexpr Activation& activation(int i) { return program_.activation(i); }

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
    program_.inputs = graph_.inputs;
    for (int n = 0; n < graph_.inputs.count; ++n)
      activation_of_[index(n)] = add_activation(
          {.channels = graph_[n].channels, .storage = Storage::input, .place = n, .encoded = graph_.is_encoded(n)});
  }

  /// The activation that a pointwise node is conditioned on; -1: none.
  constexpr int condition_of(const Node& node) const {
    if (node.second < 0) return -1;
    if (activation_of_[index(node.second)] < 0)
      throw "npt: a layer can only be conditioned on a network input or a stored activation";
    return activation_of_[index(node.second)];
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
        const Step step = graph::step_of(node, source.first, source.channels, condition_of(node));
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
    if (!increases_up_to(graph_, graph_[n].first, activation_of_))
      throw "npt: only increasing layers may stand between a convolution and max_pool";
    stage(activation(source.activation).stage).gathers_maxima = true;
    const int pooled = add_activation({.channels = graph_[n].channels,
                                       .storage = Storage::pooled,
                                       .stage = activation(source.activation).stage,
                                       .pooled_from = source.activation,
                                       .chain = source.chain,
                                       .encoded = graph_.is_encoded(n)});
    activation_of_[index(n)] = pooled;
    return pooled;
  }

  constexpr int behind_pool(int t, const Step& step) {
    Activation longer = activation(t);
    const int found = find_behind_pool(program_.activations, program_.activation_count, longer, step);
    return found >= 0 ? found : add_activation(longer);
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
    s.output = add_activation({.channels = s.rows, .stage = program_.stage_count, .encoded = graph_.is_encoded(out)});
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
        epilogue.push(graph::step_of(user, 0, user.channels, condition_of(user)));
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

  const Graph& graph_;
  Program program_{};
  std::array<int, max_nodes> uses_{};  ///< by node: how often it is read
  std::array<int, max_nodes> user_{};  ///< and the last node that does
  std::array<int, max_nodes> activation_of_{};
};

}  // namespace internal

/// Every convolution as a stage, with the pointwise layers in front of it in its sources' chains and those behind it in
/// its epilogue.
constexpr Program make_stages(const Graph& graph) { return internal::StageBuilder(graph).run(); }

}  // namespace npt::inline NPT_ABI::graph
