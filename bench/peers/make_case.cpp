/// Writes a case for the peers: a network's random weights, two random meshes and the result in double, as one
/// safetensors file. Tensors have the names of the public state dict; "pose", "identity" and "result" are [V, 3].
#include <npt/io/safetensors.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

namespace {

struct Options {
  std::filesystem::path out;
  int bottleneck = 1024, vertices = 6890;
  std::uint64_t seed = 1;
};

std::vector<float> random_points(const Options& o, std::uint64_t stream) {
  npt::Random random(o.seed, stream);
  std::vector<float> points(3 * static_cast<std::size_t>(o.vertices));
  for (float& x : points) x = static_cast<float>(random.uniform(-1, 1));
  return points;
}

template <int B>
void write(const Options& o) {
  using Net = npt::PoseTransferNet<B>;
  npt::Model<Net> model;
  npt::randomise(model, o.seed);
  const std::vector<float> pose = random_points(o, 1001), identity = random_points(o, 1002);

  npt::Model<Net, double> exact;
  std::ranges::copy(model.buffer(), exact.buffer().begin());
  std::vector<double> result(identity.size());
  npt::Engine{exact}(
      {std::vector<double>(pose.begin(), pose.end()), std::vector<double>(identity.begin(), identity.end())}, result);
  const std::vector<float> expected(result.begin(), result.end());

  std::vector<npt::FileTensor> tensors;
  model.for_each_tensor([&](const std::string& name, const npt::Parameter& p, std::span<const float> values) {
    npt::TensorShape shape;
    for (int i = 0; i < p.rank; ++i) shape.push_back(static_cast<std::uint64_t>(p.dims[i]));
    tensors.push_back({.name = name, .shape = shape, .bytes = std::as_bytes(values)});
  });
  const auto points = static_cast<std::uint64_t>(o.vertices);
  tensors.push_back({.name = "pose", .shape = {points, 3}, .bytes = std::as_bytes(std::span(pose))});
  tensors.push_back({.name = "identity", .shape = {points, 3}, .bytes = std::as_bytes(std::span(identity))});
  tensors.push_back({.name = "result", .shape = {points, 3}, .bytes = std::as_bytes(std::span(expected))});
  npt::write_safetensors(o.out, tensors, {{"bottleneck", std::to_string(B)}, {"order", "conv_relu"}});
}

void run(const Options& o) {
  if (o.bottleneck == 1024) write<1024>(o);
  if (o.bottleneck == 256) write<256>(o);
  if (o.bottleneck == 128) write<128>(o);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Writes the weights, meshes and expected result that the peers read");
  Options o;
  app.add_option("out", o.out, "File to write (.safetensors)")->required();
  app.add_option("--bottleneck", o.bottleneck, "1024, 256 or 128")
      ->check(CLI::IsMember({1024, 256, 128}))
      ->capture_default_str();
  app.add_option("--vertices", o.vertices, "Of both meshes")->check(CLI::Range(1, 1000000))->capture_default_str();
  app.add_option("--seed", o.seed, "Of weights and meshes")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(o);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "make_case: %s\n", e.what());
    return 1;
  }
}
