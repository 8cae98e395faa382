/// The C ABI of npt_c.h over PoseTransfer.
#include "npt_c.h"

#include <npt/body/skeleton.hpp>
#include <npt/npt.hpp>
#if __has_include(<Eigen/SparseCholesky>)
#include <npt/transfer/detail_refiner.hpp>
#endif

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

struct npt_transfer {
  npt::PoseTransfer transfer;
  std::string description;
};
struct npt_identity {
  npt::Character prepared;
  std::string name;
};
struct npt_pose {
  npt::Pose prepared;
  std::string name;
};
struct npt_sequence {
  const npt_transfer& owner;
  const npt_identity& identity;
  npt::PoseTracker<npt::DefaultExecutor> frames;
  npt_pose pose;
};

namespace {

// The border: exceptions become a status and a message. A fixed buffer, so that short memory can be reported too.
using Text = std::array<char, 2048>;
thread_local Text last_error{}, last_notes{};

void set(Text& text, const char* message) noexcept {
  std::size_t length = std::min(std::strlen(message), text.size() - 1);
  // Not through the middle of a character: those that follow a first byte begin with the bits 10.
  if (message[length] != '\0')
    while (length > 0 && (static_cast<unsigned char>(message[length]) & 0xC0U) == 0x80U) --length;
  std::memcpy(text.data(), message, length);
  text[length] = '\0';
}

npt_status failed(npt_status status, const char* message) noexcept {
  set(last_error, message);
  return status;
}

/// A mistake of the caller, as opposed to bad data.
struct BadArgument {
  const char* message;
};

void expect(bool good, const char* message) {
  if (!good) throw BadArgument{message};
}

template <class F>
npt_status guarded(const F& f) noexcept {
  try {
    f();
    return NPT_OK;
  } catch (const BadArgument& mistake) {
    return failed(NPT_BAD_ARGUMENT, mistake.message);
  } catch (const npt::Error& error) {
    return failed(NPT_BAD_INPUT, error.what());
  } catch (const std::bad_alloc&) {
    return failed(NPT_NO_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return failed(NPT_INTERNAL, error.what());
  } catch (...) {
    return failed(NPT_INTERNAL, "unknown exception");
  }
}

npt::MakeRefinement refinement() {
#if __has_include(<Eigen/SparseCholesky>)
  return npt::detail_refinement;
#else
  throw npt::Error({.file = "refine", .found = "a library built without Eigen", .expected = "one with it"});
#endif
}

npt::Method method_from(npt_method method) {
  expect(method == NPT_AUTOMATIC || method == NPT_BODY || method == NPT_NETWORK, "npt_options: an unknown method");
  return method == NPT_BODY ? npt::Method::body : method == NPT_NETWORK ? npt::Method::network : npt::Method::automatic;
}

npt::TransferOptions options_from(const npt_options& o) {
  expect(o.size == sizeof(npt_options), "npt_options: fill it with npt_default_options, of this version's header");
  expect(o.threads >= 0, "npt_options: fewer than 0 threads");
  npt::TransferOptions options;
  options.network.pairings = o.pairings;
  options.network.mirror = o.mirror != 0;
  if (o.refine != 0) options.refinement = refinement();
  if (o.refine_radius != 0) options.refine_radius = o.refine_radius;
  options.network.invariant = o.invariant != 0;
  options.network.pairing = o.pair_as_given != 0 ? npt::Pairing::as_given : npt::Pairing::random;
  options.network.resample = o.resample != 0;
  if (o.unit != 0) options.import.unit = o.unit;
  options.seed = o.seed;
  options.method = method_from(o.method);
  // Vertices are paired by number to see what the network itself does.
  if (o.pair_as_given != 0 && o.method == NPT_AUTOMATIC) options.method = npt::Method::network;
  return options;
}

/// Calls open(options, executor), which makes the transfer.
template <class F>
npt_status open(const npt_options* given, npt_transfer** transfer, const F& open) {
  return guarded([&] {
    expect(transfer != nullptr, "npt_open: a null pointer for the transfer");
    npt_options options;
    npt_default_options(&options);
    if (given != nullptr) options = *given;
    auto own = options_from(options);
    auto made = open(own, npt::DefaultExecutor(options.threads));
    std::string description = made.description();
    *transfer = new npt_transfer{std::move(made), std::move(description)};
  });
}

constexpr std::size_t most_vertices = std::size_t{1} << 28;

npt::MeshView view_of(const npt_mesh* mesh, const char* name) {
  expect(mesh != nullptr && mesh->xyz != nullptr, "npt_mesh: a null pointer for a mesh or its coordinates");
  expect(mesh->triangles != nullptr || mesh->triangle_count == 0, "npt_mesh: a null pointer for triangles");
  expect(mesh->vertices <= most_vertices && mesh->triangle_count <= most_vertices,
         "npt_mesh: more than 2^28 vertices or triangles");
  static_assert(sizeof(npt::Triangle) == 3 * sizeof(std::uint32_t));
  return {.xyz = {mesh->xyz, 3 * mesh->vertices},
          .triangles = {reinterpret_cast<const npt::Triangle*>(mesh->triangles), mesh->triangle_count},
          .name = mesh->name != nullptr ? mesh->name : name};
}

std::string name_of(const npt_mesh* mesh, const char* name) { return mesh->name != nullptr ? mesh->name : name; }

void explain(const npt_transfer& transfer, const npt_identity& identity, const npt_pose& pose, npt_report& report) {
  const npt::TransferReport made = transfer.transfer.report(identity.prepared, pose.prepared);
  std::string notes;
  for (const npt::Warning& warning : made.warnings) {
    const std::string remedy = npt::text_of(warning.remedy);
    notes += (notes.empty() ? "" : "\n") + npt::text_of(warning, identity.name, pose.name) +
             (remedy.empty() ? "" : "; " + remedy);
  }
  set(last_notes, notes.c_str());
  report.method = made.method == npt::Method::body ? NPT_BODY : NPT_NETWORK;
  report.identity_confidence = identity.prepared.confidence().value_or(-1);
  report.pose_confidence = pose.prepared.confidence().value_or(-1);
}

void run(const npt_transfer& transfer, const npt_identity& identity, const npt_pose& pose, float* result) {
  transfer.transfer.apply(identity.prepared, pose.prepared, {result, 3 * identity.prepared.vertex_count()});
}

void expect_frame(const npt_sequence& sequence) {
  expect(sequence.pose.prepared.prepared(), "npt_sequence: no frame was run yet");
}

/// A skeleton as npt_c.h shows it, and what it shows.
struct OwnedSkeleton : npt_skeleton {
  npt::SkinnedSkeleton skeleton;
  std::vector<const char*> name_pointers;
  std::vector<std::int32_t> parent_numbers;
};
static_assert(NPT_JOINTS == npt::fingered_joint_count);
static_assert(sizeof(npt_influence) == sizeof(npt::SkinnedSkeleton::Influence));
static_assert(offsetof(npt_influence, weight) == offsetof(npt::SkinnedSkeleton::Influence, weight));
static_assert(sizeof(npt::Vec3d) == 3 * sizeof(double));

void move_joints(const npt_transfer& transfer, const npt_identity& identity, const npt_pose& pose, double* motions) {
  const auto made = transfer.transfer.motions(identity.prepared, pose.prepared);
  if (!made)
    throw npt::Error({.file = "motions",
                      .found = "a transfer by the network from " + pose.name + " to " + identity.name,
                      .expected = "meshes that are both recognised as people"});
  for (const npt::Affine& motion : *made)
    for (std::size_t r = 0; r < 3; ++r) {
      const npt::Vec3d& row = motion.linear.rows[r];
      for (const double value : {row.x, row.y, row.z,
                                 r == 0   ? motion.shift.x
                                 : r == 1 ? motion.shift.y
                                          : motion.shift.z})
        *motions++ = value;
    }
}

}  // namespace

const char* npt_version(void) { return NPT_VERSION; }
const char* npt_last_error(void) { return last_error.data(); }
const char* npt_last_notes(void) { return last_notes.data(); }

void npt_default_options(npt_options* options) {
  if (options == nullptr) return;
  *options = {};
  options->size = sizeof(npt_options);
  options->pairings = 1;
  options->resample = 1;
}

npt_status npt_open(const char* weights, const npt_options* options, npt_transfer** transfer) {
  return open(options, transfer, [&](const npt::TransferOptions& own, npt::DefaultExecutor executor) {
    expect(weights != nullptr, "npt_open: a null pointer for the weights");
    const std::u8string path(reinterpret_cast<const char8_t*>(weights));
    return npt::PoseTransfer::open(npt::SafetensorsFile::read(std::filesystem::path(path)), own, std::move(executor));
  });
}

npt_status npt_open_random(int bottleneck, int pooled, uint64_t weights_seed, const npt_options* options,
                           npt_transfer** transfer) {
  return open(options, transfer, [&](const npt::TransferOptions& own, npt::DefaultExecutor executor) {
    const npt::Metadata variant{{"bottleneck", std::to_string(bottleneck)},
                                {"order", npt::ConvRelu::name},
                                {"feature", pooled != 0 ? npt::Pooled::name : npt::PerVertex::name}};
    const auto* type = npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(variant);
    if (type == nullptr)
      throw npt::Error({.file = "network",
                        .found = "bottleneck " + std::to_string(bottleneck),
                        .expected = "bottleneck 64, 128, 256, 512 or 1024"});
    return npt::PoseTransfer::random(*type, weights_seed, own, std::move(executor));
  });
}

void npt_close(npt_transfer* transfer) { delete transfer; }

const char* npt_describe(const npt_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->description.c_str();
}

npt_status npt_run(const npt_transfer* transfer, const npt_mesh* identity, const npt_mesh* pose, float* result) {
  return guarded([&] {
    expect(transfer != nullptr && result != nullptr, "npt_run: a null pointer");
    const npt::MeshView own = view_of(identity, "identity");
    npt::TransferReport report;
    const npt::TransferJob job{own, view_of(pose, "pose"), {result, own.xyz.size()}, &report};
    transfer->transfer.run({&job, 1});
  });
}

npt_status npt_prepare_identity(const npt_transfer* transfer, const npt_mesh* mesh, npt_identity** identity) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr, "npt_prepare_identity: a null pointer");
    *identity = new npt_identity{transfer->transfer.character(view_of(mesh, "identity")), name_of(mesh, "identity")};
  });
}
void npt_release_identity(npt_identity* identity) { delete identity; }

