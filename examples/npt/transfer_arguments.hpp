/// How a command opens a pose transfer: which network, which weights, and what makes results better at the cost of
/// time. Shared by the subcommands that run or explain a network; docs/network-options.md has what the options gain.
#pragma once

#include "path_option.hpp"

#include <npt/transfer/options.hpp>

#include <CLI/CLI.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace program {

/// Which network. What is not given comes from the weights' metadata, or without weights is the default.
struct NetworkOptions {
  std::optional<std::filesystem::path> weights;  ///< none: those shipped with the project
  std::optional<std::string> order;              ///< "conv_relu" or "relu_conv"
  std::optional<std::string> feature;            ///< "per-vertex" or "pooled"
  std::optional<double> output_scale;            ///< of the final tanh: 1 in the paper, 2 in its code

  /// Values for metadata that a weights file lacks.
  npt::Metadata assume() const {
    npt::Metadata metadata;
    if (order) metadata["order"] = *order;
    if (feature) metadata["feature"] = *feature;
    if (output_scale) metadata["output_scale"] = npt::number_text(*output_scale);
    return metadata;
  }
};

struct TransferArguments {
  NetworkOptions network;
  npt::TransferOptions options;
  std::optional<std::string> normalise, unit;
  std::string pairing = "random", resample = "auto", method = "auto", quality = "balanced";
  bool refine = false, random_weights = false;
  bool can_be_random = false;  ///< whether the command has --random-weights
  int threads = 0;             ///< 0: all that the process may use
};

inline void add_network_options(CLI::App& command, NetworkOptions& network) {
  command.add_option("--weights", network.weights,
                     "Read the weights from this file (.safetensors) (default: those that npt ships)");
  command
      .add_option(
          "--order", network.order,
          "Expect layers in this order: conv_relu (the paper) or relu_conv (its code) (default: as the weights say)")
      ->check(CLI::IsMember({"conv_relu", "relu_conv"}));
  command.add_option("--feature", network.feature, "Expect this pose feature (default: as the weights say)")
      ->check(CLI::IsMember({"per-vertex", "pooled"}));
  command.add_option(
      "--output-scale", network.output_scale,
      "Multiply the network's last tanh by this: 1 in the paper, 2 in its code (default: as the weights say)");
}

inline void add_figure_option(CLI::App& command, TransferArguments& arguments) {
  command
      .add_option("--figure", arguments.options.body.figure,
                  "Take this one of several figures in a mesh: 1 is the one with the most vertices (default: the one "
                  "that is recognised)")
      ->check(CLI::Range(1, 4096));
}

/// Everything but the seed, whose meaning the commands describe.
inline void add_transfer_options(CLI::App& command, TransferArguments& arguments) {
  add_network_options(command, arguments.network);
  arguments.can_be_random = true;
  command
      .add_flag("--random-weights", arguments.random_weights,
                "Draw random weights from --seed, to test a pipeline: results are no pose transfers")
      ->excludes("--weights");
  command
      .add_option("--method", arguments.method,
                  "Make results by body estimation, whatever the meshes are (body), by the pose transfer network "
                  "(network), or by body estimation of meshes that are recognised; others are refused (auto)")
      ->check(CLI::IsMember({"auto", "body", "network"}))
      ->capture_default_str();
  command
      .add_option("--quality", arguments.quality,
                  "Estimate bodies fast, balanced, or best, which looks at all views of every mesh and takes longest")
      ->check(CLI::IsMember({"fast", "balanced", "best"}))
      ->capture_default_str();
  add_figure_option(command, arguments);
  command.add_option("--threads", arguments.threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command
      .add_option(
          "--normalise", arguments.normalise,
          "Bring meshes to the network's coordinates in this way: sphere, centre or none (default: as the weights say)")
      ->check(CLI::IsMember({"sphere", "centre", "none"}));
  command
      .add_option("--unit", arguments.unit,
                  "Take both meshes to be in this unit: metre, centimetre, millimetre, inch, foot, or a number of "
                  "metres (default: inferred from their size where it matters)")
      ->type_name("UNIT");
  command
      .add_option(
          "--pairing", arguments.pairing,
          "Pair the vertices of both meshes, in networks with the per-vertex feature, at random as in training, or by "
          "number (as-given), to compare with other implementations; as-given implies --method network")
      ->check(CLI::IsMember({"random", "as-given"}))
      ->capture_default_str();
  command
      .add_option("--resample", arguments.resample,
                  "Bring the pose mesh to the identity's vertex count (auto), or refuse another count (off)")
      ->check(CLI::IsMember({"auto", "off"}))
      ->capture_default_str();
  command.add_flag("--invariant", arguments.options.network.invariant,
                   "Make results independent of the order of vertices, to the last bit");
  command
      .add_option("--pairings", arguments.options.network.pairings,
                  "Average the network's results over this many random pairings of vertices (per-vertex feature)")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command.add_flag("--mirror", arguments.options.network.mirror,
                   "Average the network's result with that of the mirrored meshes, for symmetric subjects");
  CLI::Option* refine = command.add_flag("--refine", arguments.refine,
                                         "Give results the identity's surface detail (needs a build with Eigen)");
  command
      .add_option("--refine-radius", arguments.options.refine_radius,
                  "Take detail below this size from the identity, as a fraction of the square root of its area "
                  "(default: as the weights say, or 0.04)")
      ->check(CLI::Range(1e-6, 10.0))
      ->needs(refine);
}

}  // namespace program
