/// From a recorded network to a tape, in a constant expression.
///
/// 1. Every convolution becomes a stage that stores its output.
/// 2. Its routes are what its operand resolves to: stored tensors through pointwise layers; the parts of a concatenation side by side, those of
///    a sum on top of each other.
/// 3. What can't be read that way is gathered first, by a stage without a product: a sum with a layer behind it, a second norm in a
///    chain, an input of a conditioned layer that is no stored tensor. The network's result is gathered last.
/// 4. Each route gets the port into which its gradient goes; ports share buffers by lifetime.
#pragma once

#include <npt/config.hpp>
#include <npt/core/parameter.hpp>
#include <npt/graph/lower.hpp>
#include <npt/graph/tape.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::graph {

namespace internal {

class TapeLowering {
 public:
  constexpr explicit TapeLowering(const Graph& graph) : graph_(graph) {}

  constexpr Tape run() {
    for (int& t : tensor_of_) t = -1;
    for (int n = 0; n < 2; ++n)
      tensor_of_[index(n)] = add_tensor({.channels = graph_[n].channels, .from_pose = n == 0, .input = n});
    for (int n = 0; n < graph_.count; ++n)
      if (graph_[n].kind == NodeKind::conv) add_product(n);
    gather(graph_.output);
    assign_ports();
    find_dead_biases();
    assign_buffers();
    assign_signatures();
    find_pairing();
    count_work();
    return tape_;
  }

 private:
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
  constexpr TapeStage& stage(int i) { return tape_.stages[index(i)]; }
  constexpr TapeTensor& tensor(int i) { return tape_.tensors[index(i)]; }
  constexpr Port& port(int i) { return tape_.ports[index(i)]; }

  struct Operand {
    std::array<Route, max_routes> routes{};
    int count = 0;
    bool sum = false;  ///< some rows have several routes
    constexpr void push(const Route& route) {
      if (count == max_routes) throw "npt: more than graph::max_routes operands in one concatenation or sum";
      routes[index(count++)] = route;
    }
  };

  constexpr int add_tensor(const TapeTensor& t) {
    if (tape_.tensor_count == max_tape_tensors) throw "npt: a network has too many tensors to train (graph/tape.hpp)";
    tape_.tensors[index(tape_.tensor_count)] = t;
    return tape_.tensor_count++;
  }

  constexpr int add_stage(TapeStage s, const Operand& operand, bool from_pose) {
    if (tape_.stage_count == max_tape_stages) throw "npt: a network has too many stages to train (graph/tape.hpp)";
    s.route_count = operand.count;
    s.routes = operand.routes;
    s.from_pose = from_pose;
    int width = 0;
    for (int r = 0; r < s.route_count; ++r) {
      Route& route = s.routes[index(r)];
      if (tensor(route.tensor).pooled_from >= 0) {
        if (!s.product) throw "npt: a pooled feature must be read by a convolution where a network is trained";
        continue;
      }
      route.row = route.column;
      for (int other = 0; other < s.route_count; ++other) {
        const Route& before = s.routes[index(other)];
        if (tensor(before.tensor).pooled_from >= 0 && before.column < route.column) route.row -= before.channels;
      }
      if (route.row + route.channels > width) width = route.row + route.channels;
    }
    s.operand_rows = width;
    s.output = add_tensor({.channels = s.rows, .from_pose = from_pose, .stage = tape_.stage_count});
    stage(tape_.stage_count) = s;
    ++tape_.stage_count;
    return s.output;
  }

  constexpr void add_product(int n) {
    const Node& node = graph_[n];
    const Operand operand = resolve(node.first);
    tensor_of_[index(n)] = add_stage({.node = n,
                                      .weight = node.weight,
                                      .bias = node.bias,
                                      .rows = node.channels,
                                      .columns = graph_[node.first].channels},
                                     operand, node.depends == depends_on_pose);
  }

  /// Node n as a stored tensor.
  constexpr int gather(int n) {
    const Operand operand = resolve(n);
    const int channels = graph_[n].channels;
    tensor_of_[index(n)] = add_stage({.node = n, .product = false, .rows = channels, .columns = channels}, operand,
                                     graph_[n].depends == depends_on_pose);
    return tensor_of_[index(n)];
  }
  constexpr int stored(int n) { return tensor_of_[index(n)] >= 0 ? tensor_of_[index(n)] : gather(n); }

