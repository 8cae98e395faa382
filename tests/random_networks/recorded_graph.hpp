/// A random composition as a graph that is recorded at run time.
#pragma once

#include <npt/nn/graph/expression.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/spadain.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <cstddef>
#include <string>
#include <vector>

#include "blend.hpp"
#include "composition.hpp"

namespace random_networks {

struct RecordedGraph {
  npt::graph::Graph graph;
  std::vector<npt::NamedParameter> parameters;
  int buffer_size = 0;
};

/// What an activation becomes: the library's own, as in TypedNetwork, or always the one with parameters.
enum class Operations { of_the_library, one_activation };

class Recorder {
 public:
  Recorder(const Composition& composition, Operations operations) : operations_(operations) {
    for (int i = 0; i < composition.inputs; ++i)
      made_.graph.add_input({.name = input_names[i], .channels = composition.channels_of(i)});
    for (int i = 0; i < composition.count; ++i) add(composition[i], "v" + std::to_string(i));
    made_.graph.output = made_.graph.count - 1;
  }
  RecordedGraph take() { return std::move(made_); }

 private:
  using Node = npt::graph::Node;
  using NodeKind = npt::graph::NodeKind;

  int parameter(const std::string& name, npt::Parameter p) {
    p.offset = made_.buffer_size;
    made_.buffer_size +=
        (p.size() + npt::parameter_alignment - 1) / npt::parameter_alignment * npt::parameter_alignment;
    made_.parameters.push_back({name, p});
    return p.offset;
  }
  template <class Op>
  static void become(Node& node) {
    node.kind = NodeKind::pointwise;
    node.operation = npt::graph::operation_id<Op>;
    node.normalises = Op::normalises;
    node.increasing = Op::increasing;
    node.per_channel = Op::per_channel;
  }

  void add(const Step& step, const std::string& name) {
    const npt::graph::Graph& graph = made_.graph;
    Node node;
    node.channels = step.channels;
    node.first = step.first;
    node.second = step.second;
    node.depends = graph[step.first].depends | (step.second < 0 ? 0U : graph[step.second].depends);
    const auto give = [&](std::size_t i, const std::string& which, const npt::Parameter& p) {
      node.parameters[i] = parameter(name + "." + which, p);
      node.parameter_sizes[i] = p.size();
    };
    switch (step.kind) {
      case Kind::conv:
        node.kind = NodeKind::conv;
        node.weight = parameter(name + ".weight", npt::Parameter(step.channels, graph[step.first].channels, 1));
        node.bias = parameter(name + ".bias", npt::Parameter(step.channels));
        break;
      case Kind::activation:
        if (operations_ == Operations::one_activation) {
          become<Blend>(node);
          give(0, "relu", npt::Parameter(1));
          give(1, "tanh", npt::Parameter(1));
        } else if (step.activation == 2) {
          become<npt::ScaledTanh>(node);
          give(0, "scale", npt::Parameter::number(1));
        } else {
          step.activation == 0 ? become<npt::Relu>(node) : become<npt::Tanh>(node);
        }
        break;
      case Kind::norm:
        become<npt::InstanceNorm>(node);
        break;
      case Kind::modulate: {
        const int conditions = graph[step.second].channels;
        conditions == 3 ? become<npt::Modulate<3>>(node) : become<npt::Modulate<5>>(node);
        give(0, "gamma.weight", npt::Parameter(step.channels, conditions, 1));
        give(1, "gamma.bias", npt::Parameter(step.channels));
        give(2, "beta.weight", npt::Parameter(step.channels, conditions, 1));
        give(3, "beta.bias", npt::Parameter(step.channels));
        break;
      }
      case Kind::sum:
        node.kind = NodeKind::sum;
        break;
      case Kind::cat:
        node.kind = NodeKind::cat;
        break;
      case Kind::max_pool:
        node.kind = NodeKind::max_pool;
        break;
    }
    made_.graph.add(node);
  }

  Operations operations_;
  RecordedGraph made_;
};

inline RecordedGraph record(const Composition& composition, Operations operations) {
  return Recorder(composition, operations).take();
}

}  // namespace random_networks
