/// What the package's JavaScript calls: npt behind functions of numbers and pointers. Files are those of the module's
/// own file system, in memory. Every function that can fail returns 0 or nullptr then, and web_error() says why.
///
/// Handles are owned by the caller, who releases each by its function; a mesh, a transfer and an identity must outlive
/// what was made of them.
#include <formats/read.hpp>

#include <npt/base/random.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/json.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/npt.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/body_method.hpp>
#include <npt/transfer/detail_refiner.hpp>
#include <npt/transfer/pose_sequence.hpp>
#include <npt/transfer/root_way.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <emscripten.h>

namespace {

namespace fs = std::filesystem;

/// The paper's network in all its variants. The ablations, a third of the size, are for studies.
template <int Bottleneck>
using Variants = npt::NetworkList<npt::PoseTransferNet<Bottleneck, npt::ConvRelu, npt::PerVertex>,
                                  npt::PoseTransferNet<Bottleneck, npt::ConvRelu, npt::Pooled>,
                                  npt::PoseTransferNet<Bottleneck, npt::ReluConv, npt::PerVertex>,
                                  npt::PoseTransferNet<Bottleneck, npt::ReluConv, npt::Pooled>>;
using Networks = typename npt::internal::JoinedLists<Variants<1024>, Variants<512>, Variants<256>, Variants<128>,
                                                     Variants<64>>::type;

// ---- what went wrong ----

enum class ErrorKind { none, argument, input, memory, internal };

std::string last_error;
ErrorKind last_kind = ErrorKind::none;

void failed(ErrorKind kind, const char* message) {
  last_kind = kind;
  last_error = message;
}

/// f(), or `otherwise` where it throws.
template <class F, class R>
R guarded(R otherwise, const F& f) {
  try {
    return f();
  } catch (const npt::Error& error) {
    failed(ErrorKind::input, error.what());
  } catch (const std::bad_alloc&) {
    failed(ErrorKind::memory, "out of memory");
  } catch (const std::length_error&) {
    failed(ErrorKind::memory, "out of memory");
  } catch (const std::exception& error) {
    failed(ErrorKind::internal, error.what());
  }
  return otherwise;
}

// ---- what JavaScript gets besides numbers ----

/// The last text that was returned: valid until the next one.
std::string last_text;

const char* returned(std::string text) {
  last_text = std::move(text);
  return last_text.c_str();
}

std::string quoted(const std::string& text) {
  std::string result;
  return npt::internal::append_json_string(result, text) ? result : "\"(no UTF-8)\"";
}

std::string number(double x) { return std::isfinite(x) ? npt::number_text(x) : std::string("null"); }

// ---- what there is ----

/// A mesh as a file or its maker gave it, and the clips of its file.
struct Mesh {
  std::string name;
  npt::Mesh mesh{};
  std::vector<npt::Triangle> triangles{};
  bool in_metres = false;  ///< its file says so
  std::unique_ptr<npt::Scene> scene{};
  std::unique_ptr<npt::ScenePoser> poser{};

