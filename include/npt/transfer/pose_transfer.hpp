/// The door of the library: weights from a file, meshes as they come, the identity mesh in the pose mesh's pose.
///
///   const auto transfer = npt::PoseTransfer::open("human.safetensors");
///   npt::Mesh posed = transfer(identity, pose);
///
/// Meshes come in any vertex order, any number of vertices, any place, and in metres, centimetres or millimetres. The
/// identity says where the result lies: its centre, scale and unit are taken out before the network and put back after
/// it. The pose mesh is normalised by itself (Wang et al., CVPR 2020, section 4.1).
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/tensor_adapter.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/scene/affine.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/body_interface.hpp>
#include <npt/transfer/network_transfer.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/prepared.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A network with its weights, and all that stands between meshes and it. With TransferOptions::body, people in any
/// pose and of any proportions go another way, through bodies (transfer/body_interface.hpp), and the network takes the
/// rest.
///
/// Threads   all members are const and may be called by any number of threads at a time
/// Memory    a call whose shapes were seen before allocates nothing, where it writes into memory of the caller's; only
///           preparing an identity for refinement does, as a call with an unprepared identity must then. The way
///           through bodies allocates
/// Numerics  the same bits for any number of threads, for batches, and for prepared meshes. NaN in gives NaN out
/// Errors    npt::Error for empty meshes, meshes in one point, triangles of vertices that aren't there, results of
///           another size, unequal vertex counts where the network pairs vertices and options.resample is off, an
///           extent that is no person's in any unit (transfer/unit.hpp), things prepared by another transfer, and, in
///           the automatic method, meshes that don't read as people and that the network tears apart
template <class Exec = DefaultExecutor>
class BasicPoseTransfer {
 public:
  /// Opens weights (.safetensors) of any network of the list. What the file says of itself is followed: network,
  /// normalisation, unit, radius of the refinement. `threads` 0: as many as the process may use.
  /// Errors    npt::Error that names the file, what it says of itself and what the list has; options out of range
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(const std::filesystem::path& weights, const TransferOptions& options = {},
                                int threads = 0) {
    return open<Networks>(SafetensorsFile::read(weights), options, Exec(threads));
  }
  /// Opens weights that were read already, to run on an executor of the host's.
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(const SafetensorsFile& file, const TransferOptions& options, Exec executor) {
    const NetworkType<Exec>& type = find_network<Networks, Exec>(file, options.assume);
    AlignedBuffer<float> values(type.buffer_size);
    load_values(file, type.variant, *type.parameters, values.span(), options.assume);
    BasicPoseTransfer transfer(type, values.span(), file.metadata(), file.name(), options, std::move(executor));
    transfer.open_body(file);
    return transfer;
  }

  /// Random weights of a network of a list, for trying things out: what comes out is no pose transfer.
  static BasicPoseTransfer random(const NetworkType<Exec>& type, std::uint64_t seed, const TransferOptions& options,
                                  Exec executor) {
    AlignedBuffer<float> values(type.buffer_size);
    set_attributes(*type.parameters, values.span());
    randomise_values(*type.parameters, values.span(), seed);
    return BasicPoseTransfer(type, values.span(), {}, "random weights", options, std::move(executor));
  }

  /// A network of the host's own, trained or loaded. `metadata`: what its weights file says (normalisation, unit).
  template <class Net>
  explicit BasicPoseTransfer(const Model<Net>& model, const TransferOptions& options = {}, int threads = 0,
                             const Metadata& metadata = {})
      : BasicPoseTransfer(model, options, Exec(threads), metadata) {}
  template <class Net>
  BasicPoseTransfer(const Model<Net>& model, const TransferOptions& options, Exec executor,
                    const Metadata& metadata = {})
      : BasicPoseTransfer(network_type<Net, Exec>(), model.buffer(), metadata, "the model", options,
                          std::move(executor)) {}

  /// Weights in a buffer laid out as Model::buffer(). `metadata`: of their file. `name` stands in messages of errors.
  BasicPoseTransfer(const NetworkType<Exec>& type, std::span<const float> values, const Metadata& metadata,
                    const std::string& name, const TransferOptions& options, Exec executor)
      : network_(type, values, metadata, name, options, std::move(executor)) {}

