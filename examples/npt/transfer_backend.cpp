/// The networks behind `npt transfer` and `npt explain`: the variants that are compiled in, chosen by the weights.
#include "transfer_backend.hpp"

#include "shipped_weights.hpp"

#include <npt/core/error.hpp>
#include <npt/engine/engine.hpp>
#include <npt/graph/explain.hpp>
#include <npt/net/pose_transfer_net.hpp>
#include <npt/transfer/transfer.hpp>
#include <npt/weights/weights_file.hpp>

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace program {

namespace {

/// What names one of the compiled networks.
struct Variant {
  int bottleneck = 1024;
  std::string order = npt::ConvRelu::name;
  std::string feature = npt::PerVertex::name;

  bool operator==(const Variant&) const = default;
  std::string text() const { return "bottleneck " + std::to_string(bottleneck) + ", " + order + ", " + feature; }
};

/// Calls f.operator()<Net>() for every network that is compiled in.
template <class F>
void for_each_network(F&& f) {
  const auto of_bottleneck = [&f]<int B>() {
    f.template operator()<npt::PoseTransferNet<B, npt::ConvRelu, npt::PerVertex>>();
    f.template operator()<npt::PoseTransferNet<B, npt::ConvRelu, npt::Pooled>>();
    f.template operator()<npt::PoseTransferNet<B, npt::ReluConv, npt::PerVertex>>();
    f.template operator()<npt::PoseTransferNet<B, npt::ReluConv, npt::Pooled>>();
  };
  of_bottleneck.template operator()<1024>();
  of_bottleneck.template operator()<512>();
  of_bottleneck.template operator()<256>();
  of_bottleneck.template operator()<128>();
  of_bottleneck.template operator()<64>();
}

template <class Net>
Variant variant_of() {
  return {Net::bottleneck, Net::Order::name, Net::Feature::name};
}

/// The backend on one network.
template <class Net>
class NetworkBackend : public TransferBackend {
 public:
  NetworkBackend(const npt::Model<Net>& model, const TransferOptions& options, npt::Normalisation normalisation,
                 std::string notice)
      : engine_(model, options.threads),
        options_{.normalisation = normalisation,
                 .resample = options.resample,
                 .seed = options.seed,
                 .invariant = options.invariant},
        notice_(std::move(notice)) {}

  npt::Mesh transfer(const LoadedMesh& identity, const LoadedMesh& pose) override {
    if (identity.number != identity_number_) {
      identity_number_ = 0;
      identity_ = npt::identity_input(identity.mesh.coordinates(), options_, identity.name);
      identity_number_ = identity.number;
    }
    const std::size_t count = decltype(engine_)::pairs_vertices() ? identity.mesh.vertex_count() : 0;
    if (pose.number != pose_number_ || count != pose_count_) {
      pose_number_ = 0;
      engine_.encode(npt::pose_input(pose.mesh.coordinates(), npt::triangulate(pose.mesh), count, options_, pose.name),
                     code_);
      pose_number_ = pose.number;
      pose_count_ = count;
    }
    result_.resize(identity_.coordinates.size());
    engine_.decode(code_, identity_.coordinates, result_);
    return npt::with_positions(identity.mesh, identity_, result_);
  }

  std::string description() const override { return variant_of<Net>().text(); }
  std::string notice() const override { return notice_; }

 private:
  npt::Engine<Net> engine_;
  npt::TransferOptions options_;
  std::string notice_;
  npt::IdentityInput identity_;
  std::uint64_t identity_number_ = 0;
  npt::PoseCode<float> code_;
  std::uint64_t pose_number_ = 0;
  std::size_t pose_count_ = 0;
  std::vector<float> result_;
};

/// The bottleneck that a weights file has: its metadata's, or what the shape of the encoder's last convolution says.
int bottleneck_of(const npt::SafetensorsFile& file) {
  std::string text;
  if (const std::string* stored = file.find_metadata("bottleneck")) {
    text = *stored;
  } else if (const npt::Tensor* last = file.find("encoder.conv3.weight"); last != nullptr && !last->shape.empty()) {
    text = std::to_string(last->shape[0]);
  } else {
    throw npt::Error({.file = file.name(),
                      .place = "tensors",
                      .found = "no encoder.conv3.weight",
                      .expected = "weights of a pose transfer network"});
  }
  for (const int b : {1024, 512, 256, 128, 64})
    if (text == std::to_string(b)) return b;
  throw npt::Error({.file = file.name(),
                    .place = "metadata bottleneck",
                    .found = "'" + text + "'",
                    .expected = "1024, 512, 256, 128 or 64, which this program has compiled in"});
}

/// The file's value for a metadata key, or what was asked for where the file says nothing. The two may not differ:
/// loading checks that.
std::string chosen(const npt::SafetensorsFile& file, const std::string& key, const std::optional<std::string>& asked) {
  if (asked) return *asked;
  if (const std::string* stored = file.find_metadata(key)) return *stored;
  throw npt::Error({.file = file.name(),
                    .place = "metadata " + key,
                    .found = "nothing",
                    .expected = "a value, or --" + key + ": files of all variants look alike"});
}

npt::Normalisation normalisation_of(const npt::Metadata& metadata, const std::string& file) {
  const auto found = metadata.find("normalisation");
  // The paper scales to the unit sphere; a file that doesn't say is taken for one of the authors' code, which only
  // centres.
  if (found == metadata.end()) return npt::Normalisation::centre;
  return npt::parse_normalisation(found->second, file + ": metadata normalisation");
}

std::unique_ptr<TransferBackend> from_weights(const std::filesystem::path& path, const TransferOptions& options) {
  const auto file = npt::SafetensorsFile::read(path);
  const Variant variant{bottleneck_of(file), chosen(file, "order", options.network.order),
                        chosen(file, "feature", options.network.feature)};
  npt::Metadata assume{{"order", variant.order}, {"feature", variant.feature}};
  if (options.network.output_scale) assume["output_scale"] = npt::number_text(*options.network.output_scale);
  std::unique_ptr<TransferBackend> backend;
  for_each_network([&]<class Net>() {
    if (variant_of<Net>() != variant) return;
    npt::Model<Net> model;
    const npt::Metadata metadata = npt::load(model, file, assume);
    const auto normalisation = options.normalisation.value_or(normalisation_of(metadata, file.name()));
    backend = std::make_unique<NetworkBackend<Net>>(model, options, normalisation, "");
  });
  if (!backend)
    throw npt::Error({.file = path.string(),
                      .place = "metadata",
                      .found = variant.text(),
                      .expected = "order conv_relu or relu_conv, feature per-vertex or pooled"});
  return backend;
}

/// Weights of the right shape that know nothing: until trained ones are shipped, the rest of the program can be tried.
std::unique_ptr<TransferBackend> from_seed(const TransferOptions& options) {
  Variant variant{.bottleneck = 256};
  if (options.network.order) variant.order = *options.network.order;
  if (options.network.feature) variant.feature = *options.network.feature;
  std::unique_ptr<TransferBackend> backend;
  for_each_network([&]<class Net>() {
    if (variant_of<Net>() != variant) return;
    npt::Model<Net> model;
    npt::randomise(model, options.seed);
    backend = std::make_unique<NetworkBackend<Net>>(
        model, options, options.normalisation.value_or(npt::Normalisation::centre),
        "no trained weights are shipped yet: random ones (seed " + std::to_string(options.seed) +
            ") are used, and the result is not a pose transfer. Give trained ones with --weights.");
  });
  return backend;
}

}  // namespace

std::unique_ptr<TransferBackend> make_transfer_backend(const TransferOptions& options) {
  if (options.network.weights) return from_weights(*options.network.weights, options);
  if (const auto shipped = shipped_weights(options.network.feature.value_or(npt::PerVertex::name)))
    return from_weights(*shipped, options);
  return from_seed(options);
}

std::string explain_network(const NetworkOptions& options, std::optional<int> bottleneck, std::size_t vertices) {
  Variant variant;
  if (options.weights) {
    const auto file = npt::SafetensorsFile::read(*options.weights);
    variant = {bottleneck_of(file), chosen(file, "order", options.order), chosen(file, "feature", options.feature)};
  } else {
    variant.bottleneck = bottleneck.value_or(1024);
    variant.order = options.order.value_or(npt::ConvRelu::name);
    variant.feature = options.feature.value_or(npt::PerVertex::name);
  }
  std::string text = variant.text() + "\n";
  for_each_network([&]<class Net>() {
    if (variant_of<Net>() != variant) return;
    std::size_t parameters = 0;
    npt::for_each_parameter(npt::graph::bound_network<Net>, [&](const npt::Parameter& p) {
      if (!p.attribute) parameters += static_cast<std::size_t>(p.size());
    });
    const double operations = 2e-9 * npt::graph::program_of<Net>.multiply_adds * static_cast<double>(vertices);
    char line[160];
    std::snprintf(line, sizeof line,
                  "%zu parameters; one transfer at %zu vertices is %.1f GFLOP by the plain algorithm.\n", parameters,
                  vertices, operations);
    text += line + npt::explain<Net>();
  });
  return text;
}

}  // namespace program
