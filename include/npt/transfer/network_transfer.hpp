/// Meshes through the pose transfer network: normalised, paired at random, encoded and decoded in as many runs as the
/// options ask for, averaged. PoseTransfer does so with all meshes for which no body is estimated.
///
/// Threads   all members are const and may be called by any number of threads at a time
/// Memory    a call whose shapes were seen before allocates nothing
/// Numerics  the same bits for any number of threads and for batches
/// Errors    npt::Error as PoseTransfer's
/// Source    Wang et al., CVPR 2020, section 4.1
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/control.hpp>
#include <npt/base/error.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/vertex_order.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nets/network_type.hpp>
#include <npt/nets/transfer_pair.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/transfer/mesh_checks.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/pose_points.hpp>
#include <npt/transfer/result.hpp>
#include <npt/transfer/settings.hpp>
#include <npt/transfer/unit.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
class NetworkTransfer {
 public:
  NetworkTransfer(const NetworkType<Exec>& type, std::span<const float> values, const Metadata& metadata,
                  const std::string& name, const TransferOptions& options, Exec executor)
      : engine_(expect_pose_transfer(type, name).pack(values, std::move(executor), options.network.precision)),
        options_(complete_options(options, metadata, name)),
        variant_(type.variant),
        paired_(type.program->paired),
        in_metres_(names_metres(metadata) && *options_.network.normalisation != Normalisation::sphere) {
    check_options(options_, paired_);
  }

  const engine::Core<float, Exec>& engine() const noexcept { return engine_; }
  /// Complete: with what the weights' file says.
  const TransferOptions& options() const noexcept { return options_; }
  const Metadata& variant() const noexcept { return variant_; }
  bool pairs_vertices() const noexcept { return paired_; }
  std::size_t pairing_count() const noexcept {
    return paired_ ? static_cast<std::size_t>(options_.network.pairings) : 1;
  }
  std::size_t run_count() const noexcept { return pairing_count() * (options_.network.mirror ? 2 : 1); }

  /// Errors    npt::Error for a network with other inputs than a pose and an identity
  static const NetworkType<Exec>& expect_pose_transfer(const NetworkType<Exec>& type, const std::string& name) {
    expect_network(transfers_poses(type.program->inputs), type, name, "a pose transfer network, of pose and identity");
    return type;
  }

  /// Metres in one unit of a mesh: as given in the options, or inferred from its extent; 1 where the weights ask for no
  /// unit.
  double unit_of(const MeshView& mesh) const {
    if (!in_metres_) return 1;
    return options_.import.unit ? *options_.import.unit : npt::unit_of(mesh);
  }

  /// "bottleneck 256, conv_relu, per-vertex, 4 pairings, mirrored, refined within 0.04"
  std::string description() const {
    std::string text = variant_name(variant_);
    if (paired_ && options_.network.pairing == Pairing::as_given) text += ", paired as given";
    if (pairing_count() > 1) text += ", " + std::to_string(options_.network.pairings) + " pairings";
    if (options_.network.mirror) text += ", mirrored";
    if (options_.refinement != nullptr) text += ", refined within " + number_text(*options_.refine_radius);
    return text;
  }

  /// The identity's part: its coordinates for the network, its mirror image.
  void prepare_identity(const MeshView& mesh, NetworkIdentity& prepared) const {
    const auto lease = pool_.lease();
    prepare_identity(mesh, prepared, lease->choice);
  }

  /// The points that stand for a pose mesh, for each pairing.
  void choose(const MeshView& pose, std::size_t identity_vertices, PoseChoice& choice) const {
    const auto lease = pool_.lease();
    choose(pose, identity_vertices, lease->choice, choice);
  }
  /// Errors    npt::Error for points that were chosen for other options
  void expect_chosen(const PoseChoice& choice) const {
    if (choice.pairings_.size() != pairing_count())
      throw Error({.file = "chosen points",
                   .found = std::to_string(choice.pairings_.size()) + " pairings",
                   .expected = std::to_string(pairing_count()) + ", as this transfer's choose_points makes"});
  }
  void encode(const MeshView& pose, const PoseChoice& choice, NetworkPose& prepared,
              const Control& control = {}) const {
    const auto lease = pool_.lease();
    const NormalisingTransform transform = transform_of(pose, unit_of(pose));
    prepared.codes.resize(run_count());
    for (std::size_t r = 0; r < run_count(); ++r) {
      pose_input(pose, transform, choice, r, lease->points);
      engine_.encode(lease->points, prepared.codes[r], run_of(r, control));
    }
    prepared.count = paired_ ? choice.pairings_.front().count() : 0;
  }
  /// Writes a prepared identity's new positions [V, 3].
  void decode(const NetworkIdentity& identity, const NetworkPose& pose, std::span<float> result,
              const Control& control = {}) const {
    if (options_.network.mirror && identity.mirrored.empty())
      throw Error({.file = "identity",
                   .found = "one prepared without its mirror image",
                   .expected = "one that this transfer prepared"});
    const auto lease = pool_.lease();
    lease->sum.assign(result.size(), 0.0);
    lease->results.resize(result.size());
    for (std::size_t r = 0; r < run_count(); ++r) {
      const std::span<float> own = as_span(lease->results);
      engine_.decode(pose.codes[r], {input_of(identity, r)}, own, run_of(r, control));
      add(own, mirrors(r), lease->sum);
    }
    finish(identity, lease->sum, result);
  }

