/// The arguments that choose a network, shared by the subcommands that run or explain one.
#pragma once

#include "transfer_backend.hpp"

#include <CLI/CLI.hpp>

namespace program {

inline void add_network_options(CLI::App& command, NetworkOptions& network) {
  command.add_option("--weights", network.weights, "Weights (.safetensors); without: those shipped with npt");
  command
      .add_option("--order", network.order,
                  "conv_relu (the paper) or relu_conv (its code); must agree with the weights")
      ->check(CLI::IsMember({"conv_relu", "relu_conv"}));
  command.add_option("--feature", network.feature, "per-vertex or pooled; must agree with the weights")
      ->check(CLI::IsMember({"per-vertex", "pooled"}));
  command.add_option("--output-scale", network.output_scale,
                     "Factor of the final tanh, for weights that don't say: 1 in the paper, 2 in its code");
}

}  // namespace program
