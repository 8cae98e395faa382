/// npt explain: what the network does, layer by layer and stage by stage.
#include "network_arguments.hpp"
#include "subcommand.hpp"
#include "transfer_backend.hpp"

#include <iostream>
#include <memory>
#include <optional>

namespace explain_command {

struct Options {
  program::NetworkOptions network;
  std::optional<int> bottleneck;
  std::size_t vertices = 6890;
};

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  program::add_network_options(command, o->network);
  command.add_option("--bottleneck", o->bottleneck, "Channels of the pose feature: 1024, 512, 256, 128 or 64")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->excludes("--weights");
  command.add_option("--vertices", o->vertices, "Vertices of the identity mesh")
      ->check(CLI::Range(1, 100000000))
      ->capture_default_str();
  command.callback([o] { std::cout << program::explain_network(o->network, o->bottleneck, o->vertices); });
}

const program::Subcommand registered("explain", "Show the network's layers, stages, parameters and work", add);

}  // namespace explain_command