  /// The identity mesh in the pose mesh's pose: its faces, order, units and place; normals are renewed if it has any.
  Mesh operator()(const Mesh& identity, const Mesh& pose) const {
    Mesh result = identity;
    const std::vector<Triangle> of_identity = triangles_of(identity), of_pose = triangulate(pose);
    (*this)(MeshView{identity.coordinates(), of_identity, "identity"}, MeshView{pose.coordinates(), of_pose, "pose"},
            result.coordinates());
    recompute_normals(result);
    return result;
  }

  /// Writes the identity's new positions [V, 3], in its order, units and place. `result` may be the identity's own
  /// memory.
  void operator()(const MeshView& identity, const MeshView& pose, std::span<float> result) const {
    const TransferJob job{identity, pose, result};
    run({&job, 1});
  }

  /// The new positions as a tensor of the host's kind ([V, 3] in, [V, 3] out; <npt/adapt/xtensor.hpp>). Faces, which
  /// refinement and other vertex counts want, go in by MeshView.
  template <HostTensor I, HostTensor P>
  auto operator()(const I& identity, const P& pose) const {
    const auto identity_points = TensorAdapter<I>::template read<float>(identity);
    const auto pose_points = TensorAdapter<P>::template read<float>(pose);
    auto result = TensorAdapter<I>::template make<float>(identity_points.span().size() / 3);
    (*this)(MeshView{identity_points.span(), {}, "identity"}, MeshView{pose_points.span(), {}, "pose"},
            TensorAdapter<I>::template write<float>(result));
    return result;
  }

  /// A batch through shared sweeps of the network, which is what small meshes need. An identity or a pose that occurs
  /// in several successive jobs, the same memory, is prepared once.
  void run(std::span<const TransferJob> jobs) const {
    if (body_ != nullptr && options().method != Method::network) return run_by_body(jobs);
    network_.run(jobs);
  }

  /// Prepares an identity for many poses.
  PreparedIdentity prepare_identity(const MeshView& identity) const {
    PreparedIdentity prepared;
    prepare_identity(identity, prepared);
    return prepared;
  }
  PreparedIdentity prepare_identity(const Mesh& identity, std::string_view name = "identity") const {
    return prepare_identity(MeshView{identity.coordinates(), as_span(triangles_of(identity)), name});
  }
  /// Prepares an identity into memory that is used again.
  void prepare_identity(const MeshView& identity, PreparedIdentity& prepared) const {
    const MeshView mesh = internal::named(identity, "identity");
    internal::expect_transferable(mesh);
    prepare_identity(mesh, read_body(mesh), prepared);
  }

  /// Prepares an identity and the first pose for it, the bodies of both read side by side.
  void prepare(const MeshView& identity, const MeshView& pose, PreparedIdentity& prepared_identity,
               PreparedPose& prepared_pose) const {
    internal::expect_transferable(internal::named(identity, "identity"));
    internal::expect_transferable(internal::named(pose, "pose"));
    std::array<std::shared_ptr<const BodyRead>, 2> reads;
    engine().executor().for_each(2, [&](int i, int) {
      reads[static_cast<std::size_t>(i)] =
          read_body(i == 0 ? internal::named(identity, "identity") : internal::named(pose, "pose"));
    });
    prepare_identity(internal::named(identity, "identity"), std::move(reads[0]), prepared_identity);
    const auto lease = pool_.lease();
    network_.choose(internal::named(pose, "pose"), identity.vertex_count(), lease->choice);
    take_pose(internal::named(pose, "pose"), lease->choice, std::move(reads[1]), prepared_pose);
  }

  /// Chooses the points that stand for every frame of a sequence, on its first frame. `identity_vertices`: of the
  /// identities that take the poses; it doesn't matter where the network pairs no vertices.
  PoseChoice choose_points(const MeshView& first_frame, std::size_t identity_vertices) const {
    PoseChoice choice;
    choose_points(first_frame, identity_vertices, choice);
    return choice;
  }
  void choose_points(const MeshView& first_frame, std::size_t identity_vertices, PoseChoice& choice) const {
    const MeshView pose = internal::named(first_frame, "pose");
    internal::expect_transferable(pose);
    network_.choose(pose, identity_vertices, choice);
  }