  npt::MeshView view() const { return {mesh.coordinates(), triangles, name}; }
};

Mesh* adopted(std::unique_ptr<Mesh> mesh) {
  npt::validate(mesh->mesh, mesh->name);
  mesh->triangles = npt::triangulate(mesh->mesh);
  return mesh.release();
}

struct Transfer {
  npt::PoseTransfer transfer;
};

struct Identity {
  const Transfer& owner;
  const Mesh& mesh;
  npt::PreparedIdentity prepared{};
};

struct Pose {
  npt::PreparedPose prepared{};
};

/// Metres in a unit of what is written to `path`, where files say metres and the mesh's own doesn't; else 1.
double metres_in(const Transfer* transfer, const Mesh& mesh, const fs::path& path) {
  if (transfer == nullptr || path.extension() != ".glb" || mesh.in_metres) return 1;
  try {
    return transfer->transfer.options().unit ? *transfer->transfer.options().unit
                                             : transfer->transfer.unit_of(mesh.view());
  } catch (const npt::Error&) {  // no person's size
    return 1;
  }
}

void scale(std::span<float> xyz, double factor) {
  if (factor == 1) return;
  for (float& x : xyz) x = static_cast<float>(static_cast<double>(x) * factor);
}

/// The identity's mesh in other positions.
npt::Mesh moved(const Mesh& identity, std::span<const float> xyz) {
  npt::Mesh mesh = identity.mesh;
  std::copy(xyz.begin(), xyz.end(), mesh.coordinates().begin());
  npt::recompute_normals(mesh);
  npt::validate(mesh, "result for " + identity.name);
  return mesh;
}

/// The frames of a sequence on one identity, kept to become a clip.
class Sequence {
 public:
  explicit Sequence(Identity& identity)
      : identity_(identity), frames_(identity.owner.transfer), skeleton_(transfer().skeleton(identity.prepared)) {
    for (std::size_t j = 0; skeleton_ && j < skeleton_->joint_count(); ++j)
      skeleton_->names[j] = std::string(npt::joint_name(j, npt::JointNames::vrm));
  }

  npt::TransferReport add(const Mesh& pose) {
    const std::size_t vertices = identity_.mesh.mesh.vertex_count();
    frames_.prepare(pose.view(), vertices, pose_);
    std::vector<float> xyz(3 * vertices);
    const npt::TransferReport report = transfer().report(identity_.prepared, pose_);
    transfer()(identity_.prepared, pose_, xyz);
    if (report.method != npt::Method::body) skeleton_.reset();
    if (skeleton_) motions_.push_back(transfer().motions(identity_.prepared, pose_));
    if (report.method == npt::Method::body) poses_.push_back(transfer().joints(pose_));
    positions_.push_back(std::move(xyz));
    return report;
  }

  std::size_t size() const { return positions_.size(); }
  std::span<const float> frame(std::size_t i) const { return positions_.at(i); }

  /// Takes the frames, which all have their root joint in one place, along the pose's way, as npt transfer --clip does:
  /// as far as the identity's legs are longer or shorter; its lowest point stays the lowest of the sequence.
  void follow_root() {
    if (poses_.size() != positions_.size() || poses_.empty()) return;
    const double leg = transfer().joints(identity_.prepared).leg;
    std::vector<double> lowest_of;
    for (const std::vector<float>& xyz : positions_) lowest_of.push_back(npt::bounding_box(xyz).low.y);
    const std::vector<npt::Vec3d> way =
        npt::root_way(leg, poses_, lowest_of, npt::bounding_box(identity_.mesh.mesh.coordinates()).low.y);
    for (std::size_t i = 0; i < way.size(); ++i) {
      npt::move_points(positions_[i], way[i]);
      if (skeleton_)
        for (npt::Affine& motion : motions_[i]) motion.shift += way[i];
    }
  }

  /// A GLB that moves: on a skeleton where all frames went through bodies, else frame by frame.
  void write(const fs::path& path, const std::string& clip, std::span<const double> times) const {
    const double metres = metres_in(&identity_.owner, identity_.mesh, path);
    npt::Mesh identity = identity_.mesh.mesh;
    scale(identity.coordinates(), metres);
    npt::MeshScene made = npt::scene_from(identity, fs::path(identity_.mesh.name).stem().string());
    if (skeleton_) {
      npt::SkinnedSkeleton skeleton = *skeleton_;
      for (npt::Vec3d& joint : skeleton.joints) joint = joint * metres;
      std::vector<std::vector<npt::Affine>> motions = motions_;
      for (auto& of_frame : motions)
        for (npt::Affine& motion : of_frame) motion.shift = motion.shift * metres;
      const std::size_t first = npt::add_skeleton(made, skeleton);
      npt::add_skeleton_clip(made, skeleton, first, clip, times, motions);
    } else {
      std::vector<std::vector<float>> positions = positions_;
      for (std::vector<float>& xyz : positions) scale(xyz, metres);
      npt::add_morph_clip(made, identity, clip, times, positions);
    }
    npt::write_scene(path, made.scene);
  }

