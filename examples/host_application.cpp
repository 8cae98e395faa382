// A host application: one engine, made at start, shared by all of its threads, working on memory that the host owns.
//
//   host_application [--weights FILE] [--out FILE] [--threads N]
//
// The network is the paper's with a bottleneck of 128 instead of 1024, so that the example takes no time; a host that loads the
// paper's own weights writes npt::PoseTransferNet<>. Without --weights they are random, and random weights transfer no pose.
#include <npt/body/pose_sampler.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mannequin/mannequin.hpp>
#include <npt/npt.hpp>

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <vector>

namespace {

using Net = npt::PoseTransferNet<128>;

struct Options {
  std::filesystem::path weights, out = "host_application.obj";
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

/// The mannequin in a random shape and pose.
npt::Mesh random_body(std::uint64_t seed) {
  npt::Random shape(seed, 0), pose(seed, 1);
  return npt::to_mesh(npt::mannequin(), npt::sample_shape(shape, npt::mannequin().shape_count()),
                      npt::sample_pose(pose));
}

void expect_same(const std::vector<float>& a, const std::vector<float>& b, const char* what) {
  if (a != b) throw std::runtime_error(std::string("a different result ") + what);
}

void run(const Options& options) {
  npt::mesh_format(options.out);  // an unknown extension is an error now, not after the work
  Stopwatch watch;

  // Weights live in a model. An engine packs them once; the model can go afterwards.
  npt::Model<Net> model;
  if (options.weights.empty()) {
    npt::randomise(model, 1);
    std::puts("Weights: random. The result shows that everything runs; it is no pose transfer.");
  } else {
    npt::load(model, options.weights);  // names every missing or misshapen tensor at once
    std::printf("Weights: %s\n", options.weights.string().c_str());
  }
  watch.lap();
  const npt::Engine engine(model);
  std::printf("Engine packed in %.1f ms, %.1f MB of weights.\n", watch.lap(),
              static_cast<double>(engine.weight_bytes()) / 1e6);

  // The host's own meshes, as it has them: three floats a vertex. The network sees them centred.
  const npt::Mesh identity_mesh = random_body(1), pose_mesh = random_body(2);
  const npt::IdentityInput identity = npt::identity_input(identity_mesh.coordinates(), {});
  const std::vector<float> pose = npt::pose_input(pose_mesh.coordinates(), {}, 0, {});
  std::printf("Two mannequins of %zu vertices made in %.0f ms.\n", identity_mesh.vertex_count(), watch.lap());

  // Borrowed memory: spans in, a span out. The first call sizes a workspace; later ones of the same size allocate nothing.
  std::vector<float> result(identity.coordinates.size());
  engine(pose, identity.coordinates, result);
  std::printf("First call: %.2f ms.\n", watch.lap());
  constexpr int calls = 20;
  for (int i = 0; i < calls; ++i) engine(pose, identity.coordinates, result);
  std::printf("Warm call:  %.2f ms, mean of %d.\n", watch.lap() / calls, calls);

  // The engine is const: any number of host threads may call it at a time, each gets a workspace from its pool.
  std::vector<std::vector<float>> of_thread(static_cast<std::size_t>(options.threads),
                                            std::vector<float>(result.size()));
  {
    std::vector<std::jthread> threads;
    for (std::vector<float>& out : of_thread)
      threads.emplace_back([&engine, &pose, &identity, &out] { engine(pose, identity.coordinates, out); });
  }
  for (const std::vector<float>& out : of_thread) expect_same(out, result, "from another thread");
  std::printf("%d host threads at the same time: %.2f ms, the same bits from each.\n", options.threads, watch.lap());

  // A batch goes through the same sweeps together; a pose that occurs in several pairs is encoded once.
  constexpr std::size_t batch = 8;
  std::vector<std::vector<float>> results(batch, std::vector<float>(result.size()));
  std::vector<npt::TransferPair<float>> pairs;
  for (std::vector<float>& out : results) pairs.push_back({pose, identity.coordinates, out});
  engine.run(pairs);
  for (const std::vector<float>& out : results) expect_same(out, result, "in a batch");
  std::printf("Batch of %zu: %.2f ms, the same bits as one at a time.\n", batch, watch.lap());

  // Back to the identity's place and units, with its faces.
  npt::write_mesh(options.out, npt::with_positions(identity_mesh, identity, result));
  std::printf("Wrote %s.\n", options.out.string().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A host application: one engine shared by threads, on memory of its own");
  Options options;
  app.add_option("--weights", options.weights, "Weights of bottleneck 128 (.safetensors); without: random");
  app.add_option("--out", options.out, "Mesh to write, .obj or .ply")->capture_default_str();
  app.add_option("--threads", options.threads, "Host threads that call the engine at the same time")
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
