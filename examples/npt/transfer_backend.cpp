/// The networks behind `npt transfer` and `npt explain`, chosen by the weights.
#include "transfer_backend.hpp"

#include "networks.hpp"
#include "shipped_weights.hpp"

#include <npt/core/error.hpp>
#include <npt/transfer/transfer.hpp>

#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace program {

namespace {

class EngineBackend : public TransferBackend {
 public:
  EngineBackend(const Network& network, FloatEngine engine, const TransferOptions& options,
                npt::Normalisation normalisation, std::string notice)
      : network_(network),
        engine_(std::move(engine)),
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
    const std::size_t count = network_.program->paired ? identity.mesh.vertex_count() : 0;
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

  void transfer(std::span<const float> identity, std::span<const float> pose,
                std::span<const npt::Triangle> pose_triangles, std::span<float> result) const override {
    const npt::IdentityInput input = npt::identity_input(identity, options_);
    const std::size_t count = network_.program->paired ? identity.size() / 3 : 0;
    std::vector<float> own(identity.size());
    engine_(npt::pose_input(pose, pose_triangles, count, options_), input.coordinates, own);
    npt::restore(input, own, result);
  }

  std::string description() const override { return network_.variant.text(); }
  std::string notice() const override { return notice_; }

 private:
  const Network& network_;
  FloatEngine engine_;
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
  for (const int b : bottlenecks)
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

const Network& network_of(const npt::SafetensorsFile& file, const NetworkOptions& options) {
  const Variant variant{bottleneck_of(file), chosen(file, "order", options.order),
                        chosen(file, "feature", options.feature)};
  if (const Network* network = find_network(variant)) return *network;
  throw npt::Error({.file = file.name(),
                    .place = "metadata",
                    .found = variant.text(),
                    .expected = "order conv_relu or relu_conv, feature per-vertex or pooled"});
}

npt::Normalisation normalisation_of(const npt::SafetensorsFile& file) {
  // The paper scales to the unit sphere; a file that doesn't say is taken for one of the authors' code, which only centres.
  const std::string* stored = file.find_metadata("normalisation");
  if (stored == nullptr) return npt::Normalisation::centre;
  return npt::parse_normalisation(*stored, file.name() + ": metadata normalisation");
}

std::unique_ptr<TransferBackend> from_weights(const std::filesystem::path& path, const TransferOptions& options) {
  const auto file = npt::SafetensorsFile::read(path);
  const Network& network = network_of(file, options.network);
  npt::Metadata assume{{"order", network.variant.order}, {"feature", network.variant.feature}};
  if (options.network.output_scale) assume["output_scale"] = npt::number_text(*options.network.output_scale);
  const auto normalisation = options.normalisation ? *options.normalisation : normalisation_of(file);
  return std::make_unique<EngineBackend>(network, network.from_file(file, assume, options.threads), options,
                                         normalisation, "");
}

/// Weights of the right shape that know nothing: for a feature of which no trained ones are shipped, the rest of the program can be tried.
std::unique_ptr<TransferBackend> from_seed(const TransferOptions& options) {
  Variant variant{.bottleneck = 256};
  if (options.network.order) variant.order = *options.network.order;
  if (options.network.feature) variant.feature = *options.network.feature;
  const Network& network = *find_network(variant);
  return std::make_unique<EngineBackend>(
      network, network.from_seed(options.seed, options.threads, npt::Precision::native), options,
      options.normalisation.value_or(npt::Normalisation::centre),
      "no trained weights with the " + variant.feature + " feature are shipped: random ones (seed " +
          std::to_string(options.seed) +
          ") are used, and the result is not a pose transfer. Give trained ones with --weights.");
}

}  // namespace

std::unique_ptr<TransferBackend> make_transfer_backend(const TransferOptions& options) {
  if (options.network.weights) return from_weights(*options.network.weights, options);
  // The paper's feature first, if it is shipped and no other was asked for.
  for (const char* feature : {"per-vertex", "pooled"})
    if (options.network.feature.value_or(feature) == feature)
      if (const auto shipped = shipped_weights(feature)) return from_weights(*shipped, options);
  return from_seed(options);
}

std::string explain_network(const NetworkOptions& options, std::optional<int> bottleneck, std::size_t vertices) {
  const Network& network = options.weights
                               ? network_of(npt::SafetensorsFile::read(*options.weights), options)
                               : *find_network({bottleneck.value_or(1024), options.order.value_or("conv_relu"),
                                                options.feature.value_or("per-vertex")});
  char line[160];
  std::snprintf(line, sizeof line,
                "%zu parameters; one transfer at %zu vertices is %.1f GFLOP by the plain algorithm.\n",
                network.parameters, vertices, 2e-9 * network.program->multiply_adds * static_cast<double>(vertices));
  return network.variant.text() + "\n" + line + network.explain();
}

}  // namespace program