 private:
  const npt::PoseTransfer& transfer() const { return identity_.owner.transfer; }

  Identity& identity_;
  npt::PoseSequence<npt::DefaultExecutor> frames_;
  npt::PreparedPose pose_;
  std::optional<npt::SkinnedSkeleton> skeleton_;
  std::vector<std::vector<float>> positions_;
  std::vector<std::vector<npt::Affine>> motions_;
  std::vector<npt::JointPose> poses_;
};

std::string text_of(const npt::TransferReport& report) {
  return std::string("{\"method\":") + (report.method == npt::Method::network ? "\"network\"" : "\"body\"") +
         ",\"read\":" + (report.read ? "true" : "false") + ",\"identityTrust\":" + number(report.identity_confidence) +
         ",\"poseTrust\":" + number(report.pose_confidence) + ",\"identityNotes\":" + quoted(report.identity_notes) +
         ",\"poseNotes\":" + quoted(report.pose_notes) + "}";
}

npt::Random random_for(double seed, std::uint64_t stream) {
  return npt::Random(static_cast<std::uint64_t>(seed), stream);
}

}  // namespace

extern "C" {

#define NPT_WEB EMSCRIPTEN_KEEPALIVE

NPT_WEB const char* web_version() { return NPT_VERSION; }
NPT_WEB const char* web_error() { return last_error.c_str(); }
NPT_WEB int web_error_kind() { return static_cast<int>(last_kind); }

// ---- meshes ----

/// The mesh in a file, in the format that its name says.
NPT_WEB Mesh* web_read(const char* path, const char* name) {
  return guarded(static_cast<Mesh*>(nullptr), [&] {
    auto mesh = std::make_unique<Mesh>(Mesh{.name = name});
    mesh->in_metres = formats::is_scene(path);
    if (mesh->in_metres) {
      mesh->scene = std::make_unique<npt::Scene>(formats::read_scene(path));
      mesh->poser = std::make_unique<npt::ScenePoser>(*mesh->scene, mesh->name);
      mesh->mesh = mesh->poser->mesh();
    } else {
      mesh->mesh = formats::read_mesh(path);
    }
    return adopted(std::move(mesh));
  });
}

/// A mesh of the caller's arrays, which are copied. triangles may be nullptr.
NPT_WEB Mesh* web_make(const char* name, const float* xyz, std::uint32_t vertices, const std::uint32_t* triangles,
                       std::uint32_t triangle_count) {
  return guarded(static_cast<Mesh*>(nullptr), [&] {
    auto mesh = std::make_unique<Mesh>(Mesh{.name = name});
    mesh->mesh.positions.resize(vertices);
    std::copy_n(xyz, std::size_t{3} * vertices, mesh->mesh.coordinates().data());
    if (triangle_count > 0) {
      mesh->mesh.corners.assign(triangles, triangles + std::size_t{3} * triangle_count);
      for (std::size_t f = 0; f <= triangle_count; ++f) mesh->mesh.face_start.push_back(3 * f);
    }
    return adopted(std::move(mesh));
  });
}

/// The built-in mannequin, as npt generate makes it. pose 0: at rest, 1: of the paper's, 2: wide, 3: natural; angles,
/// [24, 3], take its place where they are given.
NPT_WEB Mesh* web_mannequin(const char* name, double shape_seed, int proportions, int pose, double pose_seed,
                            const float* angles) {
  return guarded(static_cast<Mesh*>(nullptr), [&] {
    static std::unique_ptr<const npt::BodyModel> plain, varied;
    std::unique_ptr<const npt::BodyModel>& body = proportions != 0 ? varied : plain;
    if (body == nullptr)
      body = std::make_unique<const npt::BodyModel>(proportions != 0 ? npt::with_proportions(npt::mannequin())
                                                                     : npt::mannequin());
    npt::Random of_shape = random_for(shape_seed, 0), of_pose = random_for(pose_seed, 1);
    std::vector<float> betas = npt::sample_shape(
        of_shape, body->shape_count() - (proportions != 0 ? npt::body_proportion_count : std::size_t{0}));
    if (proportions != 0)
      for (const double p : npt::sample_proportions(of_shape)) betas.push_back(static_cast<float>(p));
    std::vector<float> theta;
    if (angles != nullptr) {
      theta.assign(angles, angles + 3 * npt::smpl_joint_count);
    } else if (pose != 0) {
      constexpr std::array kinds{npt::PoseDistribution::paper, npt::PoseDistribution::wide,
                                 npt::PoseDistribution::natural};
      const auto drawn = npt::sample_pose(of_pose, kinds.at(static_cast<std::size_t>(pose) - 1));
      theta.assign(drawn.begin(), drawn.end());
    }
    return adopted(std::make_unique<Mesh>(Mesh{.name = name, .mesh = npt::to_mesh(*body, betas, theta)}));
  });
}

/// Name, counts, clips, as JSON.
NPT_WEB const char* web_mesh_info(const Mesh* mesh) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    std::string text = "{\"name\":" + quoted(mesh->name) +
                       ",\"vertices\":" + std::to_string(mesh->mesh.vertex_count()) +
                       ",\"faces\":" + std::to_string(mesh->mesh.face_count()) +
                       ",\"triangles\":" + std::to_string(mesh->triangles.size()) + ",\"clips\":[";
    if (mesh->scene != nullptr)
      for (const npt::Clip& clip : mesh->scene->clips)
        text += (text.back() == '[' ? "{\"name\":" : ",{\"name\":") + quoted(clip.name) +
                ",\"length\":" + number(clip.length()) + "}";
    return returned(text + "]}");
  });
}
NPT_WEB const float* web_positions(const Mesh* mesh) { return mesh->mesh.coordinates().data(); }
NPT_WEB const void* web_triangles(const Mesh* mesh) { return mesh->triangles.data(); }

