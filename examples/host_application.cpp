// A host application: one transfer, opened at start, shared by all of its threads, on meshes that the host holds in
// xtensor arrays.
//
//   host_application [--weights FILE] [--identity FILE --pose FILE] [--out FILE] [--threads N]
//
// Without meshes it makes two of the built-in mannequin, whose truth is known, and measures the error at the end.
// Without --weights it takes those that npt ships.
#include <npt/adapt/xtensor.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/npt.hpp>

#include "npt/shipped_weights.hpp"

#include <CLI/CLI.hpp>
#include <xtensor/xmath.hpp>
#include <xtensor/xview.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

namespace {

using Points = xt::xtensor<float, 2>;  // [V, 3]

struct Options {
  std::optional<std::filesystem::path> weights, identity, pose;
  std::filesystem::path out = "host_application.obj";
  int threads = 4;
};

class Stopwatch {
 public:
  /// Milliseconds since the last call.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What the host works on. The truth is known of mannequins only.
struct Scene {
  npt::Mesh identity_mesh;  // what its file holds beside positions and faces goes into the result
  npt::MeshTensors identity, pose;
  std::optional<Points> truth;
};

Scene read_scene(const Options& options) {
  if (options.identity) {
    const npt::Mesh identity = npt::read_mesh(*options.identity), pose = npt::read_mesh(*options.pose);
    return {identity, npt::to_tensors(identity), npt::to_tensors(pose), {}};
  }
  const auto shape = [](std::uint64_t seed) {
    npt::Random random(seed, 0);
    return npt::sample_shape(random, npt::mannequin().shape_count());
  };
  npt::Random draw(2, 1);
  const auto angles = npt::sample_pose(draw);
  const npt::Mesh identity = npt::to_mesh(npt::mannequin(), shape(1)),
                  pose = npt::to_mesh(npt::mannequin(), shape(2), angles),
                  truth = npt::to_mesh(npt::mannequin(), shape(1), angles);
  return {identity, npt::to_tensors(identity), npt::to_tensors(pose), npt::to_tensors(truth).positions};
}

/// The error of the paper (eq. 7): the mean squared distance of vertices, bounding boxes centred, in square metres.
double pmd(const Points& result, const Points& truth) {
  const auto centred = [](const Points& points) -> xt::xtensor<double, 2> {
    const xt::xtensor<double, 1> middle = (xt::amin(points, {0}) + xt::amax(points, {0})) / 2.0;
    return points - middle;
  };
  const xt::xtensor<double, 2> difference = centred(result) - centred(truth);
  return xt::mean(xt::sum(difference * difference, {1}))();
}

void expect_same(const Points& a, const Points& b, const char* what) {
  if (a != b) throw std::runtime_error(std::string("a different result ") + what);
}

void run(const Options& options) {
  npt::mesh_format(options.out);  // an unknown extension is an error now, not after the work
  Stopwatch watch;

  // 1. Weights: the file says which network it is of, how meshes are normalised, and in which unit it was trained. This
  // host wants the network, which takes tensors without faces and allocates nothing; without the option, people are
  // posed by body estimation.
  const auto transfer = npt::PoseTransfer::open(
      options.weights ? *options.weights : program::shipped_weights("per-vertex"), {.method = npt::Method::network});
  std::printf("Opened %s in %.0f ms.\n", transfer.description().c_str(), watch.lap());

  const Scene scene = read_scene(options);
  std::printf("Two meshes of %zu and %zu vertices in %.0f ms.\n", scene.identity.positions.shape()[0],
              scene.pose.positions.shape()[0], watch.lap());

  // 2. Tensors in, a tensor out. Faces go in by a view, without a copy: other vertex counts and refinement want them.
  const npt::MeshView identity = npt::view_of(scene.identity, "identity"), pose = npt::view_of(scene.pose, "pose");
  Points result = xt::empty_like(scene.identity.positions);
  transfer(identity, pose, npt::span_of(result));
  std::printf("First call: %.2f ms.\n", watch.lap());
  if (scene.identity.positions.shape() == scene.pose.positions.shape())
    expect_same(transfer(scene.identity.positions, scene.pose.positions), result, "from tensors without faces");
  watch.lap();

  // 3. Later calls of the same sizes allocate nothing.
  constexpr int calls = 10;
  for (int i = 0; i < calls; ++i) transfer(identity, pose, npt::span_of(result));
  std::printf("Warm call:  %.2f ms, mean of %d.\n", watch.lap() / calls, calls);

  // 4. What depends on one mesh only is prepared once: identities that take many poses, poses that many identities
  // take.
  const npt::Character hero = transfer.character(identity);
  const npt::Pose posed = transfer.pose(pose, hero.vertex_count());
  watch.lap();
  Points again = xt::empty_like(result);
  transfer.apply(hero, posed, npt::span_of(again));
  expect_same(again, result, "from prepared meshes");
  std::printf("Both prepared: %.2f ms.\n", watch.lap());

  // 5. The transfer is const: any number of host threads may call it at a time.
  std::vector<Points> of_thread(static_cast<std::size_t>(options.threads), xt::empty_like(result));
  {
    std::vector<std::jthread> threads;
    for (Points& out : of_thread)
      threads.emplace_back([&transfer, &hero, &posed, &out] { transfer.apply(hero, posed, npt::span_of(out)); });
  }
  for (const Points& out : of_thread) expect_same(out, result, "from another thread");
  std::printf("%d host threads at the same time: %.2f ms, the same bits from each.\n", options.threads, watch.lap());

  // 6. A batch goes through the network's sweeps together, which is what small meshes need.
  std::vector<Points> crowd(4, xt::empty_like(result));
  std::vector<npt::TransferJob> jobs;
  for (Points& out : crowd) jobs.push_back({identity, pose, npt::span_of(out)});
  transfer.run(jobs);
  for (const Points& out : crowd) expect_same(out, result, "in a batch");
  std::printf("Batch of %zu: %.2f ms, the same bits as one at a time.\n", crowd.size(), watch.lap());

  // 7. An error measure, and a mesh with all that the identity's file holds.
  if (scene.truth) {
    const double error = pmd(result, *scene.truth);
    std::printf("PMD %.2fe-4 m^2 (%.0f mm); the identity left as it is has %.0fe-4.\n", 1e4 * error,
                1000 * std::sqrt(error), 1e4 * pmd(scene.identity.positions, *scene.truth));
  }
  npt::Mesh mesh = scene.identity_mesh;
  std::copy(result.begin(), result.end(), mesh.coordinates().begin());
  npt::recompute_normals(mesh);
  npt::write_mesh(options.out, mesh);
  std::printf("Wrote %s.\n", options.out.string().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A host application: one transfer shared by threads, on meshes in xtensor arrays");
  Options options;
  app.add_option("--weights", options.weights, "Weights (.safetensors); without: those that npt ships");
  CLI::Option* identity =
      app.add_option("--identity", options.identity, "Mesh that gives the shape; without: mannequins");
  CLI::Option* pose = app.add_option("--pose", options.pose, "Mesh that gives the pose")->needs(identity);
  identity->needs(pose);
  app.add_option("--out", options.out, "Mesh to write, .obj or .ply")->capture_default_str();
  app.add_option("--threads", options.threads, "Host threads that transfer at the same time")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "host_application: %s\n", e.what());
    return 1;
  }
}
