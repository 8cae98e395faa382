/// The entry point of the library: weights from a file, meshes as people have them, the identity mesh in the pose
/// mesh's pose.
///
///   const auto transfer = npt::PoseTransfer::open("human.safetensors");
///   npt::Mesh posed = transfer(identity, pose);
///
///   npt::Character hero = transfer.character(identity);      estimated and bound once
///   npt::Pose pose = transfer.pose(other);                   estimated once
///   npt::Result result = transfer.apply(hero, pose);         .mesh, .method, .confidence, .warnings
///
/// Meshes come in any vertex order, any number of vertices, any place, and in any unit. The identity says where the
/// result lies: its centre, scale and unit are taken out before the network and put back after it. The pose mesh is
/// normalised by itself (Wang et al., CVPR 2020, section 4.1).
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/aligned.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/control.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/tensor_adapter.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_values.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/character.hpp>
#include <npt/transfer/late_domain.hpp>
#include <npt/transfer/mesh_checks.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/network_transfer.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/pose.hpp>
#include <npt/transfer/result.hpp>
#include <npt/transfer/warning.hpp>
#ifndef NPT_PREBUILT
#include <npt/transfer/open_domain.hpp>
#endif

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

// Of <npt/transfer/motion/character_motion.hpp>, which defines retarget().
struct Motion;
struct MotionOptions;
struct MotionResult;

/// Networks with their weights, the body estimation that belongs to them, and all that stands between them and meshes.
///
/// Methods   where a file holds a body estimator (people's does), meshes are posed by body estimation, and those that
///           it doesn't recognise are refused; the pose transfer network takes meshes without a surface, all meshes
///           where the file holds no estimator, and whatever it is asked for
/// Threads   all members are const and may be called by any number of threads at a time
/// Memory    the network allocates nothing for shapes that were seen before, where it writes into the caller's memory;
///           body estimation does
/// Numerics  the same bits for any number of threads, for batches, and for prepared meshes. NaN in gives NaN out
/// Errors    npt::Error, whose code says what kind: empty meshes, meshes in one point, triangles of vertices that
///           aren't there, results of another size, unequal vertex counts where the network pairs vertices and
///           NetworkOptions::resample is off, an extent that is no person's in any unit where the network is asked,
///           things prepared by another transfer, and, in the automatic method, meshes that aren't recognised
template <class Exec = DefaultExecutor>
class BasicPoseTransfer {
 public:
  /// Opens weights (.safetensors) of any network of the list. What the file's metadata says is followed: network,
  /// normalisation, unit, radius of the refinement. threads 0: as many as the process may use.
  /// Errors    npt::Error that names the file, what its metadata says and what the list has; options out of range
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(const std::filesystem::path& weights, const TransferOptions& options = {},
                                int threads = 0) {
    return open<Networks>(SafetensorsFile::read(weights), options, Exec(threads));
  }
  /// Opens several files, each a domain: a mesh goes to the first that is sure of it, or else to the most confident
  /// one. What none recognises goes to the first without a body estimator, or else to the first. Further files with
  /// body estimation, but for their metadata, are read when a mesh first asks for them, with what npt::Error there is
  /// then.
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(std::initializer_list<std::filesystem::path> weights,
                                const TransferOptions& options = {}, int threads = 0) {
    return open<Networks>(std::span(weights.begin(), weights.size()), options, Exec(threads));
  }
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(std::span<const std::filesystem::path> weights, const TransferOptions& options,
                                Exec executor) {
    BasicPoseTransfer transfer;
    for (const std::filesystem::path& path : weights)
      transfer.add_file<Networks>([path] { return SafetensorsFile::read(path); },
                                  transfer.domains_.empty() ? Metadata() : SafetensorsFile::read_metadata(path),
                                  options, executor);
    return transfer.domains_.empty() ? throw no_weights() : std::move(transfer);
  }
  /// Opens weights that were read already, to run on an executor of the host's.
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(const SafetensorsFile& file, const TransferOptions& options, Exec executor) {
    return open<Networks>(std::span(&file, 1), options, std::move(executor));
  }
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(std::span<const SafetensorsFile> files, const TransferOptions& options, Exec executor) {
    BasicPoseTransfer transfer;
    for (const SafetensorsFile& file : files)
      transfer.add_file<Networks>([file] { return file; }, file.metadata(), options, executor);
    return transfer.domains_.empty() ? throw no_weights() : std::move(transfer);
  }

