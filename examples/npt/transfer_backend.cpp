/// The networks behind `npt transfer` and `npt explain`, chosen by the weights.
#include "transfer_backend.hpp"

#include "networks.hpp"
#include "shipped_weights.hpp"

#include <refining/refiner.hpp>

#include <npt/core/error.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/transfer/transfer.hpp>

#include <charconv>
#include <cstdio>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace program {

namespace {

class EngineBackend : public TransferBackend {
 public:
  EngineBackend(const Network& network, FloatEngine engine, const TransferOptions& options,
                npt::Normalisation normalisation, double refine_radius, std::string notice)
      : network_(network),
        engine_(std::move(engine)),
        options_{
            .normalisation = normalisation,
            .resample = options.resample,
            .seed = options.seed,
            // A network that pairs vertices has learnt with random pairs. Meshes of one origin are often numbered alike, and
            // paired by number they come out torn.
            .invariant = options.invariant || network.program->paired,
            .pairings = options.pairings,
            .mirror = options.mirror},
        refine_(options.refine),
        sequence_(options.sequence),
        refine_radius_(refine_radius),
        notice_(std::move(notice)) {
    if (refine_) refining::expect_available();
    if (options.pairings > 1 && !network_.program->paired)
      notice_ +=
          std::string(notice_.empty() ? "" : " ") + "--pairings changes nothing: the pooled feature pairs no vertices.";
  }

  npt::Mesh transfer(const LoadedMesh& identity, const LoadedMesh& pose) override {
    take_identity(identity);
    take_pose(pose, paired_count(identity.mesh.vertex_count()));
    result_.resize(identity_.coordinates.size());
    npt::decode_runs(engine_, codes_, identity_, options_, std::span(result_));
    if (!refiner_) return npt::with_positions(identity.mesh, identity_, result_);
    npt::Mesh result = identity.mesh;
    npt::restore(identity_, result_, result.coordinates());
    refiner_->refine(result.coordinates());
    npt::recompute_normals(result);
    return result;
  }

  void transfer(std::span<const float> identity, std::span<const npt::Triangle> identity_triangles,
                std::span<const float> pose, std::span<const npt::Triangle> pose_triangles,
                std::span<float> result) const override {
    const npt::IdentityInput input = npt::identity_input(identity, options_);
    const auto pairings = npt::choose_pairings(pose, pose_triangles, paired_count(identity.size() / 3), options_);
    std::vector<npt::PoseCode<float>> codes;
    npt::encode_runs(engine_, pose, pairings, options_, codes);
    std::vector<float> own(identity.size());
    npt::decode_runs(engine_, codes, input, options_, std::span(own));
    npt::restore(input, own, result);
    if (refine_) refining::make_refiner(identity, identity_triangles, refine_radius_, "identity")->refine(result);
  }

  std::string description() const override {
    std::string text = network_.variant.text();
    if (options_.pairings > 1 && network_.program->paired)
      text += ", " + std::to_string(options_.pairings) + " pairings";
    if (options_.mirror) text += ", mirrored";
    if (refine_) text += ", refined within " + npt::number_text(refine_radius_);
    return text;
  }
  std::string notice() const override { return notice_; }

 private:
  /// The points that the network needs of a pose mesh; 0: all that it has.
  std::size_t paired_count(std::size_t identity_vertices) const {
    return network_.program->paired ? identity_vertices : 0;
  }

  void take_identity(const LoadedMesh& identity) {
    if (identity.number == identity_number_) return;
    identity_number_ = 0;
    identity_ = npt::identity_input(identity.mesh.coordinates(), options_, identity.name);
    if (refine_)
      refiner_ = refining::make_refiner(identity.mesh.coordinates(), npt::triangulate(identity.mesh), refine_radius_,
                                        identity.name);
    identity_number_ = identity.number;
  }

  void take_pose(const LoadedMesh& pose, std::size_t count) {
    if (pose.number == pose_number_ && count == pose_count_) return;
    pose_number_ = 0;
    if (!sequence_) points_ = {};
    const auto& pairings = points_.of(pose.mesh.coordinates(), npt::triangulate(pose.mesh), count, options_, pose.name);
    npt::encode_runs(engine_, pose.mesh.coordinates(), pairings, options_, codes_, pose.name);
    pose_number_ = pose.number;
    pose_count_ = count;
  }

