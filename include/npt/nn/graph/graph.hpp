/// Recorded networks: a graph of nodes, and the operations that they use as numbers and as types.
#pragma once

#include <npt/config.hpp>
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

/// Input 0 is the pose mesh, input 1 the identity mesh, both as [3, V] coordinates.
inline constexpr unsigned depends_on_pose = 1U;
inline constexpr unsigned depends_on_identity = 2U;

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

/// A recorded network: nodes in an order in which operands come first.
struct Graph {
  std::array<Node, max_nodes> nodes{};
  int count = 0;
  int output = -1;

  constexpr int add(const Node& node) {
    if (count == max_nodes) throw "npt: a network has more than graph::max_nodes nodes";
    nodes[static_cast<std::size_t>(count)] = node;
    return count++;
  }
  constexpr const Node& operator[](int n) const { return nodes[static_cast<std::size_t>(n)]; }
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

/// The nodes that the output is made of, and both inputs: what was recorded and is not used costs nothing.
constexpr Graph reaching_output(const Graph& all) {
  std::array<bool, max_nodes> reached{true, true};
  reached[static_cast<std::size_t>(all.output)] = true;
  for (int n = all.count - 1; n >= 0; --n)
    for (const int operand : {all[n].first, all[n].second})
      if (reached[static_cast<std::size_t>(n)] && operand >= 0) reached[static_cast<std::size_t>(operand)] = true;
  Graph graph;
  std::array<int, max_nodes> moved{};
  for (int n = 0; n < all.count; ++n) {
    if (!reached[static_cast<std::size_t>(n)]) continue;
    Node node = all[n];
    for (int* operand : {&node.first, &node.second})
      if (*operand >= 0) *operand = moved[static_cast<std::size_t>(*operand)];
    moved[static_cast<std::size_t>(n)] = graph.add(node);
  }
  graph.output = moved[static_cast<std::size_t>(all.output)];
  return graph;
}

}  // namespace npt::inline NPT_ABI::graph
