/// The door of the library: weights from a file, meshes as they come, the identity mesh in the pose mesh's pose.
///
///   const auto transfer = npt::PoseTransfer::open("human.safetensors");
///   npt::Mesh posed = transfer(identity, pose);
///
/// Meshes come in any vertex order, any number of vertices, any place, and in metres, centimetres or millimetres. The
/// identity says where the result lies: its centre, scale and unit are taken out before the network and put back after
/// it. The pose mesh is normalised by itself (Wang et al., CVPR 2020, section 4.1).
#pragma once

#include <npt/config.hpp>
#include <npt/core/aligned.hpp>
#include <npt/core/as_span.hpp>
#include <npt/core/error.hpp>
#include <npt/core/pool.hpp>
#include <npt/core/tensor_adapter.hpp>
#include <npt/engine/core.hpp>
#include <npt/engine/engine.hpp>
#include <npt/engine/model.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/parallel/default_executor.hpp>
#include <npt/scene/affine.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/body_method.hpp>
#include <npt/transfer/network_list.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/pose_points.hpp>
#include <npt/transfer/prepared.hpp>
#include <npt/transfer/settings.hpp>
#include <npt/weights/weights_file.hpp>

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

/// One transfer of a batch, on borrowed memory.
struct TransferJob {
  MeshView identity, pose;
  std::span<float> result;           ///< [V, 3], in the identity's order, units and place
  TransferReport* report = nullptr;  ///< where to say how it was made, if anybody wants to know
};