npt_status npt_prepare_pose(const npt_transfer* transfer, const npt_mesh* mesh, size_t identity_vertices,
                            npt_pose** pose) {
  return guarded([&] {
    expect(transfer != nullptr && pose != nullptr, "npt_prepare_pose: a null pointer");
    expect(identity_vertices <= most_vertices, "npt_prepare_pose: more than 2^28 vertices");
    *pose = new npt_pose{transfer->transfer.pose(view_of(mesh, "pose"), identity_vertices), name_of(mesh, "pose")};
  });
}
void npt_release_pose(npt_pose* pose) { delete pose; }

npt_status npt_prepare(const npt_transfer* transfer, const npt_mesh* identity_mesh, const npt_mesh* pose_mesh,
                       npt_identity** identity, npt_pose** pose) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && pose != nullptr, "npt_prepare: a null pointer");
    const npt::MeshView own = view_of(identity_mesh, "identity"), posed = view_of(pose_mesh, "pose");
    auto made = std::make_unique<npt_identity>();
    auto taken = std::make_unique<npt_pose>();
    made->name = name_of(identity_mesh, "identity"), taken->name = name_of(pose_mesh, "pose");
    transfer->transfer.prepare(own, posed, made->prepared, taken->prepared);
    *identity = made.release(), *pose = taken.release();
  });
}