/// Moves the mesh to a time of one of its clips.
NPT_WEB int web_move(Mesh* mesh, std::uint32_t clip, double time) {
  return guarded(0, [&] {
    mesh->poser->positions(&mesh->scene->clips.at(clip), time, mesh->mesh.coordinates());
    npt::recompute_normals(mesh->mesh);
    return 1;
  });
}

/// Writes the mesh in positions of its own or, where xyz is given, in these. `transfer`, which may be nullptr, knows
/// the unit.
NPT_WEB int web_write(const Transfer* transfer, const Mesh* mesh, const float* xyz, const char* path) {
  return guarded(0, [&] {
    const std::size_t count = 3 * mesh->mesh.vertex_count();
    npt::Mesh written = xyz == nullptr ? mesh->mesh : moved(*mesh, {xyz, count});
    scale(written.coordinates(), metres_in(transfer, *mesh, path));
    npt::write_mesh(path, written);
    return 1;
  });
}
NPT_WEB void web_release_mesh(Mesh* mesh) { delete mesh; }

// ---- transfers ----

/// Opens weights. reader: empty for those that have none, whose transfers are all the network's.
/// method 0: automatic, 1: body, 2: network; refine_radius, unit 0: told by weights and meshes; threads 0: all.
NPT_WEB Transfer* web_open(const char* weights, const char* reader, int method, int pairings, int mirror, int refine,
                           double refine_radius, int invariant, int resample, double unit, double seed, int threads) {
  return guarded(static_cast<Transfer*>(nullptr), [&] {
    npt::TransferOptions options;
    options.method = method == 1 ? npt::Method::body : method == 2 ? npt::Method::network : npt::Method::automatic;
    if (*reader != '\0') options.body = npt::body_method, options.reader = reader;
    options.pairings = pairings;
    options.mirror = mirror != 0;
    if (refine != 0) options.refinement = npt::detail_refinement;
    if (refine_radius != 0) options.refine_radius = refine_radius;
    options.invariant = invariant != 0;
    options.resample = resample != 0;
    if (unit != 0) options.unit = unit;
    options.seed = static_cast<std::uint64_t>(seed);
    return new Transfer{npt::PoseTransfer::open<Networks>(weights, options, threads)};
  });
}