/// A network with its weights, and all that stands between meshes and it. With TransferOptions::body, people in any
/// pose and of any proportions go another way, through bodies (transfer/body_method.hpp), and the network takes the
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
      : engine_(type.pack(values, std::move(executor), options.precision)),
        options_(complete_options(options, metadata, name)),
        variant_(type.variant),
        paired_(type.program->paired),
        in_metres_(names_metres(metadata) && *options_.normalisation != Normalisation::sphere) {
    check_options(options_, paired_);
  }

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
    if (body_ != nullptr && options_.method != Method::network) return run_by_body(jobs);
    const auto lease = pool_.lease();
    for (const TransferJob& job : jobs)
      if (job.report != nullptr) *job.report = {};
    while (!jobs.empty()) jobs = jobs.subspan(run_some(*lease, jobs));
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
    const MeshView mesh = named(identity, "identity");
    internal::expect_transferable(mesh);
    prepare_identity(mesh, read_body(mesh), prepared);
  }

  /// Prepares an identity and the first pose for it, the bodies of both read side by side.
  void prepare(const MeshView& identity, const MeshView& pose, PreparedIdentity& prepared_identity,
               PreparedPose& prepared_pose) const {
    internal::expect_transferable(named(identity, "identity"));
    internal::expect_transferable(named(pose, "pose"));
    std::array<std::shared_ptr<const BodyRead>, 2> reads;
    engine_.executor().for_each(2, [&](int i, int) {
      reads[static_cast<std::size_t>(i)] = read_body(i == 0 ? named(identity, "identity") : named(pose, "pose"));
    });
    prepare_identity(named(identity, "identity"), std::move(reads[0]), prepared_identity);
    const auto lease = pool_.lease();
    choose(named(pose, "pose"), identity.vertex_count(), lease->choice, lease->pose_choice);
    take_pose(named(pose, "pose"), lease->pose_choice, std::move(reads[1]), *lease, prepared_pose);
  }

  /// Chooses the points that stand for every frame of a sequence, on its first frame. `identity_vertices`: of the
  /// identities that take the poses; it doesn't matter where the network pairs no vertices.
  PoseChoice choose_points(const MeshView& first_frame, std::size_t identity_vertices) const {
    PoseChoice choice;
    choose_points(first_frame, identity_vertices, choice);
    return choice;
  }
  void choose_points(const MeshView& first_frame, std::size_t identity_vertices, PoseChoice& choice) const {
    const auto lease = pool_.lease();
    const MeshView pose = named(first_frame, "pose");
    internal::expect_transferable(pose);
    choose(pose, identity_vertices, lease->choice, choice);
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
    const MeshView mesh = named(pose, "pose");
    internal::expect_transferable(mesh);
    choose(mesh, identity_vertices, lease->choice, lease->pose_choice);
    take_pose(mesh, lease->pose_choice, read_body(mesh), *lease, prepared);
  }
  /// Encodes a frame of a sequence, by the points chosen on its first one, into memory that is used again.
  /// `last`: how the frame before it was read as a body, to go on from; nullptr: it is read by itself.
  void prepare_pose(const MeshView& frame, const PoseChoice& choice, PreparedPose& prepared,
                    const BodyRead* last = nullptr) const {
    const auto lease = pool_.lease();
    const MeshView mesh = named(frame, "pose");
    internal::expect_transferable(mesh);
    if (choice.pairings_.size() != pairing_count())
      throw Error({.file = "chosen points",
                   .found = std::to_string(choice.pairings_.size()) + " pairings",
                   .expected = std::to_string(pairing_count()) + ", as this transfer's choose_points makes"});
    take_pose(mesh, choice, last == nullptr || body_ == nullptr ? read_body(mesh) : body_->follow(mesh, *last), *lease,
              prepared);
  }

  /// How a prepared identity takes a prepared pose, and how sure that is.
  TransferReport report(const PreparedIdentity& identity, const PreparedPose& pose) const {
    TransferReport report;
    report.read = identity.body_ != nullptr && pose.body_ != nullptr;
    if (report.read) {
      report.identity_trust = identity.body_->trust, report.pose_trust = pose.body_->trust;
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
  ReadJoints joints(const PreparedIdentity& identity) const {
    NPT_ASSERT(body_ != nullptr && identity.body_ != nullptr);
    return body_->joints(*identity.body_);
  }
  ReadJoints joints(const PreparedPose& pose) const {
    NPT_ASSERT(body_ != nullptr && pose.body_ != nullptr);
    return body_->joints(*pose.body_);
  }

  /// Gives a prepared identity a prepared pose: writes its new positions [V, 3].
  void operator()(const PreparedIdentity& identity, const PreparedPose& pose, std::span<float> result) const {
    check_result(result.size(), 3 * identity.vertices_);
    const bool known = pose.codes_.size() == run_count() || (pose.codes_.empty() && pose.body_ != nullptr);
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
      choose(mesh, identity.vertices_, lease->choice, lease->pose_choice);
      encode(mesh, lease->pose_choice, *lease, lease->late_pose);
      return (*this)(identity, lease->late_pose, result);
    }
    if (options_.mirror && identity.mirrored_.empty())
      throw Error({.file = "identity",
                   .found = "one prepared without its mirror image",
                   .expected = "one that this transfer prepared"});
    const auto lease = pool_.lease();
    lease->sum.assign(result.size(), 0.0);
    lease->results.resize(result.size());
    for (std::size_t r = 0; r < run_count(); ++r) {
      const std::span<float> own = as_span(lease->results);
      engine_.decode(pose.codes_[r], input_of(identity, r), own);
      add(own, mirrors(r), lease->sum);
    }
    finish(identity, lease->sum, result);
    if (!identity.triangles_.empty()) expect_whole(identity, result);
  }
  /// Gives a prepared identity the pose of a mesh.
  void operator()(const PreparedIdentity& identity, const MeshView& pose, std::span<float> result) const {
    const auto lease = pool_.lease();
    prepare_pose(pose, identity.vertices_, lease->prepared_pose);
    (*this)(identity, lease->prepared_pose, result);
  }

  /// Whether the network meets the vertices of pose and identity one by one, so that pairings matter.
  bool pairs_vertices() const noexcept { return paired_; }
  /// The options that it was opened with, and what the weights' file says for those that were left open.
  const TransferOptions& options() const noexcept { return options_; }
  /// What the weights' file calls the network's variant.
  const Metadata& variant() const noexcept { return variant_; }
  /// The engine beneath, for experts: its coordinates are the network's own.
  const engine::Core<float, Exec>& engine() const noexcept { return engine_; }

  /// Metres in one unit of a mesh: as given in the options, or told from its extent; 1 where the weights ask for no
  /// unit.
  double unit_of(const MeshView& mesh) const {
    if (!in_metres_) return 1;
    return options_.unit ? *options_.unit : npt::unit_of(mesh);
  }

  /// Whether it has the way through bodies.
  bool has_body() const noexcept { return body_ != nullptr; }

  /// One line: "bottleneck 256, conv_relu, per-vertex, 4 pairings, mirrored, refined within 0.04, people through
  /// bodies".
  std::string description() const {
    std::string text = variant_name(variant_);
    if (paired_ && options_.pairing == Pairing::as_given) text += ", paired as given";
    if (pairing_count() > 1) text += ", " + std::to_string(options_.pairings) + " pairings";
    if (options_.mirror) text += ", mirrored";
    if (options_.refinement != nullptr) text += ", refined within " + number_text(*options_.refine_radius);
    if (body_ != nullptr) text += ", people through bodies";
    return text;
  }

 private:
  /// Vertices that a batch carries through the network together, over all of its runs: its inputs and results wait in
  /// memory.
  static constexpr std::size_t batch_vertices = 65536;

  void open_body(const SafetensorsFile& file) {
    const std::string* named = file.find_metadata("reader");
    const bool wanted = options_.body != nullptr && options_.method != Method::network;
    if (wanted && (named != nullptr || !options_.reader.empty())) {
      const std::filesystem::path reader =
          !options_.reader.empty() ? options_.reader : std::filesystem::path(file.name()).parent_path() / *named;
      if (!std::filesystem::exists(reader))
        throw Error(
            {.file = reader.string(),
             .found = "no such file",
             .expected = "the reader that " + file.name() +
                         " goes with, beside it as npt ships it; or a "
                         "TransferOptions::reader of your own, or Method::network (--reader, --method network)"});
      body_ = options_.body(reader, static_cast<int>(engine_.executor().slots()));
    }
    if (body_ == nullptr && options_.method == Method::body)
      throw Error(
          {.file = file.name(),
           .found = options_.body == nullptr ? "method body without options.body" : "no reader named by its metadata",
           .expected = "weights of people with their reader, and npt::body_method"});
  }

  std::shared_ptr<const BodyRead> read_body(const MeshView& mesh) const {
    if (body_ == nullptr) return nullptr;
    if (mesh.triangles.empty() && options_.method != Method::body) return nullptr;  // a cloud of points has no surface
    try {
      return body_->read(mesh);
    } catch (const Error&) {
      if (options_.method == Method::body) throw;
      return nullptr;  // no surface, or coordinates that are not finite: the network takes or refuses it
    }
  }
  bool may_take(const BodyRead* read) const {
    return read != nullptr && (options_.method == Method::body || read->trust >= least_trust);
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
    const bool judged = body_ != nullptr && options_.method == Method::automatic && !options_.keep_torn;
    const auto kept = judged ? identity.triangles : std::span<const Triangle>();
    prepared.triangles_.assign(kept.begin(), kept.end());
    prepared.xyz_.assign(identity.xyz.begin(), kept.empty() ? identity.xyz.begin() : identity.xyz.end());
    try {
      prepare_identity(identity, prepared, pool_.lease()->choice);
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
  template <class AnyScratch>
  void take_pose(const MeshView& mesh, const PoseChoice& choice, std::shared_ptr<const BodyRead> read,
                 AnyScratch& scratch, PreparedPose& prepared) const {
    prepared.body_ = std::move(read);
    if (!may_take(prepared.body_.get())) return encode(mesh, choice, scratch, prepared);
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
      check_result(job.result.size(), job.identity.xyz.size());
      const bool known_identity = j > 0 && same(job.identity, jobs[j - 1].identity);
      const bool known_pose = j > 0 && same(job.pose, jobs[j - 1].pose) &&
                              (!paired_ || job.identity.xyz.size() == jobs[j - 1].identity.xyz.size());
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

  static bool same(const MeshView& a, const MeshView& b) {
    return a.xyz.data() == b.xyz.data() && a.xyz.size() == b.xyz.size() && a.triangles.data() == b.triangles.data() &&
           a.triangles.size() == b.triangles.size();
  }

  /// The memory of one call.
  struct Scratch {
    ChoiceScratch choice;
    PoseChoice pose_choice;
    PreparedPose prepared_pose, late_pose;
    std::vector<float> points;
    std::vector<std::vector<float>> inputs;    ///< by run of a batch: pose points
    std::vector<std::vector<float>> outputs;   ///< by run of a batch
    std::vector<PreparedIdentity> identities;  ///< by job of a batch
    std::vector<TransferPair<float>> pairs;
    std::vector<std::size_t> identity_of;  ///< by job of a batch: place in identities
    std::vector<std::size_t> first_input;  ///< by job of a batch: place in inputs
    std::vector<float> results;
    std::vector<double> sum;
  };

  static MeshView named(MeshView mesh, std::string_view name) {
    if (mesh.name.empty()) mesh.name = name;
    return mesh;
  }
  /// A mesh's triangles where something asks for them.
  std::vector<Triangle> triangles_of(const Mesh& identity) const {
    return options_.refinement != nullptr || body_ != nullptr ? triangulate(identity) : std::vector<Triangle>();
  }

  std::size_t pairing_count() const noexcept { return paired_ ? static_cast<std::size_t>(options_.pairings) : 1; }
  std::size_t run_count() const noexcept { return pairing_count() * (options_.mirror ? 2 : 1); }
  /// Whether run number r is of the mirror images.
  bool mirrors(std::size_t r) const noexcept { return r >= pairing_count(); }
  std::span<const float> input_of(const PreparedIdentity& identity, std::size_t r) const {
    return as_span(mirrors(r) ? identity.mirrored_ : identity.coordinates_);
  }

  static void check_result(std::size_t found, std::size_t expected) {
    if (found != expected)
      throw Error({.file = "result",
                   .found = std::to_string(found) + " numbers",
                   .expected = std::to_string(expected) + ", three for each of the identity's vertices"});
  }

  /// From a mesh's coordinates to the network's, the unit included.
  NormalisingTransform transform_of(const MeshView& mesh, double unit) const {
    NormalisingTransform transform = normalising_transform(mesh.xyz, *options_.normalisation, mesh.name);
    transform.scale *= unit;
    return transform;
  }

  void prepare_identity(const MeshView& mesh, PreparedIdentity& prepared, ChoiceScratch& scratch) const {
    const MeshView identity = named(mesh, "identity");
    internal::expect_transferable(identity);
    prepared.vertices_ = 0;
    prepared.unit_ = unit_of(identity);
    prepared.transform_ = transform_of(identity, prepared.unit_);
    prepared.coordinates_.resize(identity.xyz.size());
    prepared.place_.clear();
    // Coincident vertices, as along seams, take the result of one of them: paired with different points they would
    // part.
    const bool by_place = paired_ && options_.pairing == Pairing::random;
    if (options_.invariant || by_place) canonical_order(identity.xyz, scratch.keys, scratch.canonical);
    if (by_place || options_.invariant)
      coincident_representatives(identity.xyz, as_span(scratch.canonical), prepared.place_);
    if (!options_.invariant) {
      prepared.transform_.apply(identity.xyz, as_span(prepared.coordinates_));
    } else {
      scratch.place.resize(scratch.canonical.size());
      for (std::size_t i = 0; i < scratch.canonical.size(); ++i) {
        const std::size_t v = scratch.canonical[i];
        scratch.place[v] = static_cast<std::uint32_t>(i);
        prepared.transform_.apply(identity.xyz.subspan(3 * v, 3), as_span(prepared.coordinates_).subspan(3 * i, 3));
      }
      for (std::uint32_t& place : prepared.place_) place = scratch.place[place];
    }
    if (options_.mirror) internal::mirror(as_span(prepared.coordinates_), prepared.mirrored_);
    prepared.refinement_ =
        options_.refinement == nullptr ? nullptr : options_.refinement(identity, *options_.refine_radius);
    prepared.vertices_ = identity.vertex_count();
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

  void encode(const MeshView& pose, const PoseChoice& choice, Scratch& scratch, PreparedPose& prepared) const {
    const NormalisingTransform transform = transform_of(pose, unit_of(pose));
    prepared.codes_.resize(run_count());
    for (std::size_t r = 0; r < run_count(); ++r) {
      pose_input(pose, transform, choice, r, scratch.points);
      engine_.encode(scratch.points, prepared.codes_[r]);
    }
    prepared.count_ = paired_ ? choice.pairings_.front().count() : 0;
  }

  /// The first jobs of a batch, as many as share the network's sweeps; returns their number.
  std::size_t run_some(Scratch& scratch, std::span<const TransferJob> jobs) const {
    scratch.identity_of.clear();
    scratch.first_input.clear();
    std::size_t count = 0, vertices = 0, identities = 0, inputs = 0;
    while (count < jobs.size() && (count == 0 || vertices < batch_vertices)) {
      const TransferJob& job = jobs[count];
      check_result(job.result.size(), job.identity.xyz.size());
      if (count == 0 || !same(job.identity, jobs[count - 1].identity)) {
        if (scratch.identities.size() == identities) scratch.identities.emplace_back();
        prepare_identity(job.identity, scratch.identities[identities++], scratch.choice);
      }
      const bool known = count > 0 && same(job.pose, jobs[count - 1].pose) &&
                         (!paired_ || job.identity.xyz.size() == jobs[count - 1].identity.xyz.size());
      if (!known) {
        const MeshView pose = named(job.pose, "pose");
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
    scratch.pairs.clear();
    for (std::size_t j = 0; j < jobs.size(); ++j)
      for (std::size_t r = 0; r < run_count(); ++r) {
        std::vector<float>& output = scratch.outputs[j * run_count() + r];
        output.resize(jobs[j].result.size());
        scratch.pairs.push_back({.pose = as_span(std::as_const(scratch.inputs[scratch.first_input[j] + r])),
                                 .identity = input_of(scratch.identities[scratch.identity_of[j]], r),
                                 .result = as_span(output)});
      }
    engine_.run(as_span(std::as_const(scratch.pairs)));
  }

  /// Adds the result of a run to the sum of all.
  static void add(std::span<const float> result, bool mirrored, std::vector<double>& sum) {
    for (std::size_t i = 0; i < result.size(); ++i)
      sum[i] += static_cast<double>(mirrored && i % 3 == 0 ? -result[i] : result[i]);
  }

  /// The mean of all runs as positions in the identity's order, units and place.
  void finish(const PreparedIdentity& identity, const std::vector<double>& sum, std::span<float> result) const {
    const auto runs = static_cast<double>(run_count());
    for (std::size_t v = 0; v < identity.vertices_; ++v) {
      const std::size_t from = identity.place_.empty() ? v : identity.place_[v];
      // In double to the end: rounded to float in between, g++ 12 at -O3 leaves that rounding out in a loop's last
      // vertices.
      const Vec3d mean{sum[3 * from] / runs, sum[3 * from + 1] / runs, sum[3 * from + 2] / runs};
      const Vec3f position = identity.transform_.apply_inverse(mean).as<float>();
      result[3 * v] = position.x;
      result[3 * v + 1] = position.y;
      result[3 * v + 2] = position.z;
    }
    if (identity.refinement_ != nullptr) identity.refinement_->refine(result);
  }

  engine::Core<float, Exec> engine_;
  TransferOptions options_;
  Metadata variant_;
  bool paired_;
  bool in_metres_;  ///< the weights were trained in metres and the normalisation keeps scales
  std::shared_ptr<const BodyMethod> body_;
  Pool<Scratch> pool_;
};

/// The door as most hosts use it: on oneTBB, or serial without.
using PoseTransfer = BasicPoseTransfer<>;

#ifdef NPT_PREBUILT
extern template const std::vector<NetworkType<DefaultExecutor>>& network_types<AllNetworks, DefaultExecutor>();
extern template class BasicPoseTransfer<DefaultExecutor>;
#endif

}  // namespace npt::inline NPT_ABI