npt_status npt_explain(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                       npt_report* report) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && pose != nullptr && report != nullptr,
           "npt_explain: a null pointer");
    explain(*transfer, *identity, *pose, *report);
  });
}

npt_status npt_run_prepared(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                            float* result) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && pose != nullptr && result != nullptr,
           "npt_run_prepared: a null pointer");
    run(*transfer, *identity, *pose, result);
  });
}

npt_status npt_open_sequence(const npt_transfer* transfer, const npt_identity* identity, npt_sequence** sequence) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && sequence != nullptr, "npt_open_sequence: a null pointer");
    *sequence = new npt_sequence{*transfer, *identity, npt::PoseTracker(transfer->transfer), {{}, "pose"}};
  });
}

npt_status npt_run_frame(npt_sequence* sequence, const npt_mesh* pose, float* result) {
  return guarded([&] {
    expect(sequence != nullptr && result != nullptr, "npt_run_frame: a null pointer");
    const std::size_t vertices = sequence->identity.prepared.vertex_count();
    sequence->pose.prepared = sequence->frames.next(view_of(pose, "pose"), vertices);
    sequence->pose.name = name_of(pose, "pose");
    run(sequence->owner, sequence->identity, sequence->pose, result);
  });
}

npt_status npt_explain_frame(const npt_sequence* sequence, npt_report* report) {
  return guarded([&] {
    expect(sequence != nullptr && report != nullptr, "npt_explain_frame: a null pointer");
    expect_frame(*sequence);
    explain(sequence->owner, sequence->identity, sequence->pose, *report);
  });
}
void npt_close_sequence(npt_sequence* sequence) { delete sequence; }

