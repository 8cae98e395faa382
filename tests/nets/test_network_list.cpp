#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nets/network_names.hpp>
#include <npt/nets/network_type.hpp>
#include <npt/nets/transfer_pair.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <cstring>
#include <filesystem>
#include <string>

#include "support/bumpy_sphere.hpp"

namespace {

using Small = npt::PoseTransferNet<16>;
using SmallPooled = npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>;
using Other = npt::PoseTransferNet<24, npt::ReluConv>;
using Networks = npt::NetworkList<Small, SmallPooled, Other>;

/// A host's own network, which no metadata names.
struct Own {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 8> a;
  npt::Conv1x1<11, 3> b;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
  }
  constexpr auto operator()(auto pose, auto identity) const { return npt::cat(pose | a | npt::relu, identity) | b; }
};

template <class Net>
npt::SafetensorsFile file_of(const npt::Metadata& metadata = {}) {
  const auto path = std::filesystem::temp_directory_path() / "npt_test_network_list.safetensors";
  npt::Model<Net> model;
  npt::randomise(model, 3);
  npt::save(model, path, metadata);
  auto file = npt::SafetensorsFile::read(path);
  std::filesystem::remove(path);
  return file;
}

npt::PoseTransfer open(const npt::SafetensorsFile& file, const npt::TransferOptions& options = {}) {
  return npt::PoseTransfer::open<Networks>(file, options, npt::DefaultExecutor(1));
}

std::string message_of(const npt::SafetensorsFile& file, const npt::TransferOptions& options = {}) {
  try {
    open(file, options);
  } catch (const npt::Error& error) {
    return std::string(error.what()).substr(file.name().size());
  }
  return "no error";
}

}  // namespace

TEST_CASE("a file opens the network that it says it is of") {
  CHECK(open(file_of<Small>()).description() == "bottleneck 16, conv_relu, per-vertex");
  CHECK(open(file_of<SmallPooled>()).description() == "bottleneck 16, conv_relu, pooled");
  CHECK(open(file_of<Other>()).description() == "bottleneck 24, relu_conv, per-vertex");
  CHECK(open(file_of<Small>()).pairs_vertices());
  CHECK_FALSE(open(file_of<SmallPooled>()).pairs_vertices());
}

TEST_CASE("an opened transfer is the network with the file's weights and normalisation") {
  const npt::Mesh identity = support::bumpy_sphere(9, 14, 0.2), pose = support::bumpy_sphere(9, 14, 0.4);
  npt::Model<Small> model;
  npt::randomise(model, 3);
  const npt::Mesh expected =
      npt::PoseTransfer(model, {.network = {.normalisation = npt::Normalisation::sphere}}, 1)(identity, pose);
  const npt::Mesh found = open(file_of<Small>({{"normalisation", "sphere"}}))(identity, pose);
  CHECK(found.positions == expected.positions);
  CHECK(message_of(file_of<Small>({{"normalisation", "cube"}})) ==
        ": metadata normalisation: found 'cube', expected sphere, centre or none");
}

TEST_CASE("networks that aren't in the list are refused with the list") {
  CHECK(message_of(file_of<npt::PoseTransferNet<24>>()) ==
        ": metadata: found bottleneck 24, conv_relu, per-vertex, expected one of the networks that are compiled in: "
        "bottleneck 16, 24; feature per-vertex, pooled; order conv_relu, relu_conv");
  CHECK(message_of(file_of<npt::PoseTransferNet<8>>()).starts_with(": metadata: found bottleneck 8, conv_relu"));
  // An ablation's file has a key that the list's networks don't.
  using Ablations = npt::NetworkList<Small, npt::PlainNet<16>>;
  const auto plain = file_of<npt::PlainNet<16>>();
  CHECK_THROWS_AS(open(plain), npt::Error);
  CHECK(npt::PoseTransfer::open<Ablations>(plain, {}, npt::DefaultExecutor(1)).description() ==
        "without-spadain, bottleneck 16, conv_relu, per-vertex");
}