  constexpr Operand resolve(int n) {
    const Node& node = graph_[n];
    Operand operand;
    if (tensor_of_[index(n)] >= 0) {
      operand.push({.tensor = tensor_of_[index(n)], .channels = node.channels});
    } else if (node.kind == NodeKind::pointwise) {
      operand = resolve(node.first);
      bool must_gather = operand.sum;
      for (int r = 0; r < operand.count; ++r) {
        const Route& route = operand.routes[index(r)];
        must_gather = must_gather || (node.normalises && route.norm >= 0) || route.chain.count == max_chain;
        if (node.normalises && tensor(route.tensor).input >= 0) must_gather = true;
        // A port keeps what the layers in front of its norm do, but not the gradient of a second input of theirs.
        for (int s = 0; s < route.chain.count; ++s)
          must_gather = must_gather || (node.normalises && route.chain.steps[index(s)].other >= 0);
      }
      if (must_gather) {
        operand = {};
        operand.push({.tensor = gather(node.first), .channels = graph_[node.first].channels});
      }
      for (int r = 0; r < operand.count; ++r) {
        Route& route = operand.routes[index(r)];
        const Step step = step_of(node, route.column, route.channels);
        if (tensor(route.tensor).pooled_from >= 0) {
          route.tensor = behind_pool(route.tensor, step);
          continue;
        }
        if (node.normalises) route.norm = route.chain.count;
        route.chain.push(step);
      }
    } else if (node.kind == NodeKind::cat || node.kind == NodeKind::sum) {
      operand = resolve(node.first);
      const Operand second = resolve(node.second);
      const bool sum = node.kind == NodeKind::sum;
      operand.sum = operand.sum || second.sum || sum;
      for (int r = 0; r < second.count; ++r) {
        Route route = second.routes[index(r)];
        if (!sum) route.column += graph_[node.first].channels;
        route.adds = route.adds || sum;
        operand.push(route);
      }
      for (int r = 0; r < operand.count; ++r)
        if (sum && tensor(operand.routes[index(r)].tensor).pooled_from >= 0)
          throw "npt: a pooled feature can't be added to others where a network is trained";
    } else {
      operand.push({.tensor = pool(n), .channels = node.channels});
    }
    return operand;
  }

  constexpr Step step_of(const Node& node, int first, int channels) {
    Step step{.operation = node.operation, .normalises = node.normalises};
    if (node.second >= 0) step.other = stored(node.second);
    for (std::size_t i = 0; i < step.parameters.size(); ++i) {
      if (node.parameters[i] < 0) continue;
      const int size = node.parameter_sizes[i];
      const int a_channel = size % node.channels == 0 ? size / node.channels : 0;  // 0: not per channel
      step.parameters[i] = node.parameters[i] + first * a_channel;
      step.sizes[i] = a_channel == 0 ? size : channels * a_channel;
    }
    return step;
  }

  constexpr int pool(int n) {
    Operand operand = resolve(graph_[n].first);
    bool increasing = operand.count == 1 && tensor(operand.routes[0].tensor).stage >= 0;
    for (int m = graph_[n].first; increasing && tensor_of_[index(m)] < 0; m = graph_[m].first)
      increasing = graph_[m].increasing && graph_[m].second < 0;
    if (!increasing) {
      operand = {};
      operand.push({.tensor = gather(graph_[n].first), .channels = graph_[n].channels});
    }
    const Route& route = operand.routes[0];
    tensor_of_[index(n)] = add_tensor({.channels = graph_[n].channels,
                                       .from_pose = graph_[n].depends == depends_on_pose,
                                       .stage = tensor(route.tensor).stage,
                                       .pooled_from = route.tensor,
                                       .chain = route.chain,
                                       .norm = route.norm});
    return tensor_of_[index(n)];
  }

