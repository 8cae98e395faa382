// A network of one's own by composition: what the library makes of it, and its weights in a file.
//
//   custom_network [--out FILE] [--vertices V]
//
// Layers are piped; the types know every channel count, so a wrong one is a compile error that shows both numbers.
// There is nothing to register: explain, engine and weights files walk over what `visit` lists.
#include <npt/base/random.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nn/graph/explain.hpp>
#include <npt/npt.hpp>

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

/// A smaller relative of the paper's network: a pooled pose feature (any number of vertices), one residual block
/// conditioned on the identity, and an output that moves the identity's vertices instead of replacing them.
struct OffsetNet {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 64> encode1;
  npt::Conv1x1<64, 125> encode2;
  npt::Conv1x1<128, 96> join;
  npt::ResBlock<96> block;
  npt::Conv1x1<96, 3> offset;

  /// The names under which weights files keep the tensors.
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("encode1", self.encode1);
    visitor("encode2", self.encode2);
    visitor("join", self.join);
    visitor("block", self.block);
    visitor("offset", self.offset);
  }

  /// What the file's metadata says, so that other networks' weights are refused.
  static std::map<std::string, std::string> variant() { return {{"network", "offset"}}; }

  constexpr auto operator()(auto pose, auto identity) const {
    const auto feature =
        pose | encode1 | npt::instance_norm | npt::relu | encode2 | npt::instance_norm | npt::relu | npt::max_pool;
    const auto h = block(cat(feature, identity) | join, identity);
    return identity + (h | offset | npt::tanh);
  }
};

std::vector<float> random_points(int vertices, std::uint64_t seed) {
  npt::Random random(seed);
  std::vector<float> points(3 * static_cast<std::size_t>(vertices));
  for (float& x : points) x = static_cast<float>(random.uniform(-1, 1));
  return points;
}

void run(const std::filesystem::path& out, int vertices) {
  std::puts("The network, lowered to stages (each is one matrix product with what rides along):\n");
  std::fputs(npt::explain<OffsetNet>().c_str(), stdout);

  npt::Model<OffsetNet> model;
  npt::randomise(model, 1);
  std::size_t tensors = 0, parameters = 0;
  model.for_each_tensor([&](const std::string&, const npt::Parameter& p, auto) {
    ++tensors;
    parameters += static_cast<std::size_t>(p.size());
  });
  std::printf("\n%zu tensors with %zu parameters, filled at random.\n", tensors, parameters);

  const npt::Engine engine(model);
  const std::vector<float> pose = random_points(2 * vertices, 2), identity = random_points(vertices, 3);
  std::vector<float> result(identity.size());
  engine({pose, identity}, result);
  const auto start = std::chrono::steady_clock::now();
  engine({pose, identity}, result);
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  std::printf("%d pose points onto %d identity points: %.2f ms.\n", 2 * vertices, vertices, ms);

  npt::save(model, out, {{"note", "random weights of examples/custom_network.cpp"}});
  npt::Model<OffsetNet> loaded;
  npt::load(loaded, out);
  std::vector<float> again(result.size());
  npt::Engine{loaded}({pose, identity}, again);
  if (again != result) throw std::runtime_error("the loaded weights give another result");
  std::printf("Wrote %s; loaded again, it gives the same bits.\n", out.string().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A network of one's own: explained, run, saved and loaded");
  std::filesystem::path out = "custom_network.safetensors";
  int vertices = 6890;
  app.add_option("--out", out, "Weights file to write")->capture_default_str();
  app.add_option("--vertices", vertices, "Of the identity; the pose has twice as many")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(out, vertices);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "custom_network: %s\n", e.what());
    return 1;
  }
}
