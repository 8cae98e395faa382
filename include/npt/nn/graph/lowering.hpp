/// What the lowerings to a program (nn/graph/lower.hpp) and to a tape (nn/tape/lower.hpp) share.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/program.hpp>

#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::graph {

constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// A pointwise node as a step of a chain that is applied to `channels` of the node's channels, from `first` on.
/// `other`: the activation that it is conditioned on, or -1.
constexpr Step step_of(const Node& node, int first, int channels, int other) {
  Step step{.operation = node.operation, .normalises = node.normalises, .other = other};
  for (std::size_t i = 0; i < step.parameters.size(); ++i) {
    if (node.parameters[i] < 0) continue;
    const int size = node.parameter_sizes[i];
    const int a_channel = node.per_channel[i] ? size / node.channels : 0;
    step.parameters[i] = node.parameters[i] + first * a_channel;
    step.sizes[i] = node.per_channel[i] ? channels * a_channel : size;
    step.per_channel[i] = node.per_channel[i];
  }
  return step;
}

/// Whether a maximum over the vertices may be taken before node n instead of behind it: all layers between n and an
/// activation (activation_of[node] >= 0) are increasing, and the same at every vertex.
constexpr bool increases_up_to(const Graph& graph, int n, const std::array<int, max_nodes>& activation_of) {
  for (; activation_of[index(n)] < 0; n = graph[n].first)
    if (!graph[n].increasing || graph[n].second >= 0) return false;
  return true;
}

/// The activation that is pooled activation t with one more layer behind it, which the pooled values go through like
/// those in front of max_pool: one of `count`, or -1. The chain of `longer`, a copy of t, gets the layer.
template <class Activations, class A>
constexpr int find_behind_pool(const Activations& activations, int count, A& longer, const Step& step) {
  if (step.normalises || step.other >= 0)
    throw "npt: behind max_pool no layer may need values per vertex: instance_norm, or one that is conditioned";
  longer.chain.push(step);
  for (int p = 0; p < count; ++p)
    if (activations[index(p)].pooled_from == longer.pooled_from && activations[index(p)].chain == longer.chain)
      return p;
  return -1;
}

constexpr Signature signature_of(const Chain& chain) {
  Signature signature{.count = chain.count};
  for (int c = 0; c < chain.count; ++c) signature.operations[index(c)] = chain.steps[index(c)].operation;
  return signature;
}

/// Calls f(activation) for every activation that a chain's steps read beside their input.
template <class F>
constexpr void for_each_other(const Chain& chain, F&& f) {
  for (int c = 0; c < chain.count; ++c)
    if (chain.steps[index(c)].other >= 0) f(chain.steps[index(c)].other);
}

/// A vertex's multiply-adds by the plain algorithm: every convolution, SPAdaIN's included.
constexpr double multiply_adds(const Graph& graph) {
  double sum = 0;
  for (int n = 0; n < graph.count; ++n) {
    const Node& node = graph[n];
    if (node.kind == NodeKind::conv) sum += static_cast<double>(node.channels) * graph[node.first].channels;
    if (node.kind == NodeKind::pointwise && node.second >= 0) sum += 2.0 * node.channels * graph[node.second].channels;
  }
  return sum;
}

}  // namespace npt::inline NPT_ABI::graph