  /// As Lowering::behind_pool.
  constexpr int behind_pool(int t, const Step& step) {
    if (step.normalises || step.other >= 0)
      throw "npt: behind max_pool no layer may need values per vertex: instance_norm, or one that is conditioned on others";
    TapeTensor longer = tensor(t);
    longer.chain.push(step);
    for (int p = 0; p < tape_.tensor_count; ++p)
      if (tensor(p).pooled_from == longer.pooled_from && tensor(p).chain == longer.chain) return p;
    return add_tensor(longer);
  }

  // ---- ports ----

  static constexpr bool same_prefix(const Chain& a, const Chain& b) {
    bool same = a.count == b.count;
    for (int i = 0; same && i < a.count; ++i) {
      const Step& x = a.steps[index(i)];
      const Step& y = b.steps[index(i)];
      same = x.operation == y.operation && x.other == y.other && x.parameters == y.parameters;
    }
    return same;
  }

  constexpr int port_of(int t, const Chain& chain, int norm) {
    Port wanted{.tensor = t, .normalises = norm >= 0};
    for (int i = 0; i < norm; ++i) wanted.prefix.push(chain.steps[index(i)]);
    for (int p = 0; p < tape_.port_count; ++p)
      if (port(p).tensor == t && port(p).normalises == wanted.normalises && same_prefix(port(p).prefix, wanted.prefix))
        return p;
    if (tape_.port_count == max_ports) throw "npt: a network is too large to train (graph::max_ports)";
    port(tape_.port_count) = wanted;
    return tape_.port_count++;
  }