  /// A batch through shared sweeps of the network.
  void run(std::span<const TransferJob> jobs) const {
    const auto lease = pool_.lease();
    for (const TransferJob& job : jobs)
      if (job.report != nullptr) *job.report = {};
    while (!jobs.empty()) jobs = jobs.subspan(run_some(*lease, jobs));
  }

 private:
  /// Vertices that a batch carries through the network together, over all of its runs: its inputs and results wait in
  /// memory.
  static constexpr std::size_t batch_vertices = 65536;

  /// The memory of one call.
  struct Scratch {
    ChoiceScratch choice;
    PoseChoice pose_choice;
    std::vector<float> points;
    std::vector<std::vector<float>> inputs;   ///< by run of a batch: pose points
    std::vector<std::vector<float>> outputs;  ///< by run of a batch
    std::vector<NetworkIdentity> identities;  ///< by job of a batch
    std::vector<NetworkCall<float>> calls;
    std::vector<std::size_t> identity_of;  ///< by job of a batch: place in identities
    std::vector<std::size_t> first_input;  ///< by job of a batch: place in inputs
    std::vector<float> results;
    std::vector<double> sum;
  };

  /// Whether run number r is of the mirror images.
  bool mirrors(std::size_t r) const noexcept { return r >= pairing_count(); }
  std::span<const float> input_of(const NetworkIdentity& identity, std::size_t r) const {
    return as_span(mirrors(r) ? identity.mirrored : identity.coordinates);
  }

  /// The share of run number r.
  Control run_of(std::size_t r, const Control& control) const {
    const auto runs = static_cast<double>(run_count());
    return control.part(static_cast<double>(r) / runs, static_cast<double>(r + 1) / runs);
  }

  /// From a mesh's coordinates to the network's, the unit included.
  NormalisingTransform transform_of(const MeshView& mesh, double unit) const {
    NormalisingTransform transform = normalising_transform(mesh.xyz, *options_.network.normalisation, mesh.name);
    transform.scale *= unit;
    return transform;
  }

  void prepare_identity(const MeshView& mesh, NetworkIdentity& prepared, ChoiceScratch& scratch) const {
    const MeshView identity = internal::named(mesh, "identity");
    internal::expect_transferable(identity);
    prepared.vertices = 0;
    prepared.unit = unit_of(identity);
    prepared.transform = transform_of(identity, prepared.unit);
    prepared.coordinates.resize(identity.xyz.size());
    prepared.place.clear();
    // Coincident vertices, as along seams, take the result of one of them: paired with different points they would
    // part.
    const bool by_place = paired_ && options_.network.pairing == Pairing::random;
    if (options_.network.invariant || by_place) canonical_order(identity.xyz, scratch.keys, scratch.canonical);
    if (by_place || options_.network.invariant)
      coincident_representatives(identity.xyz, as_span(scratch.canonical), prepared.place);
    if (!options_.network.invariant) {
      prepared.transform.apply(identity.xyz, as_span(prepared.coordinates));
    } else {
      scratch.place.resize(scratch.canonical.size());
      for (std::size_t i = 0; i < scratch.canonical.size(); ++i) {
        const std::size_t v = scratch.canonical[i];
        scratch.place[v] = static_cast<std::uint32_t>(i);
        prepared.transform.apply(identity.xyz.subspan(3 * v, 3), as_span(prepared.coordinates).subspan(3 * i, 3));
      }
      for (std::uint32_t& place : prepared.place) place = scratch.place[place];
    }
    if (options_.network.mirror) internal::mirror(as_span(prepared.coordinates), prepared.mirrored);
    prepared.vertices = identity.vertex_count();
  }

  void choose(const MeshView& pose, std::size_t identity_vertices, ChoiceScratch& scratch, PoseChoice& choice) const {
    if (paired_ && identity_vertices == 0)
      throw Error({.file = "identity", .found = "no vertices", .expected = "as many as the identities have"});
    choice.pairings_.resize(pairing_count());
    for (std::size_t p = 0; p < choice.pairings_.size(); ++p)
      npt::choose_points(pose, paired_ ? identity_vertices : 0, options_, p, scratch, choice.pairings_[p]);
  }

