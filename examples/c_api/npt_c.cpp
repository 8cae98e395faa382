/// The C ABI of npt_c.h over PoseTransfer.
#include "npt_c.h"

#include <npt/npt.hpp>
#include <npt/transfer/pose_sequence.hpp>
#if __has_include(<Eigen/SparseCholesky>)
#include <npt/skeleton/body_method.hpp>
#include <npt/transfer/detail_refiner.hpp>
#endif

#include <algorithm>
#include <array>
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
  npt::PreparedIdentity prepared;
};
struct npt_pose {
  npt::PreparedPose prepared;
};
struct npt_sequence {
  const npt_transfer& owner;
  const npt_identity& identity;
  npt::PoseSequence<npt::DefaultExecutor> frames;
  npt::PreparedPose pose;
};

namespace {

// The border: exceptions become a status and a message. A fixed buffer, so that short memory can be reported too.
thread_local std::array<char, 2048> last_error{};

npt_status failed(npt_status status, const char* message) noexcept {
  std::size_t length = std::min(std::strlen(message), last_error.size() - 1);
  // Not through the middle of a character: those that follow a first byte begin with the bits 10.
  if (message[length] != '\0')
    while (length > 0 && (static_cast<unsigned char>(message[length]) & 0xC0U) == 0x80U) --length;
  std::memcpy(last_error.data(), message, length);
  last_error[length] = '\0';
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

npt::MakeBodyMethod body() {
#if __has_include(<Eigen/SparseCholesky>)
  return npt::body_method;
#else
  return nullptr;
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
  options.pairings = o.pairings;
  options.mirror = o.mirror != 0;
  if (o.refine != 0) options.refinement = refinement();
  if (o.refine_radius != 0) options.refine_radius = o.refine_radius;
  options.invariant = o.invariant != 0;
  options.pairing = o.pair_as_given != 0 ? npt::Pairing::as_given : npt::Pairing::random;
  options.resample = o.resample != 0;
  if (o.unit != 0) options.unit = o.unit;
  options.seed = o.seed;
  options.body = body();
  options.method = method_from(o.method);
  // Vertices are paired by number to see what the network itself does.
  if (o.pair_as_given != 0 && o.method == NPT_AUTOMATIC) options.method = npt::Method::network;
  if (o.reader != nullptr) options.reader = std::u8string(reinterpret_cast<const char8_t*>(o.reader));
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

}  // namespace

const char* npt_version(void) { return NPT_VERSION; }
const char* npt_last_error(void) { return last_error.data(); }

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
    transfer->transfer(own, view_of(pose, "pose"), {result, own.xyz.size()});
  });
}

npt_status npt_prepare_identity(const npt_transfer* transfer, const npt_mesh* mesh, npt_identity** identity) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr, "npt_prepare_identity: a null pointer");
    *identity = new npt_identity{transfer->transfer.prepare_identity(view_of(mesh, "identity"))};
  });
}
void npt_release_identity(npt_identity* identity) { delete identity; }

npt_status npt_prepare_pose(const npt_transfer* transfer, const npt_mesh* mesh, size_t identity_vertices,
                            npt_pose** pose) {
  return guarded([&] {
    expect(transfer != nullptr && pose != nullptr, "npt_prepare_pose: a null pointer");
    expect(identity_vertices <= most_vertices, "npt_prepare_pose: more than 2^28 vertices");
    *pose = new npt_pose{transfer->transfer.prepare_pose(view_of(mesh, "pose"), identity_vertices)};
  });
}
void npt_release_pose(npt_pose* pose) { delete pose; }

npt_status npt_explain(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                       npt_report* report) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && pose != nullptr && report != nullptr,
           "npt_explain: a null pointer");
    const npt::TransferReport made = transfer->transfer.report(identity->prepared, pose->prepared);
    report->method = made.method == npt::Method::body ? NPT_BODY : NPT_NETWORK;
    report->identity_trust = made.read ? made.identity_trust : -1;
    report->pose_trust = made.read ? made.pose_trust : -1;
  });
}

npt_status npt_run_prepared(const npt_transfer* transfer, const npt_identity* identity, const npt_pose* pose,
                            float* result) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && pose != nullptr && result != nullptr,
           "npt_run_prepared: a null pointer");
    transfer->transfer(identity->prepared, pose->prepared, {result, 3 * identity->prepared.vertex_count()});
  });
}

npt_status npt_open_sequence(const npt_transfer* transfer, const npt_identity* identity, npt_sequence** sequence) {
  return guarded([&] {
    expect(transfer != nullptr && identity != nullptr && sequence != nullptr, "npt_open_sequence: a null pointer");
    *sequence = new npt_sequence{*transfer, *identity, npt::PoseSequence(transfer->transfer), {}};
  });
}

npt_status npt_run_frame(npt_sequence* sequence, const npt_mesh* pose, float* result) {
  return guarded([&] {
    expect(sequence != nullptr && result != nullptr, "npt_run_frame: a null pointer");
    const npt::PreparedIdentity& identity = sequence->identity.prepared;
    sequence->frames.prepare(view_of(pose, "pose"), identity.vertex_count(), sequence->pose);
    sequence->owner.transfer(identity, sequence->pose, {result, 3 * identity.vertex_count()});
  });
}
void npt_close_sequence(npt_sequence* sequence) { delete sequence; }