  /// Random weights of a network of a list, for trying things out: what comes out is no pose transfer.
  static BasicPoseTransfer random(const NetworkType<Exec>& type, std::uint64_t seed, const TransferOptions& options,
                                  Exec executor) {
    AlignedBuffer<float> values(type.buffer_size);
    set_attributes(*type.parameters, values.span());
    randomise_values(*type.parameters, values.span(), seed);
    return BasicPoseTransfer(type, values.span(), {}, "random weights", options, std::move(executor));
  }

  /// A network of the host's own, trained or loaded. metadata: what its weights file says (normalisation, unit).
  template <class Net>
  explicit BasicPoseTransfer(const Model<Net>& model, const TransferOptions& options = {}, int threads = 0,
                             const Metadata& metadata = {})
      : BasicPoseTransfer(model, options, Exec(threads), metadata) {}
  template <class Net>
  BasicPoseTransfer(const Model<Net>& model, const TransferOptions& options, Exec executor,
                    const Metadata& metadata = {})
      : BasicPoseTransfer(network_type<Net, Exec>(), model.buffer(), metadata, "the model", options,
                          std::move(executor)) {}

  /// Weights in a buffer laid out as Model::buffer(). metadata: of their file; name: stands in messages of errors
  BasicPoseTransfer(const NetworkType<Exec>& type, std::span<const float> values, const Metadata& metadata,
                    const std::string& name, const TransferOptions& options, Exec executor) {
    add(metadata,
        std::make_unique<const NetworkTransfer<Exec>>(type, values, metadata, name, options, std::move(executor)));
  }

  /// The identity mesh in the pose mesh's pose: its faces, order, unit and place; normals are renewed if it has any.
  Mesh operator()(const Mesh& identity, const Mesh& pose) const {
    Mesh result = identity;
    const std::vector<Triangle> of_identity = triangles_of(identity), of_pose = triangulate(pose);
    (*this)(MeshView{identity.coordinates(), as_span(of_identity), "identity"},
            MeshView{pose.coordinates(), as_span(of_pose), "pose"}, result.coordinates());
    recompute_normals(result);
    return result;
  }

  /// Writes the identity's new positions [V, 3], in its order, unit and place. result: may be the identity's own memory
  void operator()(const MeshView& identity, const MeshView& pose, std::span<float> result) const {
    const TransferJob job{identity, pose, result};
    run({&job, 1});
  }

