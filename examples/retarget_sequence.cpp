// Retargets a sequence: each pose is estimated once and given to several identities; meshes and a picture.
//
//   retarget_sequence [--weights FILE] [--out FOLDER] [--frames N] [--identities N]
//
// The sequence is the built-in mannequin between two random poses of the paper's Table 6; the identities are mannequins
// of other shapes. Without --weights it takes those that npt ships.
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/npt.hpp>

#include "npt/shipped_weights.hpp"

#include <render/png.hpp>
#include <render/render.hpp>

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace {

struct Options {
  std::optional<std::filesystem::path> weights;
  std::filesystem::path out = "retarget_sequence";
  int frames = 6, identities = 2, panel = 220;
};

std::vector<float> random_shape(std::uint64_t seed) {
  npt::Random random(seed, 0);
  return npt::sample_shape(random, npt::mannequin().shape_count());
}

/// Frames between two random poses. Joint angles are interpolated component by component: fine for a demonstration.
std::vector<npt::Mesh> make_sequence(int frames) {
  npt::Random first_draw(11, 1), last_draw(12, 1);
  const auto first = npt::sample_pose(first_draw), last = npt::sample_pose(last_draw);
  const std::vector<float> shape = random_shape(10);
  std::vector<npt::Mesh> sequence;
  for (int i = 0; i < frames; ++i) {
    const float t = frames == 1 ? 0.0F : static_cast<float>(i) / static_cast<float>(frames - 1);
    auto pose = first;
    for (std::size_t k = 0; k < pose.size(); ++k) pose[k] += t * (last[k] - first[k]);
    sequence.push_back(npt::to_mesh(npt::mannequin(), shape, pose));
  }
  return sequence;
}

std::string numbered(const char* what, std::size_t i, const char* extension) {
  char text[64];
  std::snprintf(text, sizeof text, "%s_%03zu%s", what, i, extension);
  return text;
}

void draw(const std::filesystem::path& file, const std::vector<npt::Mesh>& sequence,
          const std::vector<std::vector<npt::Mesh>>& results, int panel) {
  std::vector<render::Panel> panels;
  for (std::size_t i = 0; i < sequence.size(); ++i) panels.push_back({&sequence[i], numbered("pose", i, ""), {}});
  for (std::size_t k = 0; k < results.size(); ++k)
    for (const npt::Mesh& mesh : results[k])
      panels.push_back({&mesh, numbered("identity", k, ""), {render::parse_colour("blue", "colour")}});
  render::FigureOptions figure;
  figure.columns = static_cast<int>(sequence.size());
  figure.panel_width = panel;
  figure.panel_height = panel * 5 / 4;
  render::write_png(file, render::draw_figure(panels, figure));
}

void run(const Options& options) {
  using Clock = std::chrono::steady_clock;
  const auto ms_since = [](Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  };
  std::filesystem::create_directories(options.out);

  const auto transfer =
      npt::PoseTransfer::open(options.weights ? *options.weights : program::shipped_weights("per-vertex"));
  std::printf("Weights: %s\n", transfer.description().c_str());

  const std::vector<npt::Mesh> sequence = make_sequence(options.frames);
  std::vector<npt::Mesh> identities;
  for (int i = 0; i < options.identities; ++i)
    identities.push_back(npt::to_mesh(npt::mannequin(), random_shape(20 + static_cast<std::uint64_t>(i))));
  std::printf("%zu frames and %zu identities of %zu vertices.\n", sequence.size(), identities.size(),
              identities[0].vertex_count());

  // What depends only on the pose is computed once a frame, whoever takes it. The tracker follows the body from frame to
  // frame, and chooses the network's points once: chosen anew for each frame, they would make the results flicker.
  auto start = Clock::now();
  const std::vector<npt::Triangle> triangles = npt::triangulate(sequence[0]);
  npt::PoseTracker tracker(transfer);
  std::vector<npt::Pose> poses;
  for (const npt::Mesh& frame : sequence)
    poses.push_back(tracker.next({frame.coordinates(), triangles, "frame"}, identities[0].vertex_count()));
  std::printf("Estimated %zu poses in %.1f ms.\n", poses.size(), ms_since(start));

  start = Clock::now();
  std::vector<std::vector<npt::Mesh>> results(identities.size());
  for (std::size_t k = 0; k < identities.size(); ++k) {
    // The same for what depends only on the identity.
    const npt::Character character = transfer.character(identities[k]);
    for (const npt::Pose& pose : poses) results[k].push_back(transfer.apply(character, pose).mesh);
  }
  std::printf("Posed %zu meshes in %.1f ms.\n", identities.size() * poses.size(), ms_since(start));

  start = Clock::now();
  for (std::size_t k = 0; k < results.size(); ++k)
    for (std::size_t i = 0; i < results[k].size(); ++i)
      npt::write_mesh(options.out / (numbered("identity", k, "") + numbered("_frame", i, ".ply")), results[k][i]);
  draw(options.out / "sequence.png", sequence, results, options.panel);
  std::printf("Wrote the meshes and %s in %.1f ms.\n", (options.out / "sequence.png").string().c_str(),
              ms_since(start));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Gives a sequence of poses to other identities: meshes and a picture");
  Options options;
  app.add_option("--weights", options.weights, "Weights (.safetensors); without: those that npt ships");
  app.add_option("--out", options.out, "Folder for meshes and sequence.png")->capture_default_str();
  app.add_option("--frames", options.frames, "Poses of the sequence")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--identities", options.identities, "Bodies that take them")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--panel", options.panel, "Pixels across of each figure in the picture")
      ->check(CLI::Range(32, 1000))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "retarget_sequence: %s\n", e.what());
    return 1;
  }
}