npt_status npt_open_skeleton(const npt_transfer* transfer, const npt_identity* identity,
                             const npt_skeleton** skeleton) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && skeleton != nullptr, "npt_open_skeleton: a null pointer");
    auto made = identity->prepared.skeleton();
    if (!made)
      throw npt::Error({.file = "skeleton",
                        .found = transfer->transfer.options().refinement != nullptr
                                     ? "an identity whose results are refined"
                                     : "that " + identity->name + " is not recognised as a person",
                        .expected = "a recognised identity, without refinement"});
    auto owned = std::make_unique<OwnedSkeleton>();
    owned->skeleton = *std::move(made);
    const npt::SkinnedSkeleton& own = owned->skeleton;
    for (std::size_t j = 0; j < own.joint_count(); ++j) {
      owned->name_pointers.push_back(own.names[j].c_str());
      owned->parent_numbers.push_back(
          own.parents[j] == npt::SkinnedSkeleton::no_parent ? -1 : static_cast<std::int32_t>(own.parents[j]));
    }
    static_cast<npt_skeleton&>(*owned) = {own.joint_count(),
                                          owned->name_pointers.data(),
                                          owned->parent_numbers.data(),
                                          reinterpret_cast<const double*>(own.joints.data()),
                                          own.start.size() - 1,
                                          own.start.data(),
                                          reinterpret_cast<const npt_influence*>(own.influences.data())};
    *skeleton = owned.release();
  });
}
void npt_close_skeleton(const npt_skeleton* skeleton) { delete static_cast<const OwnedSkeleton*>(skeleton); }

npt_status npt_move_joints(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                           double* motions) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && pose != nullptr && motions != nullptr,
           "npt_move_joints: a null pointer");
    move_joints(*transfer, *identity, *pose, motions);
  });
}

npt_status npt_move_frame_joints(const npt_sequence* sequence, double* motions) {
  return guarded([&] {
    expect(sequence != nullptr && motions != nullptr, "npt_move_frame_joints: a null pointer");
    expect_frame(*sequence);
    move_joints(sequence->owner, sequence->identity, sequence->pose, motions);
  });
}