  /// The new positions as a tensor of the host's kind ([V, 3] in, [V, 3] out; <npt/adapt/xtensor.hpp>). Faces, which
  /// body estimation, refinement and other vertex counts want, go in by MeshView.
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
    if (!has_body() && domains_.size() == 1) return run_by_network(jobs);
    Character character;
    Pose pose;
    for (std::size_t j = 0; j < jobs.size(); ++j) {
      const TransferJob& job = jobs[j];
      internal::expect_result(job.result.size(), job.identity.xyz.size());
      const bool known_identity = j > 0 && internal::same_memory(job.identity, jobs[j - 1].identity);
      const bool known_pose = j > 0 && internal::same_memory(job.pose, jobs[j - 1].pose) &&
                              (!pairs_vertices() || job.identity.xyz.size() == jobs[j - 1].identity.xyz.size());
      if (!known_identity && !known_pose) {
        prepare(job.identity, job.pose, character, pose);
      } else {
        if (!known_identity) prepare(job.identity, character);
        if (!known_pose) prepare(job.pose, job.identity.vertex_count(), pose);
      }
      const TransferReport report = apply(character, pose, job.result);
      if (job.report != nullptr) *job.report = report;
    }
  }

  /// Estimates a body for an identity and binds it, once for many poses. name: stands in messages
  Character character(const Mesh& identity, std::string_view name = "identity", const Control& control = {}) const {
    Character prepared;
    const std::vector<Triangle> triangles = triangulate(identity);
    prepare(MeshView{identity.coordinates(), as_span(triangles), name}, prepared, control);
    prepared.mesh_ = std::make_shared<const Mesh>(identity);
    return prepared;
  }
  Character character(const MeshView& identity, const Control& control = {}) const {
    Character prepared;
    prepare(identity, prepared, control);
    return prepared;
  }
  /// A character that was saved, for this transfer.
  /// Errors    npt::Error that names the file: not one of a character, or of a domain that this transfer doesn't have
  Character load_character(const std::filesystem::path& path) const;

  /// Estimates the pose of a mesh, once for many characters. identity_vertices: of the characters that will take it;
  /// where the network pairs vertices and 0 stands here, the network encodes the pose each time that it is asked
  Pose pose(const Mesh& mesh, std::size_t identity_vertices = 0, std::string_view name = "pose",
            const Control& control = {}) const {
    Pose prepared;
    const std::vector<Triangle> triangles = triangulate(mesh);
    prepare(MeshView{mesh.coordinates(), as_span(triangles), name}, identity_vertices, prepared, control);
    return prepared;
  }
  Pose pose(const MeshView& mesh, std::size_t identity_vertices = 0, const Control& control = {}) const {
    Pose prepared;
    prepare(mesh, identity_vertices, prepared, control);
    return prepared;
  }

  /// The same into memory that is used again.
  void prepare(const MeshView& identity, Character& prepared, const Control& control = {}) const {
    const MeshView mesh = checked(identity, "identity");
    finish_character(mesh, estimate(mesh, control), nullptr, prepared);
  }
  void prepare(const MeshView& pose, std::size_t identity_vertices, Pose& prepared, const Control& control = {}) const {
    const MeshView mesh = checked(pose, "pose");
    const double share = has_body() ? 0.7 : 0;  // of estimating a body, beside encoding it
    finish_pose(mesh, estimate(mesh, control.part(0, share)), identity_vertices, prepared, control.part(share, 1));
  }
  /// An identity and the first pose for it, the bodies of both estimated side by side.
  void prepare(const MeshView& identity, const MeshView& pose, Character& character, Pose& prepared_pose) const {
    const std::array<MeshView, 2> meshes{checked(identity, "identity"), checked(pose, "pose")};
    std::array<Found, 2> found;
    engine().executor().for_each(2, [&](int i, int) {
      const auto mesh = static_cast<std::size_t>(i);
      found[mesh] = estimate(meshes[mesh], {});
    });
    finish_character(meshes[0], std::move(found[0]), nullptr, character);
    finish_pose(meshes[1], std::move(found[1]), identity.vertex_count(), prepared_pose);
  }
  /// A frame of a sequence, by the points that were chosen on its first one, into memory that is used again. last: the
  /// frame before it, to go on from; nullptr: the frame is estimated by itself. PoseTracker does this.
  void prepare(const MeshView& frame, const PoseChoice& choice, Pose& prepared, const Pose* last = nullptr) const {
    const MeshView mesh = checked(frame, "pose");
    if (last != nullptr) expect_own(last->own_, "last pose");
    const bool follows = last != nullptr && last->own_.estimate != nullptr && last->own_.body != nullptr;
    Found found = follows ? Found{last->own_.domain, nullptr} : estimate(mesh, {});
    const Domain& domain = *domains_[found.domain];
    if (choice.others_.size() + 1 != domains_.size()) throw foreign("chosen points");
    const PoseChoice& own = found.domain == 0 ? choice : choice.others_[found.domain - 1];
    if (!domain.late) domain.network().expect_chosen(own);
    if (follows) found.estimate = domain.body->follow(mesh, *last->own_.estimate);
    take(mesh, MeshRole::pose, std::move(found), prepared.own_);
    // One frame in doubt, which a warning says, is no reason to refuse a clip.
    prepared.own_.recognised = prepared.own_.recognised || (follows && last->own_.recognised);
    keep_or_encode(mesh, own, prepared);
  }

  /// Chooses the points that stand for every frame of a sequence, on its first frame. identity_vertices: of the
  /// characters that take the poses; it doesn't matter where the network pairs no vertices
  PoseChoice choose_points(const MeshView& first_frame, std::size_t identity_vertices) const {
    PoseChoice choice;
    choose_points(first_frame, identity_vertices, choice);
    return choice;
  }
  void choose_points(const MeshView& first_frame, std::size_t identity_vertices, PoseChoice& choice) const {
    const MeshView mesh = checked(first_frame, "pose");
    choice.others_.resize(domains_.size() - 1);
    for (std::size_t d = 0; d < domains_.size(); ++d)
      if (!domains_[d]->late)  // its network takes no mesh of a sequence
        domains_[d]->network().choose(mesh, identity_vertices, d == 0 ? choice : choice.others_[d - 1]);
  }

  /// The character in the pose.
  Result apply(const Character& character, const Pose& pose, const Control& control = {}) const {
    Result result;
    if (character.mesh_ != nullptr) {
      result.mesh = *character.mesh_;
    } else {
      result.mesh.positions.resize(character.vertex_count());
      set_faces(result.mesh, character.triangles());
    }
    static_cast<TransferReport&>(result) = apply(character, pose, result.mesh.coordinates(), control);
    recompute_normals(result.mesh);
    return result;
  }
  /// Writes the character's new positions [V, 3].
  TransferReport apply(const Character& character, const Pose& pose, std::span<float> result,
                       const Control& control = {}) const {
    TransferReport report = this->report(character, pose);
    internal::expect_result(result.size(), character.xyz_.size());
    if (report.method == Method::body)
      character.own_.body->pose(*character.binding_, *pose.own_.estimate, result);
    else
      by_network(character, pose, result, control);
    if (character.refinement_ != nullptr) character.refinement_->refine(result);
    if (character.meter_ != nullptr) report.measures = measure(character, pose, result);
    return report;
  }
  /// Gives the character the pose of a mesh.
  TransferReport apply(const Character& character, const MeshView& pose, std::span<float> result) const {
    const auto lease = pool_.lease();
    prepare(pose, character.vertex_count(), lease->pose);
    return apply(character, lease->pose, result);
  }

  /// What can be measured of a result that apply() made, also where TransferOptions::measure doesn't ask for it.
  /// Errors    npt::Error for what another transfer prepared, a result of another size, and an identity without surface
  ResultMeasures measure(const Character& character, const Pose& pose, std::span<const float> result) const {
    expect_own(character.own_, "identity");
    expect_own(pose.own_, "pose");
    internal::expect_result(result.size(), character.xyz_.size());
    const MeshView mesh{character.positions(), character.triangles(), character.own_.name};
    if (character.meter_ == nullptr && !internal::has_surface(mesh))
      throw Error({.file = character.own_.name, .found = "no surface", .expected = "triangles, to measure results"});
    ResultMeasures measures = (character.meter_ == nullptr ? ResultMeter(mesh) : *character.meter_).measure(result);
    if (character.own_.estimate != nullptr) measures.identity_coverage = character.own_.estimate->coverage;
    if (pose.own_.estimate != nullptr) measures.pose_coverage = pose.own_.estimate->coverage;
    return measures;
  }

  /// How apply() will make its result, and what a user should know of it.
  /// Errors    npt::Error for what another transfer prepared, for what isn't recognised, and for a pose of another
  ///           domain than the character's
  TransferReport report(const Character& character, const Pose& pose) const {
    expect_own(character.own_, "identity");
    expect_own(pose.own_, "pose");
    const transfer::internal::Prepared &a = character.own_, &b = pose.own_;
    // The network takes a domain's meshes only where it is asked for: what it makes of meshes unlike those of its
    // training is a wreck.
    if (a.refused() || b.refused()) (a.confidence() <= b.confidence() && a.refused() ? a : b).expect_recognised();
    if (a.recognised && b.recognised && a.domain != b.domain)
      throw Error({.file = b.name,
                   .found = "a pose of the domain '" + b.domain_name + "'",
                   .expected = "one of '" + a.domain_name + "', as " + a.name + " is",
                   .code = ErrorCode::domains_differ});
    TransferReport report;
    report.method = a.recognised && b.recognised ? Method::body : Method::network;
    if (a.estimate != nullptr && b.estimate != nullptr)
      report.confidence = std::min(a.estimate->confidence, b.estimate->confidence);
    const bool by_body = report.method == Method::body;
    if (by_body) report.kind = a.recognised_kind();
    report.warnings = by_body ? a.by_body : a.by_network;
    report.warnings.append(by_body ? b.by_body : b.by_network);
    return report;
  }

  /// [J] How the joints of the character's skeleton move to the pose; none where the network makes the result.
  std::optional<std::vector<Affine>> motions(const Character& character, const Pose& pose) const {
    if (report(character, pose).method != Method::body) return std::nullopt;
    return character.own_.body->motions(*character.binding_, *pose.own_.estimate);
  }

  /// A clip of any skeleton on that which the character's body has: include <npt/transfer/motion/character_motion.hpp>.
  /// Errors    npt::Error for a character that isn't recognised, and what transfer_motion() refuses
  template <class Result = MotionResult>
  Result retarget(const Character& character, const Motion& motion, const MotionOptions& options) const;
  template <class Result = MotionResult>
  Result retarget(const Character& character, const Motion& motion) const;

  /// Whether a network meets the vertices of pose and identity one by one, so that pairings matter.
  bool pairs_vertices() const noexcept {
    for (const auto& domain : domains_)
      if (domain->paired) return true;
    return false;
  }
  /// The options that it was opened with, and what the weights' file says for those that were left open.
  const TransferOptions& options() const noexcept { return main().network().options(); }
  /// What the weights' file calls the network's variant.
  const Metadata& variant() const noexcept { return main().network().variant(); }
  /// The engine beneath, for experts: its coordinates are the network's own.
  const engine::Core<float, Exec>& engine() const noexcept { return main().network().engine(); }
  /// Metres in one unit of a mesh: as given in the options, or inferred from its extent; 1 where the weights ask for no
  /// unit.
  double unit_of(const MeshView& mesh) const { return main().network().unit_of(mesh); }
  /// Whether it estimates bodies.
  bool has_body() const noexcept {
    for (const auto& domain : domains_)
      if (domain->body != nullptr) return true;
    return false;
  }

  /// One line: "bottleneck 256, conv_relu, per-vertex, 4 pairings, mirrored, refined within 0.04, people by body
  /// estimation".
  std::string description() const {
    std::string text = main().network().description();
    for (std::size_t d = 0; d < domains_.size(); ++d) {
      if (domains_[d]->body == nullptr) continue;
      // Those that are late needn't be opened for this.
      text += ", " + (domains_[d]->late ? domains_[d]->name + "s" : domains_[d]->body->words().many);
      text += " by body estimation";
    }
    return text;
  }

 private:
  using Network = std::unique_ptr<const NetworkTransfer<Exec>>;
  /// The weights of one file.
  struct Domain {
    Domain(const Metadata& metadata, bool pairs) : paired(pairs) {
      if (const auto named = metadata.find("domain"); named != metadata.end()) name = named->second;
    }
    const NetworkTransfer<Exec>& network() const {
      if (late) std::call_once(once, [this] { opened = late(); });
      return *opened;
    }

    std::string name;
    bool paired = false;              ///< whether the network pairs vertices
    std::function<Network()> late{};  ///< opens the network when it is first asked for; none: it is open
    mutable Network opened{};
    mutable std::once_flag once{};
    std::shared_ptr<const BodyDomain> body{};
  };
  /// What was estimated for a mesh, and by which domain.
  struct Found {
    std::size_t domain = 0;
    std::shared_ptr<const DomainEstimate> estimate{};
    std::vector<std::shared_ptr<const DomainEstimate>> asked{};  ///< of the domains, from the first one on
  };
  /// The memory of one call.
  struct Scratch {
    PoseChoice choice;
    Pose pose;
    NetworkPose late;
  };

  BasicPoseTransfer() = default;

  void add(const Metadata& metadata, Network network) {
    domains_.push_back(std::make_unique<Domain>(metadata, network->pairs_vertices()));
    domains_.back()->opened = std::move(network);
  }
  /// A further file with body estimation is read when a mesh asks for its body, and again for its network.
  template <class Networks>
  void add_file(const std::function<SafetensorsFile()>& read, const Metadata& metadata, const TransferOptions& options,
                const Exec& executor) {
    const auto network_of = [options, executor](const SafetensorsFile& file) {
      const NetworkType<Exec>& type = find_network<Networks, Exec>(file, options.network.assume);
      AlignedBuffer<float> values(type.buffer_size);
      load_values(file, type.variant, *type.parameters, values.span(), options.network.assume);
      return std::make_unique<const NetworkTransfer<Exec>>(type, values.span(), file.metadata(), file.name(), options,
                                                           executor);
    };
    const auto feature = metadata.find("feature");
    const bool late = !domains_.empty() && options.method != Method::network && feature != metadata.end() &&
                      metadata.contains("correspondence/net");
    if (!late) {
      const SafetensorsFile file = read();
      add(file.metadata(), network_of(file));
      return open_body(file);
    }
    domains_.push_back(std::make_unique<Domain>(metadata, feature->second != Pooled::name));
    domains_.back()->late = [read, network_of] { return network_of(read()); };
    domains_.back()->body = std::make_shared<const LateDomain>(
        [read, body = options.body, threads = static_cast<int>(engine().executor().slots())] {
          const SafetensorsFile file = read();
          if (auto domain = open_body_domain(file, body, threads)) return domain;
          throw no_body(file, "those that its metadata tell of");
        });
  }

  /// Body estimation of the file, or of the one beside it that its metadata names (key "body").
  void open_body(const SafetensorsFile& file) {
    if (options().method == Method::network) return;
    const int threads = static_cast<int>(engine().executor().slots());
    std::shared_ptr<const BodyDomain>& body = domains_.back()->body = open_body_domain(file, options().body, threads);
    const std::string* named = file.find_metadata("body");
    if (body == nullptr && named != nullptr) {
      const std::filesystem::path beside = std::filesystem::path(file.name()).parent_path() / *named;
      const bool exists = std::filesystem::exists(beside);
      if (exists) body = open_body_domain(SafetensorsFile::read(beside), options().body, threads);
      if (body == nullptr)
        throw Error({.file = beside.string(),
                     .found = exists ? "weights without body estimation" : "no such file",
                     .expected = "the weights of body estimation that " + file.name() + " goes with, beside it",
                     .code = ErrorCode::missing_weights,
                     .remedy = Remedy::give_weights});
    }
    if (body == nullptr && options().method == Method::body)
      throw no_body(file, "weights with it: the body method needs them");
  }
  static Error no_body(const SafetensorsFile& file, const char* expected) {
    return Error({.file = file.name(),
                  .found = "weights without body estimation",
                  .expected = expected,
                  .code = ErrorCode::missing_weights,
                  .remedy = Remedy::choose_method});
  }

  /// The first file's, whose options and engine stand for all.
  const Domain& main() const noexcept { return *domains_.front(); }
  /// Takes what no domain recognises.
  std::size_t default_domain() const noexcept {
    for (std::size_t d = 0; d < domains_.size(); ++d)
      if (domains_[d]->body == nullptr) return d;
    return 0;
  }

  static MeshView checked(const MeshView& mesh, std::string_view role) {
    const MeshView named = internal::named(mesh, role);
    internal::expect_transferable(named);
    return named;
  }

  double least_confidence() const { return options().method == Method::body ? 0 : options().body.least_confidence; }

  /// The estimate of the first domain that is sure, or else of the one with the highest confidence. None where no
  /// domain estimates bodies, and, unless the body method was asked for, where the mesh has no surface.
  Found estimate(const MeshView& mesh, const Control& control) const {
    Found best{default_domain(), nullptr};
    if (options().method != Method::body && !internal::has_surface(mesh)) return best;
    for (std::size_t d = 0; d < domains_.size(); ++d) {
      if (domains_[d]->body == nullptr) continue;
      best.asked.resize(d + 1);
      best.asked[d] = domains_[d]->body->estimate(mesh, control);
      if (best.estimate == nullptr || best.asked[d]->confidence > best.estimate->confidence)
        best.domain = d, best.estimate = best.asked[d];
      if (best.estimate->confidence >= options().body.high_confidence) break;
    }
    if (domains_.size() > 1 && best.estimate != nullptr && best.estimate->confidence < least_confidence()) {
      best.domain = default_domain();
      if (domains_[best.domain]->body != nullptr) best.estimate = best.asked[best.domain];
    }
    return best;
  }

  /// What Character and Pose have in common.
  void take(const MeshView& mesh, MeshRole role, Found found, transfer::internal::Prepared& own) const {
    const Domain& domain = *domains_[found.domain];
    own.owner = owner_;
    own.domain = found.domain;
    own.domain_name.assign(domain.name);
    own.name.assign(mesh.name);
    own.body = domain.body;
    own.estimate = std::move(found.estimate);
    own.recognised =
        own.estimate != nullptr && domain.body != nullptr && own.estimate->confidence >= least_confidence();
    name_kinds(found.asked, own);
    own.by_body.clear();
    own.by_network.clear();
    if (own.estimate != nullptr && domain.body != nullptr) {
      const double confidence = own.estimate->confidence;
      const auto said = [&](WarningCode code, double value) {
        return Warning{.code = code, .mesh = role, .value = value, .kind = own.kind};
      };
      for (const WarningCode code : own.estimate->warnings) own.by_body.push_back(said(code, 0));
      if (confidence < options().body.high_confidence)
        own.by_body.push_back(said(WarningCode::low_confidence, confidence));
      if (!own.recognised) own.by_network.push_back(said(WarningCode::not_recognised, confidence));
    } else if (has_body()) {
      own.by_network.push_back({WarningCode::no_surface, role, 0});
    }
  }

  /// Prepared::kind and looked_for.
  void name_kinds(std::span<const std::shared_ptr<const DomainEstimate>> asked,
                  transfer::internal::Prepared& own) const {
    own.looked_for.clear();
    own.kind = own.body == nullptr ? nullptr : &own.body->words();
    if (own.recognised || own.estimate == nullptr) return;
    const auto add = [&own](const KindWords& kind, double confidence) {
      own.looked_for += (own.looked_for.empty() ? "" : ", nor as ") + with_article(kind.one) +
                        (own.looked_for.empty() ? " (confidence " : " (") + percent_text(confidence) + ")";
    };
    if (asked.empty() && own.kind != nullptr) add(*own.kind, own.confidence());
    for (std::size_t d = 0; d < asked.size(); ++d)
      if (asked[d] != nullptr) add(domains_[d]->body->words(), asked[d]->confidence);
  }

  /// What stands in the network's way alone, such as a unit that can't be inferred, is kept back for when the network
  /// is asked.
  /// binding: of a character that was saved; nullptr: the mesh is bound here
  void finish_character(const MeshView& mesh, Found found, std::shared_ptr<const DomainBinding> binding,
                        Character& character) const {
    take(mesh, MeshRole::identity, std::move(found), character.own_);
    transfer::internal::Prepared& own = character.own_;
    character.mesh_ = nullptr;
    if (own.recognised && binding == nullptr) binding = own.body->bind(mesh, *own.estimate);
    character.binding_ = own.recognised ? std::move(binding) : nullptr;
    character.xyz_.assign(mesh.xyz.begin(), mesh.xyz.end());
    character.triangles_.assign(mesh.triangles.begin(), mesh.triangles.end());
    character.network_refusal_.reset();
    const NetworkTransfer<Exec>& network = domains_[own.domain]->network();
    try {
      network.prepare_identity(mesh, character.network_);
      note_unit(character.network_.unit, MeshRole::identity, own);
    } catch (const Error& error) {
      if (!own.recognised && !own.refused()) throw;
      character.network_refusal_ = error.parts();
      character.network_.unit = 1;
    }
    if (own.recognised && !own.estimate->figure.empty()) character.network_.unit = unit_of_figure(mesh, own);
    character.refinement_ =
        options().refinement == nullptr
            ? nullptr
            : std::shared_ptr<const Refinement>(options().refinement(mesh, *network.options().refine_radius));
    character.meter_ = meter(mesh);
  }
  /// What measures results for an identity, where they are to be measured.
  std::shared_ptr<const ResultMeter> meter(const MeshView& identity) const {
    const bool measures = options().measure && internal::has_surface(identity);
    return measures ? std::make_shared<const ResultMeter>(identity) : nullptr;
  }

  void finish_pose(const MeshView& mesh, Found found, std::size_t identity_vertices, Pose& pose,
                   const Control& control = {}) const {
    take(mesh, MeshRole::pose, std::move(found), pose.own_);
    if (!taken_by_network(pose) || (identity_vertices == 0 && pairs_vertices())) return keep_for_network(mesh, pose);
    const auto lease = pool_.lease();
    domains_[pose.own_.domain]->network().choose(mesh, identity_vertices, lease->choice);
    keep_or_encode(mesh, lease->choice, pose, control);
  }
  void keep_or_encode(const MeshView& mesh, const PoseChoice& choice, Pose& pose, const Control& control = {}) const {
    const NetworkTransfer<Exec>& network = domains_[pose.own_.domain]->network();
    if (!taken_by_network(pose)) return keep_for_network(mesh, pose);
    network.encode(mesh, choice, pose.network_, control);
    note_unit(network.unit_of(mesh), MeshRole::pose, pose.own_);
    if (domains_.size() > 1) return keep(mesh, pose, true);
    pose.xyz_.clear();
    pose.triangles_.clear();
  }
  static bool taken_by_network(const Pose& pose) { return !pose.own_.recognised && !pose.own_.refused(); }
  /// As keep(), for a pose that isn't encoded. A unit that can't be inferred is an error when the network is asked.
  void keep_for_network(const MeshView& mesh, Pose& pose) const {
    try {
      note_unit(domains_[pose.own_.domain]->network().unit_of(mesh), MeshRole::pose, pose.own_);
    } catch (const Error&) {
    }
    keep(mesh, pose);
  }
  /// Keeps the mesh for when the network is asked.
  static void keep(const MeshView& mesh, Pose& pose, bool encoded = false) {
    if (!encoded) pose.network_.codes.clear(), pose.network_.count = 0;
    pose.xyz_.assign(mesh.xyz.begin(), mesh.xyz.end());
    pose.triangles_.assign(mesh.triangles.begin(), mesh.triangles.end());
  }
  /// A floor is larger than who stands on it. 1 where no unit makes a person of the figure.
  double unit_of_figure(const MeshView& mesh, const transfer::internal::Prepared& own) const {
    std::vector<float> points;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t k = 0; own.estimate->figure[t] && k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) points.push_back(mesh.xyz[3 * mesh.triangles[t][k] + i]);
    try {
      return domains_[own.domain]->network().unit_of({points, {}, mesh.name});
    } catch (const Error&) {
      return 1;
    }
  }
  void note_unit(double unit, MeshRole role, transfer::internal::Prepared& own) const {
    if (unit != 1 && !options().import.unit)
      own.by_network.push_back({WarningCode::unit_assumed, role, unit, Remedy::give_unit});
  }

  void by_network(const Character& character, const Pose& pose, std::span<float> result, const Control& control) const {
    if (character.network_refusal_) throw Error(*character.network_refusal_);
    const NetworkTransfer<Exec>& network = domains_[character.own_.domain]->network();
    const bool encoded = pose.network_.codes.size() == network.run_count() && character.own_.domain == pose.own_.domain;
    if (encoded) return network.decode(character.network_, pose.network_, result, control);
    if (pose.xyz_.empty()) throw foreign("pose");
    // Recognised, so that it wasn't encoded, but the character has no surface; or encoded for no character yet.
    const auto lease = pool_.lease();
    const MeshView mesh{pose.xyz_, pose.triangles_, pose.own_.name};
    network.choose(mesh, character.vertex_count(), lease->choice);
    network.encode(mesh, lease->choice, lease->late, control.part(0, 0.3));
    network.decode(character.network_, lease->late, result, control.part(0.3, 1));
  }

  static Error no_weights() { return Error({.file = "weights", .found = "no files", .expected = "at least one"}); }
  static Error foreign(const char* what) {
    return Error({.file = what,
                  .found = "one that this transfer didn't prepare",
                  .expected = "a prepared one",
                  .code = ErrorCode::foreign});
  }
  void expect_own(const transfer::internal::Prepared& own, const char* what) const {
    if (own.owner != owner_) throw foreign(what);
  }

  void run_by_network(std::span<const TransferJob> jobs) const {
    std::vector<std::shared_ptr<const Refinement>> refinements;
    for (std::size_t j = 0; options().refinement != nullptr && j < jobs.size(); ++j) {
      const bool known = j > 0 && internal::same_memory(jobs[j].identity, jobs[j - 1].identity);
      refinements.push_back(known ? refinements.back()
                                  : std::shared_ptr<const Refinement>(options().refinement(
                                        checked(jobs[j].identity, "identity"), *options().refine_radius)));
    }
    std::vector<std::shared_ptr<const ResultMeter>> meters;  // made before results may overwrite their identities
    for (std::size_t j = 0; options().measure && j < jobs.size(); ++j)
      meters.push_back(jobs[j].report == nullptr ? nullptr : meter(jobs[j].identity));
    main().network().run(jobs);
    for (std::size_t j = 0; j < refinements.size(); ++j) refinements[j]->refine(jobs[j].result);
    for (std::size_t j = 0; j < meters.size(); ++j)
      if (meters[j] != nullptr) jobs[j].report->measures = meters[j]->measure(jobs[j].result);
  }

  /// A mesh's triangles where something asks for them.
  std::vector<Triangle> triangles_of(const Mesh& identity) const {
    return options().refinement != nullptr || has_body() ? triangulate(identity) : std::vector<Triangle>();
  }

  std::vector<std::unique_ptr<Domain>> domains_;
  std::shared_ptr<const std::string> owner_ = std::make_shared<const std::string>("transfer");
  Pool<Scratch> pool_;
};