TEST_CASE("what a file doesn't say has to be told, and what it says can't be told otherwise") {
  const auto path = std::filesystem::temp_directory_path() / "npt_test_network_list_bare.safetensors";
  npt::Model<Other> model;
  npt::randomise(model, 3);
  npt::save_values<float>(path, {}, model.parameters(), model.buffer());
  const auto bare = npt::SafetensorsFile::read(path);
  std::filesystem::remove(path);
  CHECK(message_of(bare) ==
        ": metadata order: found nothing, expected a value, or to be told: files of all variants look alike");
  CHECK(message_of(bare, {.network = {.assume = {{"order", "relu_conv"}}}})
            .starts_with(": metadata feature: found nothing"));
  CHECK(open(bare, {.network = {.assume = {{"order", "relu_conv"}, {"feature", "per-vertex"}}}}).description() ==
        "bottleneck 24, relu_conv, per-vertex");
  CHECK(message_of(file_of<Small>(), {.network = {.assume = {{"order", "relu_conv"}}}}) ==
        ": metadata order: found 'conv_relu', expected 'relu_conv', as was asked for");
}

TEST_CASE("a host's own network needs no list, and may be a list of one") {
  const npt::Mesh identity = support::bumpy_sphere(9, 14, 0.2), pose = support::bumpy_sphere(9, 14, 0.4);
  npt::Model<Own> model;
  npt::randomise(model, 3);
  const npt::PoseTransfer transfer(model, {}, 1);
  CHECK(transfer.description() == "a network of its own");
  CHECK(transfer(identity, pose).vertex_count() == identity.vertex_count());
  const auto opened = npt::PoseTransfer::open<npt::NetworkList<Own>>(file_of<Own>(), {}, npt::DefaultExecutor(1));
  CHECK(opened(identity, pose).positions == transfer(identity, pose).positions);
}

TEST_CASE("random weights of a list's network are those of randomise") {
  const auto* type = npt::find_network<Networks, npt::DefaultExecutor>(npt::variant_metadata<Small>());
  REQUIRE(type != nullptr);
  CHECK(npt::find_network<Networks, npt::DefaultExecutor>(npt::Metadata{{"order", "none"}}) == nullptr);
  const npt::Mesh identity = support::bumpy_sphere(9, 14, 0.2), pose = support::bumpy_sphere(9, 14, 0.4);
  npt::Model<Small> model;
  npt::randomise(model, 5);
  const auto random = npt::PoseTransfer::random(*type, 5, {}, npt::DefaultExecutor(1));
  CHECK(random(identity, pose).positions == npt::PoseTransfer(model, {}, 1)(identity, pose).positions);
}

TEST_CASE("one list holds all networks: the correspondence network's weights are found, and refused for transfers") {
  const auto file = file_of<npt::CorrespondenceNet<>>();
  const auto& type = npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(file);
  CHECK(type.variant == npt::variant_metadata<npt::CorrespondenceNet<>>());
  CHECK(npt::input_names(type.program->inputs) == "points and normals");
  CHECK_THROWS_WITH_AS(
      npt::PoseTransfer::open(file, {}, npt::DefaultExecutor(1)),
      (file.name() + ": found net correspondence, width 256, a network of points and normals, expected a pose "
                     "transfer network, of pose and identity")
          .c_str(),
      npt::Error);
  // A shorter list doesn't know it.
  CHECK(message_of(file).starts_with(": metadata: found net correspondence, expected one of the networks"));
  const auto other = file_of<npt::PoseTransferNet<256>>();
  CHECK(npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(other).variant.at("bottleneck") == "256");
  CHECK_THROWS_AS(npt::CorrespondenceEstimator(other, npt::DefaultExecutor(1)), npt::Error);
}

TEST_CASE("every network of the list has its own inputs' names and a variant of its own") {
  std::size_t transfers = 0;
  const auto& types = npt::network_types<npt::AllNetworks, npt::DefaultExecutor>();
  for (const auto& type : types) {
    transfers += npt::transfers_poses(type.program->inputs) ? 1U : 0U;
    CHECK(npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(type.variant) == &type);
  }
  CHECK(types.size() == 31);
  CHECK(transfers == 30);
}