  const Network& network_;
  FloatEngine engine_;
  npt::TransferOptions options_;
  bool refine_, sequence_;
  double refine_radius_;
  std::string notice_;
  npt::IdentityInput identity_;
  std::unique_ptr<const refining::Refiner> refiner_;
  std::uint64_t identity_number_ = 0;
  npt::SequencePoints points_;
  std::vector<npt::PoseCode<float>> codes_;
  std::uint64_t pose_number_ = 0;
  std::size_t pose_count_ = 0;
  std::vector<float> result_;
};

/// The bottleneck that a weights file has: its metadata's, or what the shape of the encoder's last convolution says.
int bottleneck_of(const npt::SafetensorsFile& file) {
  std::string text;
  if (const std::string* stored = file.find_metadata("bottleneck")) {
    text = *stored;
  } else if (const npt::FileTensor* last = file.find("encoder.conv3.weight"); last != nullptr && !last->shape.empty()) {
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
  Variant variant{bottleneck_of(file), chosen(file, "order", options.order), chosen(file, "feature", options.feature)};
  if (const std::string* net = file.find_metadata("net")) variant.net = *net;
  if (const Network* network = find_network(variant)) return *network;
  throw npt::Error({.file = file.name(),
                    .place = "metadata",
                    .found = variant.text(),
                    .expected =
                        "order conv_relu or relu_conv, feature per-vertex or pooled; net, if any, without-spadain or "
                        "concat1 with conv_relu and per-vertex"});
}

npt::Normalisation normalisation_of(const npt::SafetensorsFile& file) {
  // The paper scales to the unit sphere; a file that doesn't say is taken for one of the authors' code, which only centres.
  const std::string* stored = file.find_metadata("normalisation");
  if (stored == nullptr) return npt::Normalisation::centre;
  return npt::parse_normalisation(*stored, file.name() + ": metadata normalisation");
}

/// The radius of the refinement: as asked for, or what was measured to be best for these weights, or the library's.
double refine_radius_of(const npt::SafetensorsFile* file, const TransferOptions& options) {
  if (options.refine_radius) return *options.refine_radius;
  const std::string* stored = file == nullptr ? nullptr : file->find_metadata("refine_radius");
  if (stored == nullptr) return refining::default_radius();
  double radius = 0;
  const auto [end, code] = std::from_chars(stored->data(), stored->data() + stored->size(), radius);
  if (code != std::errc() || end != stored->data() + stored->size() || !(radius > 0) || !(radius <= 10))
    throw npt::Error({.file = file->name(),
                      .place = "metadata refine_radius",
                      .found = "'" + *stored + "'",
                      .expected = "a number above 0, at most 10"});
  return radius;
}

std::unique_ptr<TransferBackend> from_weights(const std::filesystem::path& path, const TransferOptions& options) {
  const auto file = npt::SafetensorsFile::read(path);
  const Network& network = network_of(file, options.network);
  npt::Metadata assume{{"order", network.variant.order}, {"feature", network.variant.feature}};
  if (options.network.output_scale) assume["output_scale"] = npt::number_text(*options.network.output_scale);
  const auto normalisation = options.normalisation ? *options.normalisation : normalisation_of(file);
  return std::make_unique<EngineBackend>(network, network.from_file(file, assume, options.threads), options,
                                         normalisation, refine_radius_of(&file, options), "");
}

/// Weights of the right shape that know nothing: for a feature of which no trained ones are shipped, the rest of the program can be tried.
std::unique_ptr<TransferBackend> from_seed(const TransferOptions& options) {
  Variant variant{.bottleneck = 256};
  if (options.network.order) variant.order = *options.network.order;
  if (options.network.feature) variant.feature = *options.network.feature;
  const Network& network = *find_network(variant);
  return std::make_unique<EngineBackend>(
      network, network.from_seed(options.seed, options.threads, npt::Precision::native), options,
      options.normalisation.value_or(npt::Normalisation::centre), refine_radius_of(nullptr, options),
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