  constexpr void assign_ports() {
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).route_count; ++r) {
        Route& route = stage(i).routes[index(r)];
        if (tensor(route.tensor).pooled_from >= 0) continue;
        route.port = port_of(route.tensor, route.chain, route.norm);
        port(route.port).dense = true;
        for (int s = 0; s < route.chain.count; ++s) {
          const int other = route.chain.steps[index(s)].other;
          if (other < 0) continue;
          route.other_ports[index(s)] = port_of(other, Chain{}, -1);
          port(route.other_ports[index(s)]).dense = port(route.other_ports[index(s)]).starts_at_zero = true;
        }
      }
    for (int t = 0; t < tape_.tensor_count; ++t)
      if (tensor(t).pooled_from >= 0) tensor(t).port = port_of(tensor(t).pooled_from, tensor(t).chain, tensor(t).norm);
    // Rows of the operand come block by block, and in each block the routes in their order. Where one route's rows come
    // before those of an earlier one into the same port, neither is the first for all of them.
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).route_count; ++r)
        for (int before = 0; before < r; ++before) {
          const Route &first = stage(i).routes[index(before)], &second = stage(i).routes[index(r)];
          if (second.port >= 0 && first.port == second.port && second.row < first.row)
            port(second.port).starts_at_zero = true;
        }
    std::array<bool, max_ports> open{};
    for (int p = 0; p < tape_.port_count; ++p) open[index(p)] = port(p).starts_at_zero;
    for (int i = tape_.stage_count - 1; i >= 0; --i)
      for (int r = 0; r < stage(i).route_count; ++r) {
        Route& route = stage(i).routes[index(r)];
        if (route.port < 0) continue;
        route.opens = !open[index(route.port)];
        open[index(route.port)] = true;
      }
  }

  constexpr void find_dead_biases() {
    for (int i = 0; i < tape_.stage_count; ++i) {
      bool dead = stage(i).product, used = false;
      for (int p = 0; p < tape_.port_count; ++p)
        if (port(p).tensor == stage(i).output) {
          used = true;
          dead = dead && port(p).normalises && port(p).prefix.count == 0;
        }
      stage(i).bias_is_dead = dead && used;
    }
  }

  // ---- memory ----

  /// A buffer belongs to a port from the last stage (the first backwards) that reads its tensor to the stage that wrote it.
  constexpr void assign_buffers() {
    struct Life {
      int last = -1, first = 0;
    };
    std::array<Life, max_ports> lives{};
    for (int p = 0; p < tape_.port_count; ++p) {
      const int writer = tensor(port(p).tensor).stage;
      lives[index(p)] = {port(p).starts_at_zero ? max_tape_stages : -1, writer};
    }
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).route_count; ++r)
        if (const int p = stage(i).routes[index(r)].port; p >= 0 && lives[index(p)].last < i) lives[index(p)].last = i;
    for (int p = 0; p < tape_.port_count; ++p) {
      if (!port(p).dense) continue;
      const auto side = static_cast<std::size_t>(tensor(port(p).tensor).from_pose ? 0 : 1);
      int b = 0;
      for (; b < tape_.buffer_count[side]; ++b) {
        bool free = true;
        for (int other = 0; other < p; ++other)
          if (port(other).dense && port(other).buffer == b &&
              tensor(port(other).tensor).from_pose == tensor(port(p).tensor).from_pose)
            free = free && (lives[index(other)].last < lives[index(p)].first ||
                            lives[index(p)].last < lives[index(other)].first);
        if (free) break;
      }
      port(p).buffer = b;
      if (b == tape_.buffer_count[side]) ++tape_.buffer_count[side];
      int& widest = tape_.buffer_channels[side][index(b)];
      if (tensor(port(p).tensor).channels > widest) widest = tensor(port(p).tensor).channels;
    }
  }

  // ---- loops ----

  constexpr TapeSignature& sign(Chain& chain) {
    for (int s = 0; s < tape_.signature_count; ++s) {
      const Signature& known = tape_.signatures[index(s)].operations;
      bool same = known.count == chain.count;
      for (int c = 0; same && c < chain.count; ++c)
        same = known.operations[index(c)] == chain.steps[index(c)].operation;
      if (same) {
        chain.signature = s;
        return tape_.signatures[index(s)];
      }
    }
    if (tape_.signature_count == max_tape_signatures) throw "npt: more than graph::max_tape_signatures kinds of chains";
    TapeSignature& fresh = tape_.signatures[index(tape_.signature_count)];
    fresh.operations.count = chain.count;
    for (int c = 0; c < chain.count; ++c) fresh.operations.operations[index(c)] = chain.steps[index(c)].operation;
    chain.signature = tape_.signature_count++;
    return fresh;
  }

  constexpr void assign_signatures() {
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < stage(i).route_count; ++r) {
        Route& route = stage(i).routes[index(r)];
        if (tensor(route.tensor).pooled_from >= 0) continue;
        TapeSignature& signature = sign(route.chain);
        (route.adds ? signature.adds : signature.reads) = true;
      }
    for (int t = 0; t < tape_.tensor_count; ++t)
      if (tensor(t).pooled_from >= 0) sign(tensor(t).chain).reads = true;
    for (int p = 0; p < tape_.port_count; ++p)
      if (port(p).normalises) {
        TapeSignature& signature = sign(port(p).prefix);
        signature.finishes = true;
        signature.reads = true;
      }
  }

  constexpr void find_pairing() {
    for (int i = 0; i < tape_.stage_count; ++i) {
      if (stage(i).from_pose) continue;
      for (int r = 0; r < stage(i).route_count; ++r) {
        const Route& route = stage(i).routes[index(r)];
        const auto paired = [&](int t) { return t >= 0 && tensor(t).from_pose && tensor(t).pooled_from < 0; };
        if (paired(route.tensor)) tape_.paired = true;
        for (int s = 0; s < route.chain.count; ++s)
          if (paired(route.chain.steps[index(s)].other)) tape_.paired = true;
      }
    }
  }

  constexpr void count_work() {
    for (int n = 0; n < graph_.count; ++n) {
      const Node& node = graph_[n];
      if (node.kind == NodeKind::conv)
        tape_.multiply_adds += static_cast<double>(node.channels) * graph_[node.first].channels;
      if (node.kind == NodeKind::pointwise && node.second >= 0)
        tape_.multiply_adds += 2.0 * node.channels * graph_[node.second].channels;
    }
  }

  const Graph& graph_;
  Tape tape_{};
  std::array<int, max_nodes> tensor_of_{};
};

}  // namespace internal

constexpr Tape lower_to_tape(const Graph& graph) { return internal::TapeLowering(graph).run(); }

template <class Net>
inline constexpr Tape tape_of = lower_to_tape(record(bound_network<Net>));

}  // namespace npt::inline NPT_ABI::graph
