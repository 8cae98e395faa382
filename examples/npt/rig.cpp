/// npt rig: a skeleton and skin weights for the mesh of a person or a four-legged animal, and clips for it.
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
  one.animation.skeleton = "npt";
  program::animate(one, options.transfer);
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command
      .add_option("--mesh", o->mesh,
                  "Rig this mesh of a person or a four-legged animal, in any pose (.ply, .obj, .glb, .fbx, ...)")
      ->required();
  command
      .add_option("-o,--out", o->out,
                  "Write the mesh with skin weights and a skeleton to this file (.glb): a person's of 40 joints, an "
                  "animal's of 35")
      ->required();
  command.add_option("--pose", o->pose,
                     "Also give it a clip, from a folder of poses, or from a .glb or .fbx with --clip");
  program::add_animation_options(command, o->animation);
  command.add_option("--view", o->page, "Also write a page that shows the clip in a browser (.html)");
  command
      .add_option("--unit", o->transfer.unit,
                  "Take a mesh from .ply, .obj, .stl or .off to be in this unit: metre, centimetre, millimetre, inch, "
                  "foot, or a number of metres (default: inferred from its size)")
      ->type_name("UNIT");
  command.add_option("--weights", o->transfer.network.weights,
                     "Read the weights from this file (.safetensors) (default: those that npt ships)");
  program::add_figure_option(command, o->transfer);
  command.add_option("--threads", o->transfer.threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("rig", "Give a person's or an animal's mesh a skeleton and skin weights", add);

}  // namespace rig_command
