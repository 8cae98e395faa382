/// Expressions: what `points | e1 | instance_norm | relu` is.
///
/// The *type* of an expression holds its shape and the set of pointwise operations used so far, so that a wrong shape
/// is a compile error at the place where it is written and every operation can be compiled into a stage's loop. The
/// *value* names a node of a graph that is recorded in a constant expression: a network's operator() runs at compile
/// time, once. Using an expression twice (a residual block does) names the same node twice; nothing is computed twice.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/layer/max_pool.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <concepts>
#include <cstddef>
#include <iterator>
#include <type_traits>
#include <utility>

namespace npt::inline NPT_ABI {

/// Whether an expression has a value for each vertex or, after max_pool, one for the whole mesh.
enum class Extent { vertices, mesh };

/// C channels over the vertices (or for the mesh), using the pointwise operations Ops.
template <int C, Extent E, class Ops>
struct Expression {
  static constexpr int channels = C;
  static constexpr Extent extent = E;
  using Operations = Ops;

  graph::Graph* graph;
  int node;
};

template <class X>
inline constexpr bool is_expression = false;
template <int C, Extent E, class Ops>
inline constexpr bool is_expression<Expression<C, E, Ops>> = true;

/// A pointwise layer: an operation, or a layer with parameters that names its Operation.
template <class L>
concept PointwiseLayer = std::derived_from<L, kernel::Pointwise> || requires {
  typename L::Operation;
};

namespace graph {

/// The checks are functions so that a mismatch is one error, which shows both numbers, in g++ and in clang++.
template <int Given, int Wanted>
constexpr bool check_channels() {
  static_assert(Given == Wanted,
                "npt: the channels of this expression (Given) differ from what the layer takes (Wanted)");
  return true;
}
template <int Left, int Right>
constexpr bool check_sum() {
  static_assert(Left == Right, "npt: only expressions of equal channel counts can be added (Left, Right)");
  return true;
}
template <Extent E>
constexpr bool check_per_vertex() {
  static_assert(E == Extent::vertices, "npt: this layer needs values per vertex, but the expression was pooled");
  return true;
}

template <class L>
constexpr bool is_conv = false;
template <int Cin, int Cout>
constexpr bool is_conv<Conv1x1<Cin, Cout>> = true;

namespace internal {
template <class L>
struct OperationOf {
  using type = L;
};
template <class L>
requires requires { typename L::Operation; }
struct OperationOf<L> {
  using type = typename L::Operation;
};

template <int C, class L>
constexpr Node pointwise_node(const Graph& graph, int operand, const L& layer, int condition = -1) {
  using Op = typename OperationOf<L>::type;
  Node node{.kind = NodeKind::pointwise, .channels = C, .first = operand, .second = condition};
  node.depends = graph[operand].depends | (condition < 0 ? 0U : graph[condition].depends);
  node.operation = operation_id<Op>;
  node.normalises = Op::normalises;
  node.increasing = Op::increasing;
  if constexpr (requires { L::visit(layer, [](const char*, const auto&) {}); }) {
    int count = 0;
    for_each_parameter(layer, [&](const Parameter& p) {
      node.parameters[static_cast<std::size_t>(count)] = p.offset;
      node.parameter_sizes[static_cast<std::size_t>(count)] = p.size();
      if (Op::per_channel[static_cast<std::size_t>(count)] && p.size() % C != 0)
        throw "npt: a parameter whose size is no multiple of the channels: shared ones need per_channel (nn/kernel/pointwise.hpp)";
      ++count;
    });
    node.per_channel = Op::per_channel;
  }
  return node;
}
}  // namespace internal

template <class L>
using Operation = typename internal::OperationOf<L>::type;

}  // namespace graph

/// x | conv
template <int C, Extent E, class Ops, int Cin, int Cout>
constexpr Expression<Cout, Extent::vertices, Ops> operator|(Expression<C, E, Ops> x, const Conv1x1<Cin, Cout>& conv) {
  if constexpr (graph::check_channels<C, Cin>() && graph::check_per_vertex<E>()) {
  }
  const int node = x.graph->add({.kind = graph::NodeKind::conv,
                                 .channels = Cout,
                                 .first = x.node,
                                 .depends = (*x.graph)[x.node].depends,
                                 .weight = conv.weight.offset,
                                 .bias = conv.bias.offset});
  return {x.graph, node};
}

/// x | pointwise layer
template <int C, Extent E, class Ops, PointwiseLayer L>
constexpr auto operator|(Expression<C, E, Ops> x, const L& layer) {
  if constexpr (requires { L::channels; }) {
    if constexpr (graph::check_channels<C, L::channels>()) {
    }
  }
  using Joined = Expression<C, E, graph::Merged<Ops, graph::OperationList<graph::Operation<L>>>>;
  return Joined{x.graph, x.graph->add(graph::internal::pointwise_node<C>(*x.graph, x.node, layer))};
}

/// x | tanh, which is the name of a function.
template <int C, Extent E, class Ops>
constexpr auto operator|(Expression<C, E, Ops> x, Tanh (*layer)()) {
  return x | layer();
}

/// A pointwise layer that also reads `condition` at the same vertex.
template <int C, Extent E, class Ops, PointwiseLayer L, int D, class More>
constexpr auto conditioned(Expression<C, E, Ops> x, const L& layer, Expression<D, Extent::vertices, More> condition) {
  if constexpr (graph::check_channels<C, L::channels>() && graph::check_per_vertex<E>()) {
  }
  using All = graph::Merged<graph::Merged<Ops, More>, graph::OperationList<graph::Operation<L>>>;
  return Expression<C, E, All>{
      x.graph, x.graph->add(graph::internal::pointwise_node<C>(*x.graph, x.node, layer, condition.node))};
}

/// x | max_pool
template <int C, Extent E, class Ops>
constexpr Expression<C, Extent::mesh, Ops> operator|(Expression<C, E, Ops> x, MaxPool) {
  if constexpr (graph::check_per_vertex<E>()) {
  }
  const int node = x.graph->add(
      {.kind = graph::NodeKind::max_pool, .channels = C, .first = x.node, .depends = (*x.graph)[x.node].depends});
  return {x.graph, node};
}

/// a + b, elementwise: the residual connection.
template <int A, int B, class OpsA, class OpsB>
constexpr auto operator+(Expression<A, Extent::vertices, OpsA> a, Expression<B, Extent::vertices, OpsB> b) {
  if constexpr (graph::check_sum<A, B>()) {
  }
  using Ops = graph::Merged<graph::Merged<OpsA, OpsB>, graph::OperationList<kernel::AddTile>>;
  const unsigned depends = (*a.graph)[a.node].depends | (*b.graph)[b.node].depends;
  return Expression<A, Extent::vertices, Ops>{
      a.graph,
      a.graph->add(
          {.kind = graph::NodeKind::sum, .channels = A, .first = a.node, .second = b.node, .depends = depends})};
}

/// cat(a, b): the channels of a, then those of b. A pooled operand is the same at every vertex of the other.
template <int A, int B, Extent EA, Extent EB, class OpsA, class OpsB>
constexpr auto cat(Expression<A, EA, OpsA> a, Expression<B, EB, OpsB> b) {
  constexpr Extent extent = EA == Extent::mesh && EB == Extent::mesh ? Extent::mesh : Extent::vertices;
  const unsigned depends = (*a.graph)[a.node].depends | (*b.graph)[b.node].depends;
  return Expression<A + B, extent, graph::Merged<OpsA, OpsB>>{
      a.graph,
      a.graph->add(
          {.kind = graph::NodeKind::cat, .channels = A + B, .first = a.node, .second = b.node, .depends = depends})};
}

namespace graph {

namespace internal {

template <int C>
using InputExpression = Expression<C, Extent::vertices, OperationList<>>;

template <class Net>
inline constexpr bool lists_inputs = requires {
  Net::inputs;
};

/// Stands in for a network without a list, so that this is one error.
struct TwoInputs {
  static constexpr Input inputs[] = {{"first", 3}, {"second", 3}};
};
template <class Net>
using InputsOf = std::conditional_t<lists_inputs<Net>, Net, TwoInputs>;

/// Calls the network with an expression for each of its inputs, which are the graph's first nodes.
template <class Net>
constexpr auto call(const Net& net, Graph* graph) {
  static_assert(lists_inputs<Net>,
                R"(npt: a network lists its inputs, as in: static constexpr npt::Input inputs[] = {{"points", 3}};)");
  return [&]<std::size_t... I>(std::index_sequence<I...>) {
    return net(InputExpression<InputsOf<Net>::inputs[I].channels>{graph, static_cast<int>(I)}...);
  }
  (std::make_index_sequence<std::size(InputsOf<Net>::inputs)>{});
}

}  // namespace internal

/// The type of a network's result, which names all operations that its graph uses.
template <class Net>
using ResultOf = decltype(internal::call(std::declval<const Net&>(), nullptr));

/// Runs the network on symbols and keeps what reaches its output. Its parameters must be bound.
template <class Net>
constexpr Graph record(const Net& net) {
  Graph graph;
  for (const Input& input : internal::InputsOf<Net>::inputs) graph.add_input(input);
  const auto result = internal::call(net, &graph);
  if constexpr (check_channels<decltype(result)::channels, 3>() && check_per_vertex<decltype(result)::extent>()) {
  }
  graph.output = result.node;
  return reaching_output(graph);
}

}  // namespace graph
}  // namespace npt::inline NPT_ABI
