/// How a command opens a pose transfer: which network, which weights, and what makes results better at the cost of
/// time. Shared by the subcommands that run or explain a network; docs/network-options.md has what the options gain.
#pragma once

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
  int threads = 0;  ///< 0: all that the process may use
};

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

/// Everything but the seed, whose meaning the commands describe.
inline void add_transfer_options(CLI::App& command, TransferArguments& arguments) {
  add_network_options(command, arguments.network);
  command
      .add_flag("--random-weights", arguments.random_weights,
                "Weights that know nothing, from --seed: to try everything but the transfer itself")
      ->excludes("--weights");
  command
      .add_option("--method", arguments.method,
                  "body: by body estimation, for people in any pose; network: by the pose transfer network; auto: by "
                  "body estimation where both meshes are recognised as people, else by the network")
      ->check(CLI::IsMember({"auto", "body", "network"}))
      ->capture_default_str();
  command
      .add_option(
          "--quality", arguments.quality,
          "Of body estimation: fast (about two thirds of the time), balanced, or best (all views of every mesh)")
      ->check(CLI::IsMember({"fast", "balanced", "best"}))
      ->capture_default_str();
  command.add_option("--threads", arguments.threads, "Threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command
      .add_option("--normalise", arguments.normalise,
                  "How meshes are brought to the network's coordinates; without: as the weights say")
      ->check(CLI::IsMember({"sphere", "centre", "none"}));
  command.add_option(
      "--unit", arguments.unit,
      "Of both meshes: metre, centimetre, millimetre, inch, foot, or metres as a number; without: inferred "
      "from their size, where the network asks for it");
  command
      .add_option(
          "--pairing", arguments.pairing,
          "How a network with the per-vertex feature meets the vertices of both meshes: random, as in training; "
          "as-given, by number, to compare with other implementations")
      ->check(CLI::IsMember({"random", "as-given"}))
      ->capture_default_str();
  command
      .add_option("--resample", arguments.resample,
                  "auto: bring the pose mesh to the identity's vertex count; off: refuse another count")
      ->check(CLI::IsMember({"auto", "off"}))
      ->capture_default_str();
  command.add_flag("--invariant", arguments.options.network.invariant,
                   "Permuting a mesh's vertices permutes the result bit for bit, and changes nothing else");
  command
      .add_option("--pairings", arguments.options.network.pairings,
                  "Average over so many random pairings of pose and identity vertices (per-vertex feature)")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command.add_flag("--mirror", arguments.options.network.mirror,
                   "Average with the transfer of the mirror images, left to right; for symmetric subjects");
  CLI::Option* refine =
      command.add_flag("--refine", arguments.refine, "Give results the identity's surface detail (needs Eigen)");
  command
      .add_option(
          "--refine-radius", arguments.options.refine_radius,
          "Detail below this size comes from the identity, as a fraction of the root of its area; without: as the "
          "weights say, or 0.04")
      ->check(CLI::Range(1e-6, 10.0))
      ->needs(refine);
}

}  // namespace program
