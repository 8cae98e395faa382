/// Recorded networks: a graph of nodes, and the operations that they use as numbers and as types.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/inputs.hpp>
#include <npt/nn/kernel/pointwise.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>

namespace npt::inline NPT_ABI::graph {

inline constexpr int max_nodes = 128;

/// The identity of an operation type as a number; 0 is none. A hash of the type's name: addresses of variables would
/// do, but g++ 12 takes comparing them for no constant expression under -fsanitize=undefined.
using OperationId = std::uint64_t;

namespace internal {
template <class Op>
constexpr OperationId hash_type_name() {
  OperationId hash = 0xCBF29CE484222325U;  // FNV-1a
  for (const char c : std::string_view(__PRETTY_FUNCTION__))
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return hash;
}
}  // namespace internal

template <class Op>
inline constexpr OperationId operation_id = internal::hash_type_name<Op>();

enum class NodeKind : unsigned char { input, conv, pointwise, cat, sum, max_pool };

/// One node of a recorded network.
struct Node {
  NodeKind kind = NodeKind::input;
  int channels = 0;
  int first = -1;              ///< first operand
  int second = -1;             ///< second operand, or what a pointwise layer is conditioned on
  unsigned depends = 0;        ///< bit i: on the network's input i
  int weight = -1, bias = -1;  ///< conv: offsets in the parameter buffer
  OperationId operation = 0;   ///< pointwise
  bool normalises = false, increasing = false;
  std::array<int, kernel::max_pointwise_parameters> parameters{-1, -1, -1, -1};
  std::array<int, kernel::max_pointwise_parameters> parameter_sizes{};  ///< elements
  std::array<bool, kernel::max_pointwise_parameters> per_channel{};     ///< or shared by all channels
};

/// A recorded network: nodes in an order in which operands come first, the inputs before all others.
struct Graph {
  InputList inputs{};
  std::array<Node, max_nodes> nodes{};
  int count = 0;
  int output = -1;

  constexpr int add(const Node& node) {
    if (count == max_nodes) throw "npt: a network has more than graph::max_nodes nodes";
    nodes[static_cast<std::size_t>(count)] = node;
    return count++;
  }
  constexpr int add_input(const Input& input) {
    if (inputs.count == max_inputs) throw "npt: a network has more than graph::max_inputs inputs";
    for (int i = 0; i < inputs.count; ++i)
      if (std::string_view(inputs[i].name) == input.name) throw "npt: two inputs of a network have the same name";
    inputs.list[static_cast<std::size_t>(inputs.count)] = input;
    return add({.channels = input.channels, .depends = 1U << inputs.count++});
  }
  constexpr const Node& operator[](int n) const { return nodes[static_cast<std::size_t>(n)]; }
  /// Whether a node depends on the encoded input alone.
  constexpr bool is_encoded(int n) const { return inputs.encoded >= 0 && (*this)[n].depends == 1U << inputs.encoded; }
};

/// A set of operation types.
template <class... Ops>
struct OperationList {
  static constexpr int size = static_cast<int>(sizeof...(Ops));
};

/// Position of an operation in a list.
template <class... Ops>
constexpr std::size_t find_operation(OperationList<Ops...>, OperationId id) {
  std::size_t next = 0;
  std::size_t found = sizeof...(Ops);
  ((operation_id<Ops> == id ? found = next++ : next++), ...);
  return found;
}

template <std::size_t I, class List>
struct OperationAt;
template <std::size_t I, class... Ops>
struct OperationAt<I, OperationList<Ops...>> {
  using type = std::tuple_element_t<I, std::tuple<Ops...>>;
};

namespace internal {
template <class List, class Op>
struct Insert;
template <class... Ops, class Op>
struct Insert<OperationList<Ops...>, Op> {
  using type = std::conditional_t<(std::same_as<Ops, Op> || ...), OperationList<Ops...>, OperationList<Ops..., Op>>;
};
template <class A, class B>
struct Merge;
template <class A>
struct Merge<A, OperationList<>> {
  using type = A;
};
template <class A, class Op, class... Rest>
struct Merge<A, OperationList<Op, Rest...>> {
  using type = typename Merge<typename Insert<A, Op>::type, OperationList<Rest...>>::type;
};
}  // namespace internal

template <class A, class B>
using Merged = typename internal::Merge<A, B>::type;

/// The inputs (as bits) that meet each node vertex by vertex: what is read through a maximum doesn't.
constexpr std::array<unsigned, max_nodes> meeting_inputs(const Graph& graph) {
  std::array<unsigned, max_nodes> met{};
  for (int n = 0; n < graph.count; ++n) {
    const Node& node = graph[n];
    unsigned& bits = met[static_cast<std::size_t>(n)];
    if (node.kind == NodeKind::input) bits = node.depends;
    if (node.kind == NodeKind::max_pool) continue;
    for (const int operand : {node.first, node.second})
      if (operand >= 0) bits |= met[static_cast<std::size_t>(operand)];
  }
  return met;
}

/// The input that is encoded: the first one that a convolution reads alone, one that meets the result only through
/// maxima before others; else the first that isn't the only one to meet the result. -1: the network has one input.
constexpr int encoded_input(const Graph& graph) {
  if (graph.inputs.count < 2) return -1;
  const unsigned result = meeting_inputs(graph)[static_cast<std::size_t>(graph.output)];
  const auto read_alone = [&graph](unsigned bit) {
    for (int n = 0; n < graph.count; ++n)
      if (graph[n].kind == NodeKind::conv && graph[n].depends == bit) return true;
    return false;
  };
  int best = -1, best_rank = 0;
  for (int i = 0; i < graph.inputs.count; ++i) {
    const unsigned bit = 1U << i;
    if (result == bit) continue;
    const int rank = !read_alone(bit) ? 1 : (result & bit) != 0 ? 2 : 3;
    if (rank > best_rank) best = i, best_rank = rank;
  }
  return best;
}

/// The nodes that the output is made of, and all inputs: what was recorded and is not used costs nothing.
constexpr Graph reaching_output(const Graph& all) {
  std::array<bool, max_nodes> reached{};
  for (int i = 0; i < all.inputs.count; ++i) reached[static_cast<std::size_t>(i)] = true;
  reached[static_cast<std::size_t>(all.output)] = true;
  for (int n = all.count - 1; n >= 0; --n)
    for (const int operand : {all[n].first, all[n].second})
      if (reached[static_cast<std::size_t>(n)] && operand >= 0) reached[static_cast<std::size_t>(operand)] = true;
  Graph graph;
  graph.inputs = all.inputs;
  std::array<int, max_nodes> moved{};
  for (int n = 0; n < all.count; ++n) {
    if (!reached[static_cast<std::size_t>(n)]) continue;
    Node node = all[n];
    for (int* operand : {&node.first, &node.second})
      if (*operand >= 0) *operand = moved[static_cast<std::size_t>(*operand)];
    moved[static_cast<std::size_t>(n)] = graph.add(node);
  }
  graph.output = moved[static_cast<std::size_t>(all.output)];
  graph.inputs.encoded = encoded_input(graph);
  return graph;
}

}  // namespace npt::inline NPT_ABI::graph