  /// The points of run r of a pose mesh as the network sees them.
  void pose_input(const MeshView& pose, const NormalisingTransform& transform, const PoseChoice& choice, std::size_t r,
                  std::vector<float>& points) const {
    place_points(pose, choice.pairings_[r % pairing_count()], points);
    transform.apply(as_span(std::as_const(points)), as_span(points));
    if (mirrors(r))
      for (std::size_t i = 0; i < points.size(); i += 3) points[i] = -points[i];
  }

  /// The first jobs of a batch, as many as share the network's sweeps; returns their number.
  std::size_t run_some(Scratch& scratch, std::span<const TransferJob> jobs) const {
    scratch.identity_of.clear();
    scratch.first_input.clear();
    std::size_t count = 0, vertices = 0, identities = 0, inputs = 0;
    while (count < jobs.size() && (count == 0 || vertices < batch_vertices)) {
      const TransferJob& job = jobs[count];
      internal::expect_result(job.result.size(), job.identity.xyz.size());
      if (count == 0 || !internal::same_memory(job.identity, jobs[count - 1].identity)) {
        if (scratch.identities.size() == identities) scratch.identities.emplace_back();
        prepare_identity(job.identity, scratch.identities[identities++], scratch.choice);
      }
      const bool known = count > 0 && internal::same_memory(job.pose, jobs[count - 1].pose) &&
                         (!paired_ || job.identity.xyz.size() == jobs[count - 1].identity.xyz.size());
      if (!known) {
        const MeshView pose = internal::named(job.pose, "pose");
        internal::expect_transferable(pose);
        choose(pose, job.identity.vertex_count(), scratch.choice, scratch.pose_choice);
        const NormalisingTransform transform = transform_of(pose, unit_of(pose));
        if (scratch.inputs.size() < inputs + run_count()) scratch.inputs.resize(inputs + run_count());
        for (std::size_t r = 0; r < run_count(); ++r)
          pose_input(pose, transform, scratch.pose_choice, r, scratch.inputs[inputs + r]);
        inputs += run_count();
      }
      scratch.identity_of.push_back(identities - 1);
      scratch.first_input.push_back(inputs - run_count());
      vertices += run_count() * job.identity.vertex_count();
      ++count;
    }
    run_network(scratch, jobs.first(count));
    for (std::size_t j = 0; j < count; ++j) {
      scratch.sum.assign(jobs[j].result.size(), 0.0);
      for (std::size_t r = 0; r < run_count(); ++r)
        add(as_span(std::as_const(scratch.outputs[j * run_count() + r])), mirrors(r), scratch.sum);
      finish(scratch.identities[scratch.identity_of[j]], scratch.sum, jobs[j].result);
    }
    return count;
  }

  /// Fills scratch.outputs.
  void run_network(Scratch& scratch, std::span<const TransferJob> jobs) const {
    if (scratch.outputs.size() < jobs.size() * run_count()) scratch.outputs.resize(jobs.size() * run_count());
    scratch.calls.clear();
    for (std::size_t j = 0; j < jobs.size(); ++j)
      for (std::size_t r = 0; r < run_count(); ++r) {
        std::vector<float>& output = scratch.outputs[j * run_count() + r];
        output.resize(jobs[j].result.size());
        scratch.calls.push_back(
            TransferPair<float>{.pose = as_span(std::as_const(scratch.inputs[scratch.first_input[j] + r])),
                                .identity = input_of(scratch.identities[scratch.identity_of[j]], r),
                                .result = as_span(output)});
      }
    engine_.run(as_span(std::as_const(scratch.calls)));
  }

  /// Adds the result of a run to the sum of all.
  static void add(std::span<const float> result, bool mirrored, std::vector<double>& sum) {
    for (std::size_t i = 0; i < result.size(); ++i)
      sum[i] += static_cast<double>(mirrored && i % 3 == 0 ? -result[i] : result[i]);
  }

  /// The mean of all runs as positions in the identity's order, units and place.
  void finish(const NetworkIdentity& identity, const std::vector<double>& sum, std::span<float> result) const {
    const auto runs = static_cast<double>(run_count());
    for (std::size_t v = 0; v < identity.vertices; ++v) {
      const std::size_t from = identity.place.empty() ? v : identity.place[v];
      // In double to the end: rounded to float in between, g++ 12 at -O3 leaves that rounding out in a loop's last
      // vertices.
      const Vec3d mean{sum[3 * from] / runs, sum[3 * from + 1] / runs, sum[3 * from + 2] / runs};
      const Vec3f position = identity.transform.apply_inverse(mean).as<float>();
      result[3 * v] = position.x;
      result[3 * v + 1] = position.y;
      result[3 * v + 2] = position.z;
    }
  }

  engine::Core<float, Exec> engine_;
  TransferOptions options_;
  Metadata variant_;
  bool paired_;
  bool in_metres_;  ///< the weights were trained in metres and the normalisation keeps scales
  Pool<Scratch> pool_;
};

}  // namespace npt::inline NPT_ABI