template <class Exec>
Character BasicPoseTransfer<Exec>::load_character(const std::filesystem::path& path) const {
  const SafetensorsFile file = SafetensorsFile::read(path);
  const std::string* format = file.find_metadata("format");
  const std::string* domain = file.find_metadata("domain");
  if (format == nullptr || *format != "npt character 2" || domain == nullptr)
    throw Error({.file = file.name(),
                 .place = "metadata",
                 .found = format == nullptr ? "no format" : "the format '" + *format + "'",
                 .expected = "'npt character 2', as Character::save writes it"});
  std::size_t d = 0;
  while (d < domains_.size() && (domains_[d]->body == nullptr || domains_[d]->name != *domain)) ++d;
  if (d == domains_.size())
    throw Error({.file = file.name(),
                 .found = "a character of the domain '" + *domain + "'",
                 .expected = "one of the domains that this transfer has",
                 .code = ErrorCode::domains_differ});
  const std::vector<float> xyz = to_values<float>(file.at("positions"), NonFinite::refuse);
  const std::vector<std::int64_t> corners = to_values<std::int64_t>(file.at("triangles"), NonFinite::refuse);
  std::vector<Triangle> triangles(corners.size() / 3);
  for (std::size_t i = 0; i < 3 * triangles.size(); ++i)
    triangles[i / 3][i % 3] = corners[i] < 0 ? no_index : static_cast<std::uint32_t>(corners[i]);
  const std::string name = path.string();
  const MeshView mesh = checked({as_span(xyz), as_span(triangles), name}, name);
  auto [estimate, binding] = domains_[d]->body->load(file);
  Character character;
  finish_character(mesh, {d, std::move(estimate)}, std::move(binding), character);
  return character;
}

/// The entry point as most hosts use it: on oneTBB, or serial without.
using PoseTransfer = BasicPoseTransfer<>;

#ifdef NPT_PREBUILT
extern template class NetworkTransfer<DefaultExecutor>;
extern template class BasicPoseTransfer<DefaultExecutor>;
#endif

}  // namespace npt::inline NPT_ABI
