/// npt explain: what the network does, layer by layer and stage by stage.
#include "networks.hpp"
#include "subcommand.hpp"
#include "transfer_arguments.hpp"

#include <npt/io/safetensors.hpp>

#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>

namespace explain_command {

struct Options {
  program::NetworkOptions network;
  std::optional<int> bottleneck;
  std::size_t vertices = 6890;
};

const program::NetworkType& network_of(const Options& o) {
  if (o.network.weights)
    return npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(npt::SafetensorsFile::read(*o.network.weights),
                                                                     o.network.assume());
  return *program::find_network(
      {o.bottleneck.value_or(1024), o.network.order.value_or("conv_relu"), o.network.feature.value_or("per-vertex")});
}

void run(const Options& o) {
  const program::NetworkType& network = network_of(o);
  char line[160];
  std::snprintf(line, sizeof line,
                "%zu parameters; one transfer at %zu vertices is %.1f GFLOP by the plain algorithm.\n",
                program::parameter_count(network), o.vertices,
                2e-9 * network.program->multiply_adds * static_cast<double>(o.vertices));
  std::cout << npt::variant_name(network.variant) << '\n' << line << program::explain(network);
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  program::add_network_options(command, o->network);
  command.get_option("--weights")
      ->description("Explain the network of these weights (.safetensors) (default: the paper's network)");
  command
      .add_option("--bottleneck", o->bottleneck,
                  "Explain the network with this many channels in the pose feature, without weights")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->excludes("--weights");
  command.add_option("--vertices", o->vertices, "Count the work for this many vertices of the identity")
      ->check(CLI::Range(1, 100000000))
      ->capture_default_str();
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("explain", "Show a network's layers, stages, parameters and work", add);

}  // namespace explain_command
