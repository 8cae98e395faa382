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
#include <npt/base/control.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/tensor_adapter.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors_class.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/nets/network_type.hpp>
#include <npt/nn/engine/core_class.hpp>
#include <npt/nn/engine/model_class.hpp>
#include <npt/nn/weights/weights.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/character.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/pose.hpp>
#include <npt/transfer/result.hpp>
#include <npt/transfer/result_measures.hpp>
#include <npt/transfer/warning.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
class NetworkTransfer;
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
    return open<Networks>(std::span(&weights, 1), options, Exec(threads));
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
    return open_paths(&find_network<Networks, Exec>, weights, options, executor);
  }
  /// Opens weights that were read already, to run on an executor of the host's.
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(const SafetensorsFile& file, const TransferOptions& options, Exec executor) {
    return open<Networks>(std::span(&file, 1), options, std::move(executor));
  }
  template <class Networks = AllNetworks>
  static BasicPoseTransfer open(std::span<const SafetensorsFile> files, const TransferOptions& options, Exec executor) {
    return open_files(&find_network<Networks, Exec>, files, options, executor);
  }

  /// Random weights of a network of a list, for trying things out: what comes out is no pose transfer.
  static BasicPoseTransfer random(const NetworkType<Exec>& type, std::uint64_t seed, const TransferOptions& options,
                                  Exec executor);

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
                    const std::string& name, const TransferOptions& options, Exec executor);

  /// The identity mesh in the pose mesh's pose: its faces, order, unit and place; normals are renewed if it has any.
  Mesh operator()(const Mesh& identity, const Mesh& pose) const;

  /// Writes the identity's new positions [V, 3], in its order, unit and place. result: may be the identity's own memory
  void operator()(const MeshView& identity, const MeshView& pose, std::span<float> result) const;

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
  void run(std::span<const TransferJob> jobs) const;

  /// Estimates a body for an identity and binds it, once for many poses. name: stands in messages
  Character character(const Mesh& identity, std::string_view name = "identity", const Control& control = {}) const;
  Character character(const MeshView& identity, const Control& control = {}) const;
  /// A character that was saved, for this transfer.
  /// Errors    npt::Error that names the file: not one of a character, or of a domain that this transfer doesn't have
  Character load_character(const std::filesystem::path& path) const;

  /// Estimates the pose of a mesh, once for many characters. identity_vertices: of the characters that will take it;
  /// where the network pairs vertices and 0 stands here, the network encodes the pose each time that it is asked
  Pose pose(const Mesh& mesh, std::size_t identity_vertices = 0, std::string_view name = "pose",
            const Control& control = {}) const;
  Pose pose(const MeshView& mesh, std::size_t identity_vertices = 0, const Control& control = {}) const;

  /// The same into memory that is used again.
  void prepare(const MeshView& identity, Character& prepared, const Control& control = {}) const;
  void prepare(const MeshView& pose, std::size_t identity_vertices, Pose& prepared, const Control& control = {}) const;
  /// An identity and the first pose for it, the bodies of both estimated side by side.
  void prepare(const MeshView& identity, const MeshView& pose, Character& character, Pose& prepared_pose) const;
  /// A frame of a sequence, by the points that were chosen on its first one, into memory that is used again. last: the
  /// frame before it, to go on from; nullptr: the frame is estimated by itself. PoseTracker does this.
  void prepare(const MeshView& frame, const PoseChoice& choice, Pose& prepared, const Pose* last = nullptr) const;

  /// Chooses the points that stand for every frame of a sequence, on its first frame. identity_vertices: of the
  /// characters that take the poses; it doesn't matter where the network pairs no vertices
  PoseChoice choose_points(const MeshView& first_frame, std::size_t identity_vertices) const;
  void choose_points(const MeshView& first_frame, std::size_t identity_vertices, PoseChoice& choice) const;

  /// The character in the pose.
  Result apply(const Character& character, const Pose& pose, const Control& control = {}) const;
  /// Writes the character's new positions [V, 3].
  TransferReport apply(const Character& character, const Pose& pose, std::span<float> result,
                       const Control& control = {}) const;
  /// Gives the character the pose of a mesh.
  TransferReport apply(const Character& character, const MeshView& pose, std::span<float> result) const;

  /// What can be measured of a result that apply() made, also where TransferOptions::measure doesn't ask for it.
  /// Errors    npt::Error for what another transfer prepared, a result of another size, and an identity without surface
  ResultMeasures measure(const Character& character, const Pose& pose, std::span<const float> result) const;

  /// How apply() will make its result, and what a user should know of it.
  /// Errors    npt::Error for what another transfer prepared, for what isn't recognised, and for a pose of another
  ///           domain than the character's
  TransferReport report(const Character& character, const Pose& pose) const;

  /// [J] How the joints of the character's skeleton move to the pose; none where the network makes the result.
  std::optional<std::vector<Affine>> motions(const Character& character, const Pose& pose) const;

  /// A clip of any skeleton on that which the character's body has: include <npt/transfer/motion/character_motion.hpp>.
  /// Errors    npt::Error for a character that isn't recognised, and what transfer_motion() refuses
  template <class Result = MotionResult>
  Result retarget(const Character& character, const Motion& motion, const MotionOptions& options) const;
  template <class Result = MotionResult>
  Result retarget(const Character& character, const Motion& motion) const;

  /// Whether a network meets the vertices of pose and identity one by one, so that pairings matter.
  bool pairs_vertices() const noexcept;
  /// The options that it was opened with, and what the weights' file says for those that were left open.
  const TransferOptions& options() const noexcept;
  /// What the weights' file calls the network's variant.
  const Metadata& variant() const noexcept;
  /// The engine beneath, for experts: its coordinates are the network's own.
  const engine::Core<float, Exec>& engine() const noexcept;
  /// Metres in one unit of a mesh: as given in the options, or inferred from its extent; 1 where the weights ask for no
  /// unit.
  double unit_of(const MeshView& mesh) const;
  /// Whether it estimates bodies.
  bool has_body() const noexcept;

  /// One line: "bottleneck 256, conv_relu, per-vertex, 4 pairings, mirrored, refined within 0.04, people by body
  /// estimation".
  std::string description() const;

 private:
  using Network = std::unique_ptr<const NetworkTransfer<Exec>>;
  struct Domain;
  struct Found;
  struct Scratch;

  /// The part of a network's time that encoding a pose takes, about; the rest decodes it. Estimating a body takes
  /// longer, as the rest does.
  static constexpr double encoding_share = 0.3;

  /// Finds a file's network in a list: all that is asked of the list's type.
  using FindNetwork = const NetworkType<Exec>& (*)(const SafetensorsFile& file, const Metadata& assume);

  BasicPoseTransfer();

  static BasicPoseTransfer open_paths(FindNetwork find, std::span<const std::filesystem::path> weights,
                                      const TransferOptions& options, const Exec& executor);
  static BasicPoseTransfer open_files(FindNetwork find, std::span<const SafetensorsFile> files,
                                      const TransferOptions& options, const Exec& executor);

  void add(const Metadata& metadata, Network network);
  /// A further file with body estimation is read when a mesh asks for its body, and again for its network.
  void add_file(FindNetwork find, const std::function<SafetensorsFile()>& read, const Metadata& metadata,
                const TransferOptions& options, const Exec& executor);

  /// Body estimation of the file, or of the one beside it that its metadata names (key "body").
  void open_body(const SafetensorsFile& file);
  static Error no_body(const SafetensorsFile& file, const char* expected);

  /// The first file's, whose options and engine stand for all.
  const Domain& main() const noexcept;
  /// Takes what no domain recognises.
  std::size_t default_domain() const noexcept;

  static MeshView checked(const MeshView& mesh, std::string_view role);

  double least_confidence() const { return options().method == Method::body ? 0 : options().body.least_confidence; }

  /// The estimate of the first domain that is sure, or else of the one with the highest confidence. None where no
  /// domain estimates bodies, and, unless the body method was asked for, where the mesh has no surface.
  Found estimate(const MeshView& mesh, const Control& control) const;

  /// What Character and Pose have in common.
  void take(const MeshView& mesh, MeshRole role, Found found, transfer::internal::Prepared& own) const;

  /// Prepared::kind and looked_for.
  void name_kinds(std::span<const std::shared_ptr<const DomainEstimate>> asked,
                  transfer::internal::Prepared& own) const;

  /// What stands in the network's way alone, such as a unit that can't be inferred, is kept back for when the network
  /// is asked.
  /// binding: of a character that was saved; nullptr: the mesh is bound here
  void finish_character(const MeshView& mesh, Found found, std::shared_ptr<const DomainBinding> binding,
                        Character& character) const;
  /// What measures results for an identity, where they are to be measured.
  std::shared_ptr<const ResultMeter> meter(const MeshView& identity) const;

  void finish_pose(const MeshView& mesh, Found found, std::size_t identity_vertices, Pose& pose,
                   const Control& control = {}) const;
  void keep_or_encode(const MeshView& mesh, const PoseChoice& choice, Pose& pose, const Control& control = {}) const;
  static bool taken_by_network(const Pose& pose) { return !pose.own_.recognised && !pose.own_.refused(); }
  /// As keep(), for a pose that isn't encoded. A unit that can't be inferred is an error when the network is asked.
  void keep_for_network(const MeshView& mesh, Pose& pose) const;
  /// Keeps the mesh for when the network is asked.
  static void keep(const MeshView& mesh, Pose& pose, bool encoded = false);
  /// A floor is larger than who stands on it. 1 where no unit makes a person of the figure.
  double unit_of_figure(const MeshView& mesh, const transfer::internal::Prepared& own) const;
  void note_unit(double unit, MeshRole role, transfer::internal::Prepared& own) const;

  void by_network(const Character& character, const Pose& pose, std::span<float> result, const Control& control) const;

  static Error no_weights();
  static Error foreign(const char* what);
  void expect_own(const transfer::internal::Prepared& own, const char* what) const;

  void run_by_network(std::span<const TransferJob> jobs) const;

  /// A mesh's triangles where something asks for them.
  std::vector<Triangle> triangles_of(const Mesh& identity) const;

  std::vector<std::shared_ptr<Domain>> domains_;
  std::shared_ptr<const std::string> owner_ = std::make_shared<const std::string>("transfer");
  Pool<Scratch> pool_;
};

/// The entry point as most hosts use it: on oneTBB, or serial without.
using PoseTransfer = BasicPoseTransfer<>;

#ifdef NPT_COMPILED
extern template class BasicPoseTransfer<DefaultExecutor>;
extern template class BasicCharacter<>;
#endif

}  // namespace npt::inline NPT_ABI