  /// Encodes a pose for identities of so many vertices; the number doesn't matter where the network pairs no vertices.
  PreparedPose prepare_pose(const MeshView& pose, std::size_t identity_vertices) const {
    PreparedPose prepared;
    prepare_pose(pose, identity_vertices, prepared);
    return prepared;
  }
  PreparedPose prepare_pose(const Mesh& pose, std::size_t identity_vertices, std::string_view name = "pose") const {
    return prepare_pose(MeshView{pose.coordinates(), as_span(triangulate(pose)), name}, identity_vertices);
  }
  /// Encodes a pose into memory that is used again.
  void prepare_pose(const MeshView& pose, std::size_t identity_vertices, PreparedPose& prepared) const {
    const auto lease = pool_.lease();
    const MeshView mesh = internal::named(pose, "pose");
    internal::expect_transferable(mesh);
    network_.choose(mesh, identity_vertices, lease->choice);
    take_pose(mesh, lease->choice, read_body(mesh), prepared);
  }
  /// Encodes a frame of a sequence, by the points chosen on its first one, into memory that is used again.
  /// `last`: how the frame before it was read as a body, to go on from; nullptr: it is read by itself.
  void prepare_pose(const MeshView& frame, const PoseChoice& choice, PreparedPose& prepared,
                    const BodyRead* last = nullptr) const {
    const MeshView mesh = internal::named(frame, "pose");
    internal::expect_transferable(mesh);
    network_.expect_chosen(choice);
    take_pose(mesh, choice, last == nullptr || body_ == nullptr ? read_body(mesh) : body_->follow(mesh, *last),
              prepared);
  }

  /// How a prepared identity takes a prepared pose, and how sure that is.
  TransferReport report(const PreparedIdentity& identity, const PreparedPose& pose) const {
    TransferReport report;
    report.read = identity.body_ != nullptr && pose.body_ != nullptr;
    if (report.read) {
      report.identity_confidence = identity.body_->confidence, report.pose_confidence = pose.body_->confidence;
      report.identity_notes = identity.body_->notes, report.pose_notes = pose.body_->notes;
    }
    report.method = by_body(identity, pose) ? Method::body : Method::network;
    return report;
  }

  /// What moves a prepared identity where it goes through bodies: its skeleton and skin weights. Nothing where it
  /// doesn't, and where results are refined, which no skeleton can say.
  std::optional<SkinnedSkeleton> skeleton(const PreparedIdentity& identity) const {
    if (identity.binding_ == nullptr || identity.refinement_ != nullptr) return std::nullopt;
    return body_->skeleton(*identity.binding_);
  }
  /// [J] How the joints of skeleton() move to a prepared pose. Requires report().method == Method::body.
  std::vector<Affine> motions(const PreparedIdentity& identity, const PreparedPose& pose) const {
    NPT_ASSERT(by_body(identity, pose));
    return body_->motions(*identity.binding_, *pose.body_);
  }

  /// The joints of a prepared mesh. Requires report().method == Method::body with it.
  JointPose joints(const PreparedIdentity& identity) const {
    NPT_ASSERT(body_ != nullptr && identity.body_ != nullptr);
    return body_->joints(*identity.body_);
  }
  JointPose joints(const PreparedPose& pose) const {
    NPT_ASSERT(body_ != nullptr && pose.body_ != nullptr);
    return body_->joints(*pose.body_);
  }