/// Its description, and what the weights say of themselves, as JSON.
NPT_WEB const char* web_describe(const Transfer* transfer) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    const npt::PoseTransfer& own = transfer->transfer;
    return returned("{\"description\":" + quoted(own.description()) +
                    ",\"pairsVertices\":" + (own.pairs_vertices() ? "true" : "false") +
                    ",\"hasBody\":" + (own.has_body() ? "true" : "false") + "}");
  });
}
NPT_WEB void web_close(Transfer* transfer) { delete transfer; }

NPT_WEB Identity* web_prepare_identity(const Transfer* transfer, const Mesh* mesh) {
  return guarded(static_cast<Identity*>(nullptr), [&] {
    auto identity = std::make_unique<Identity>(Identity{*transfer, *mesh});
    transfer->transfer.prepare_identity(mesh->view(), identity->prepared);
    return identity.release();
  });
}
NPT_WEB void web_release_identity(Identity* identity) { delete identity; }

NPT_WEB Pose* web_prepare_pose(const Transfer* transfer, const Mesh* mesh, std::uint32_t identity_vertices) {
  return guarded(static_cast<Pose*>(nullptr), [&] {
    auto pose = std::make_unique<Pose>();
    transfer->transfer.prepare_pose(mesh->view(), identity_vertices, pose->prepared);
    return pose.release();
  });
}
NPT_WEB void web_release_pose(Pose* pose) { delete pose; }

/// How a prepared identity takes a prepared pose, as JSON.
NPT_WEB const char* web_report(const Identity* identity, const Pose* pose) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    return returned(text_of(identity->owner.transfer.report(identity->prepared, pose->prepared)));
  });
}

/// result: [V, 3]
NPT_WEB int web_run(const Identity* identity, const Pose* pose, float* result) {
  return guarded(0, [&] {
    identity->owner.transfer(identity->prepared, pose->prepared, {result, 3 * identity->mesh.mesh.vertex_count()});
    return 1;
  });
}

/// Metres in a unit of the mesh, told from its size; 0 where that is no person's.
NPT_WEB double web_unit(const Transfer* transfer, const Mesh* mesh) {
  try {
    return transfer->transfer.unit_of(mesh->view());
  } catch (const std::exception&) {
    return 0;
  }
}

// ---- sequences ----

NPT_WEB Sequence* web_open_sequence(Identity* identity) {
  return guarded(static_cast<Sequence*>(nullptr), [&] { return new Sequence(*identity); });
}
/// Transfers the next frame: its report, as JSON.
NPT_WEB const char* web_add_frame(Sequence* sequence, const Mesh* pose) {
  return guarded(static_cast<const char*>(nullptr), [&] { return returned(text_of(sequence->add(*pose))); });
}
NPT_WEB int web_follow_root(Sequence* sequence) {
  return guarded(0, [&] {
    sequence->follow_root();
    return 1;
  });
}
/// [V, 3]
NPT_WEB const float* web_frame(const Sequence* sequence, std::uint32_t i) {
  return guarded(static_cast<const float*>(nullptr), [&] { return sequence->frame(i).data(); });
}
/// A GLB that moves; times: seconds of each frame.
NPT_WEB int web_write_sequence(const Sequence* sequence, const char* path, const char* clip, const double* times) {
  return guarded(0, [&] {
    sequence->write(path, clip, {times, sequence->size()});
    return 1;
  });
}
NPT_WEB void web_close_sequence(Sequence* sequence) { delete sequence; }

}  // extern "C"
