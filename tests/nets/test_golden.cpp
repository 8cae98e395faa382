// Cases made by an independent implementation in PyTorch, in double precision: weights, inputs and outputs of small
// networks of every variant, through the library's own readers.
#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <string>
#include <vector>

#include "support/golden.hpp"
#include "support/nets.hpp"

namespace {

template <class Net, class T>
double golden_error(const std::string& name) {
  const std::string base = support::golden_path(name);
  npt::Model<Net, T> model;
  npt::load(model, base + ".weights.safetensors");
  const auto golden = npt::SafetensorsFile::read(base + ".case.safetensors");
  const npt::Engine engine(model, 2);
  double worst = 0;
  std::vector<std::vector<T>> poses, identities, results;
  std::vector<npt::NetworkCall<T>> calls;
  const std::size_t meshes = golden.at("output").shape[0];
  for (std::size_t n = 0; n < meshes; ++n) {
    poses.push_back(support::mesh_of<T>(golden.at("pose"), n));
    identities.push_back(support::mesh_of<T>(golden.at("identity"), n));
    results.emplace_back(identities[n].size());
  }
  for (std::size_t n = 0; n < meshes; ++n) calls.push_back({{poses[n], identities[n]}, results[n]});
  engine.run(calls);
  for (std::size_t n = 0; n < meshes; ++n)
    worst = std::max(
        worst, support::relative_error(results[n], support::to_map(support::mesh_of<double>(golden.at("output"), n))));
  return worst;
}

template <class Net>
void check_golden(const std::string& name) {
  CAPTURE(name);
  CHECK(golden_error<Net, float>(name) < 1e-5);
  CHECK(golden_error<Net, double>(name) < 1e-12);
}

}  // namespace

TEST_CASE("the paper's network gives the golden outputs") {
  check_golden<npt::PoseTransferNet<16>>("paper_b16_v35");
  check_golden<npt::PoseTransferNet<61>>("paper_b61_v99");
}

TEST_CASE("the released order with 2 tanh gives the golden outputs") {
  check_golden<npt::PoseTransferNet<16, npt::ReluConv>>("released_b16_v35");
}

TEST_CASE("the pooled feature gives the golden outputs") {
  check_golden<npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>>("pooled_b16_v35");
  check_golden<npt::PoseTransferNet<29, npt::ReluConv, npt::Pooled>>("released_pooled_b29_v48");
}
