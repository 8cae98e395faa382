/// npt rig: a skeleton and skin weights for a person's mesh, and clips for it.
#include "arguments.hpp"
#include "subcommand.hpp"
#include "transfer_animation.hpp"
#include "transfer_arguments.hpp"

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

namespace rig_command {

struct Options {
  std::filesystem::path mesh, out;
  std::optional<std::filesystem::path> pose, page;
  program::TransferArguments transfer;
  program::AnimationArguments animation;
};

void run(Options& options) {
  options.transfer.method = "body";
  static constexpr std::array<std::string_view, 1> moving{".glb"};
  program::expect_extension(options.out, moving);
  if (!options.pose && options.page) throw CLI::RequiredError("--pose, for --view: npt view shows the rig");
  if (!options.pose && (options.animation.clip || options.animation.fps || options.animation.time))
    throw CLI::RequiredError("--pose, for --clip, --fps and --time");
  if (options.animation.time) throw CLI::ValidationError("--time", "asks for one pose: npt transfer writes it");
  if (!options.pose) return program::rig(options.mesh, options.out, options.animation, options.transfer);
  program::Animations one;
  one.jobs = {{options.mesh, *options.pose, options.out, {}, 0}};
  one.page = options.page;
  one.animation = options.animation;
  program::animate(one, options.transfer);
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command.add_option("--mesh", o->mesh, "Mesh of a person, in any pose (.ply, .obj, .glb, .fbx, ...)")->required();
  command.add_option("-o,--out", o->out, "The mesh with a skeleton of 40 joints and skin weights (.glb)")->required();
  command.add_option("--pose", o->pose, "Also put on a clip: a folder of poses, or a .glb or .fbx with --clip");
  program::add_animation_options(command, o->animation);
  command.add_option("--view", o->page, "Also write a page to look at the clip in a browser (.html)");
  command.add_option(
      "--unit", o->transfer.unit,
      "Of a mesh from .ply, .obj, .stl or .off: metre, centimetre, millimetre, inch, foot, or metres as a "
      "number; without: inferred from its size");
  command.add_option("--weights", o->transfer.network.weights,
                     "Weights (.safetensors); without: those shipped with npt");
  command.add_option("--threads", o->transfer.threads, "Threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("rig", "Give a person's mesh a skeleton and skin weights", add);

}  // namespace rig_command