  /// Gives a prepared identity a prepared pose: writes its new positions [V, 3].
  void operator()(const PreparedIdentity& identity, const PreparedPose& pose, std::span<float> result) const {
    internal::expect_result(result.size(), 3 * identity.vertices_);
    const bool known = pose.codes_.size() == network_.run_count() || (pose.codes_.empty() && pose.body_ != nullptr);
    if (identity.vertices_ == 0 || !known || (pose.body_ != nullptr && body_ == nullptr))
      throw Error({.file = identity.vertices_ == 0 ? "identity" : "pose",
                   .found = "one that this transfer didn't prepare",
                   .expected = "a prepared one"});
    if (by_body(identity, pose)) {
      body_->pose(*identity.binding_, *pose.body_, result);
      if (identity.refinement_ != nullptr) identity.refinement_->refine(result);
      return;
    }
    if (identity.not_for_network_ != nullptr) std::rethrow_exception(identity.not_for_network_);
    if (pose.codes_.empty()) {  // it read so well that it wasn't encoded, but the identity doesn't
      const auto lease = pool_.lease();
      const MeshView mesh{pose.xyz_, pose.triangles_, "pose"};
      network_.choose(mesh, identity.vertices_, lease->choice);
      network_.encode(mesh, lease->choice, lease->late_pose);
      return (*this)(identity, lease->late_pose, result);
    }
    network_.decode(identity, pose, result);
    if (!identity.triangles_.empty()) expect_whole(identity, result);
  }
  /// Gives a prepared identity the pose of a mesh.
  void operator()(const PreparedIdentity& identity, const MeshView& pose, std::span<float> result) const {
    const auto lease = pool_.lease();
    prepare_pose(pose, identity.vertices_, lease->prepared_pose);
    (*this)(identity, lease->prepared_pose, result);
  }

  /// Whether the network meets the vertices of pose and identity one by one, so that pairings matter.
  bool pairs_vertices() const noexcept { return network_.pairs_vertices(); }
  /// The options that it was opened with, and what the weights' file says for those that were left open.
  const TransferOptions& options() const noexcept { return network_.options(); }
  /// What the weights' file calls the network's variant.
  const Metadata& variant() const noexcept { return network_.variant(); }
  /// The engine beneath, for experts: its coordinates are the network's own.
  const engine::Core<float, Exec>& engine() const noexcept { return network_.engine(); }

  /// Metres in one unit of a mesh: as given in the options, or told from its extent; 1 where the weights ask for no
  /// unit.
  double unit_of(const MeshView& mesh) const { return network_.unit_of(mesh); }

  /// Whether it has the way through bodies.
  bool has_body() const noexcept { return body_ != nullptr; }

  /// One line: "bottleneck 256, conv_relu, per-vertex, 4 pairings, mirrored, refined within 0.04, people through
  /// bodies".
  std::string description() const {
    return network_.description() + (body_ != nullptr ? ", people through bodies" : "");
  }

 private:
  void open_body(const SafetensorsFile& file) {
    const std::string* named = file.find_metadata("reader");
    const bool wanted = options().body != nullptr && options().method != Method::network;
    if (wanted && (named != nullptr || !options().reader.empty())) {
      const std::filesystem::path reader =
          !options().reader.empty() ? options().reader : std::filesystem::path(file.name()).parent_path() / *named;
      if (!std::filesystem::exists(reader))
        throw Error(
            {.file = reader.string(),
             .found = "no such file",
             .expected = "the reader that " + file.name() +
                         " goes with, beside it as npt ships it; or a "
                         "TransferOptions::reader of your own, or Method::network (--reader, --method network)"});
      body_ = options().body(reader, static_cast<int>(engine().executor().slots()));
    }
    if (body_ == nullptr && options().method == Method::body)
      throw Error(
          {.file = file.name(),
           .found = options().body == nullptr ? "method body without options.body" : "no reader named by its metadata",
           .expected = "weights of people with their reader, and npt::body_method"});
  }

