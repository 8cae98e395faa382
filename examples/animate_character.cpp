// A host that animates a character: a GLB character and somebody else's clip in, an animated GLB out, with what a host
// does about confidence, warnings and errors.
//
//   animate_character CHARACTER.glb CLIP.glb [--clip NAME] [--fps RATE] [--out FILE.glb] [--keep FILE] [--weights FILE]
//
// Exit status: 0 a result, 1 an error, 2 a result that somebody has to look at. examples/animate.sh makes a character
// and a clip.
#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/npt.hpp>
#include <npt/transfer/animation.hpp>

#include "npt/shipped_weights.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>

namespace {

struct Options {
  std::filesystem::path character, motion, out = "animated.glb";
  std::optional<std::filesystem::path> weights, keep;
  std::optional<std::string> clip;
  double rate = 30;
};

/// Confidence for people: a percentage, or that there is none.
std::string text_of(const std::optional<double>& confidence) {
  return confidence ? npt::percent_text(*confidence) : std::string("none");
}

/// Prints each warning with what can be done about it. The code is what a host decides by; this one only stops.
void show(const npt::Warnings& warnings, const Options& options) {
  for (const npt::Warning& warning : warnings) {
    const std::string remedy = npt::text_of(warning.remedy);
    std::fprintf(stderr, "warning: %s%s%s\n",
                 npt::text_of(warning, options.character.string(), options.motion.string()).c_str(),
                 remedy.empty() ? "" : "; ", remedy.c_str());
  }
}

/// Whether the result may be used unseen.
bool run(const Options& options) {
  // 1. Once at start. The transfer is const: all threads of a host share it.
  const auto transfer =
      npt::PoseTransfer::open(options.weights ? *options.weights : program::shipped_weights("per-vertex"));

  // 2. Once for each character: its body is estimated, and its surface is bound to the body's joints.
  const npt::Mesh mesh = npt::read_mesh(options.character);
  const npt::Character hero = transfer.character(mesh, options.character.string());
  std::printf("%s: %zu vertices, confidence %s, skeleton: %s\n", options.character.string().c_str(),
              hero.vertex_count(), text_of(hero.confidence()).c_str(), hero.skeleton() ? "40 joints" : "none");
  // apply() refuses a character that isn't recognised; this says so before the clip is read.
  hero.expect_recognised();
  if (options.keep) hero.save(*options.keep);  // load_character() opens it without a new estimate

  // 3. For each clip. Frames are followed from one to the next, so that nothing flickers.
  npt::ClipFrames frames(npt::read_scene(options.motion), options.motion.string(),
                         {.clip = options.clip, .rate = options.rate});
  int shown = -1;
  const npt::Control control{.progress =
                                 [&shown](double done) {
                                   if (const int tenth = static_cast<int>(10 * done); tenth > shown)
                                     std::printf("%d %%\n", 10 * (shown = tenth));
                                 },
                             .stop = [] { return false; }};  // a host returns true to stop; animate() then throws
  const npt::Animation animation =
      npt::animate(transfer, hero, npt::frame_source(frames), true, npt::JointNames::vrm, control);

  // 4. The report is that of the frame with the lowest confidence.
  const npt::TransferReport& report = animation.report;
  std::printf("%zu frames by %s, lowest confidence %s in frame %zu\n", animation.positions.size(),
              report.method == npt::Method::body ? "body estimation" : "the network",
              text_of(report.confidence).c_str(), animation.weakest);
  show(report.warnings, options);

  // 5. A GLB with the character's own materials, a skeleton and the clip.
  npt::write_scene(options.out, npt::animation_scene(mesh, options.character.stem().string(), animation,
                                                     frames.clip_name(), frames.times()));
  std::printf("Wrote %s.\n", options.out.string().c_str());
  return report.warnings.empty();
}

/// What this host says of an error beside its message.
const char* advice(npt::ErrorCode code) {
  switch (code) {
    case npt::ErrorCode::not_recognised:
      return "no humanoid was found in this mesh; weights for its kind have to be trained";
    case npt::ErrorCode::unknown_unit:
      return "say the unit in TransferOptions::import.unit";
    case npt::ErrorCode::missing_weights:
      return "human-pooled.safetensors needs human.safetensors beside it";
    case npt::ErrorCode::stopped:
      return "stopped; nothing was written";
    default:
      return "the file or the argument has to be mended";
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A host that animates a GLB character by the clip of another GLB");
  Options options;
  app.add_option("character", options.character, "Character (.glb, .gltf, .obj, .ply)")->required();
  app.add_option("motion", options.motion, "File with the clip (.glb, .gltf)")->required();
  app.add_option("--clip", options.clip, "Name of the clip; without: the only one");
  app.add_option("--fps", options.rate, "Frames a second")->check(CLI::Range(0.001, 1000.0))->capture_default_str();
  app.add_option("--out", options.out, "Animated character (.glb)")->capture_default_str();
  app.add_option("--keep", options.keep, "Also save the estimated character (.safetensors)");
  app.add_option("--weights", options.weights, "Weights (.safetensors); without: those that npt ships");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options) ? 0 : 2;
  } catch (const npt::Error& e) {
    std::fprintf(stderr, "animate_character: %s (%s)\n", e.what(), advice(e.code()));
    return 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "animate_character: %s\n", e.what());
    return 1;
  }
}