  std::shared_ptr<const BodyRead> read_body(const MeshView& mesh) const {
    if (body_ == nullptr) return nullptr;
    if (mesh.triangles.empty() && options().method != Method::body) return nullptr;  // a cloud of points has no surface
    try {
      return body_->read(mesh);
    } catch (const Error&) {
      if (options().method == Method::body) throw;
      return nullptr;  // no surface, or coordinates that are not finite: the network takes or refuses it
    }
  }
  bool may_take(const BodyRead* read) const {
    return read != nullptr && (options().method == Method::body || read->confidence >= least_confidence);
  }
  bool by_body(const PreparedIdentity& identity, const PreparedPose& pose) const {
    return identity.binding_ != nullptr && may_take(pose.body_.get());
  }
  /// Prepares an identity that was read. What stands in the network's way alone, such as a unit that can't be told, is
  /// kept back for when the network is asked.
  void prepare_identity(const MeshView& identity, std::shared_ptr<const BodyRead> read,
                        PreparedIdentity& prepared) const {
    prepared.body_ = std::move(read);
    prepared.binding_ = nullptr;
    prepared.not_for_network_ = nullptr;
    if (may_take(prepared.body_.get())) prepared.binding_ = body_->bind(identity, *prepared.body_);
    const bool judged = body_ != nullptr && options().method == Method::automatic && !options().keep_distorted;
    const auto kept = judged ? identity.triangles : std::span<const Triangle>();
    prepared.triangles_.assign(kept.begin(), kept.end());
    prepared.xyz_.assign(identity.xyz.begin(), kept.empty() ? identity.xyz.begin() : identity.xyz.end());
    try {
      network_.prepare_identity(identity, prepared);
    } catch (const Error&) {
      if (prepared.binding_ == nullptr) throw;
      prepared.not_for_network_ = std::current_exception();
      prepared.unit_ = 1;
      prepared.vertices_ = identity.vertex_count();
    }
  }
  /// Errors    npt::Error for what the network tore apart; NaN comes through
  static void expect_whole(const PreparedIdentity& identity, std::span<const float> result) {
    // Transfers that came out well have 0.12 to 0.35, a robed figure, in three poses that can't be read, 0.6 to 1.8.
    constexpr double torn = 0.5;
    const double change = edge_change(identity.xyz_, result, identity.triangles_);
    if (change > torn)
      throw Error({.file = "result",
                   .found = "a mesh that the network tore apart, its edges changed by " +
                            std::to_string(std::lround(100 * change)) + " %",
                   .expected = "at most 50 %, as of meshes and poses that the network knows; Method::network (--method "
                               "network) gives the result all the same, Method::body (--method body) what a body makes "
                               "of the pair"});
  }
  /// Takes a pose mesh that was read, and encodes it unless the network will hardly be asked.
  void take_pose(const MeshView& mesh, const PoseChoice& choice, std::shared_ptr<const BodyRead> read,
                 PreparedPose& prepared) const {
    prepared.body_ = std::move(read);
    if (!may_take(prepared.body_.get())) return network_.encode(mesh, choice, prepared);
    prepared.codes_.clear();
    prepared.count_ = 0;
    prepared.xyz_.assign(mesh.xyz.begin(), mesh.xyz.end());
    prepared.triangles_.assign(mesh.triangles.begin(), mesh.triangles.end());
  }

  /// Job by job; an identity or a pose that the job before had is not read again.
  void run_by_body(std::span<const TransferJob> jobs) const {
    PreparedIdentity identity;
    PreparedPose pose;
    for (std::size_t j = 0; j < jobs.size(); ++j) {
      const TransferJob& job = jobs[j];
      internal::expect_result(job.result.size(), job.identity.xyz.size());
      const bool known_identity = j > 0 && internal::same_memory(job.identity, jobs[j - 1].identity);
      const bool known_pose = j > 0 && internal::same_memory(job.pose, jobs[j - 1].pose) &&
                              (!pairs_vertices() || job.identity.xyz.size() == jobs[j - 1].identity.xyz.size());
      if (!known_identity && !known_pose) {
        prepare(job.identity, job.pose, identity, pose);
      } else {
        if (!known_identity) prepare_identity(job.identity, identity);
        if (!known_pose) prepare_pose(job.pose, job.identity.vertex_count(), pose);
      }
      if (job.report != nullptr) *job.report = report(identity, pose);
      (*this)(identity, pose, job.result);
    }
  }

  /// A mesh's triangles where something asks for them.
  std::vector<Triangle> triangles_of(const Mesh& identity) const {
    return options().refinement != nullptr || body_ != nullptr ? triangulate(identity) : std::vector<Triangle>();
  }

  /// The memory of one call.
  struct Scratch {
    PoseChoice choice;
    PreparedPose prepared_pose, late_pose;
  };

  NetworkTransfer<Exec> network_;
  std::shared_ptr<const BodyMethod> body_;
  Pool<Scratch> pool_;
};

/// The door as most hosts use it: on oneTBB, or serial without.
using PoseTransfer = BasicPoseTransfer<>;

#ifdef NPT_PREBUILT
extern template const std::vector<NetworkType<DefaultExecutor>>& network_types<AllNetworks, DefaultExecutor>();
extern template class NetworkTransfer<DefaultExecutor>;
extern template class BasicPoseTransfer<DefaultExecutor>;
#endif

}  // namespace npt::inline NPT_ABI
