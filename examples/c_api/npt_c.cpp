/// The C ABI of npt_c.h over PoseTransfer.
#include "npt_c_types.hpp"

#include <npt/npt.hpp>

#include <filesystem>
#include <memory>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

using c_api::control_from, c_api::expect, c_api::expect_result, c_api::guarded, c_api::kept, c_api::most_vertices,
    c_api::name_of, c_api::path_of, c_api::view_of;

namespace {

/// Calls open(options, executor), which makes the transfer.
template <class F>
npt_status open(const npt_options* given, npt_transfer** transfer, const F& open) {
  return guarded([&] {
    expect(transfer != nullptr, "npt_open: a null pointer for the transfer");
    npt_options options{};
    options.size = sizeof options;
    npt_default_options(&options);
    if (given != nullptr) options = *given;
    auto own = c_api::options_from(options);
    auto made = open(own, npt::DefaultExecutor(options.threads));
    std::string description = made.description();
    *transfer = new npt_transfer{std::move(made), std::move(description)};
  });
}

/// By way of other memory where a result that is there may still be refused, so that the caller's stays as it was.
npt::TransferReport apply(const npt::PoseTransfer& transfer, const npt::Character& character, const npt::Pose& pose,
                          float* xyz) {
  const std::span<float> out{xyz, 3 * character.vertex_count()};
  if (!transfer.has_body()) return transfer.apply(character, pose, out);
  std::vector<float> made(out.size());
  const npt::TransferReport report = transfer.apply(character, pose, made);
  std::ranges::copy(made, out.begin());
  return report;
}

/// A copy: a tracker's start may come back to a mesh.
npt::Mesh mesh_of(const npt::MeshView& view) {
  npt::Mesh mesh;
  mesh.positions.resize(view.vertex_count());
  std::ranges::copy(view.xyz, mesh.coordinates().begin());
  npt::set_faces(mesh, view.triangles);
  return mesh;
}

void write_motions(const std::vector<npt::Affine>& motions, double* out) {
  for (const npt::Affine& motion : motions) {
    const std::array<double, 3> shift{motion.shift.x, motion.shift.y, motion.shift.z};
    for (std::size_t r = 0; r < 3; ++r) {
      const npt::Vec3d& row = motion.linear.rows[r];
      for (const double value : {row.x, row.y, row.z, shift[r]}) *out++ = value;
    }
  }
}

}  // namespace

const char* npt_version(void) { return NPT_VERSION; }
const char* npt_last_error(void) { return c_api::last_error.message.data(); }
npt_error_code npt_last_error_code(void) { return c_api::last_error.code; }
npt_remedy npt_last_remedy(void) { return c_api::last_error.remedy; }

const char* npt_warning_text(const npt_warning* warning, const char* identity, const char* pose) {
  if (warning == nullptr) return "";
  const char* text = "";
  guarded([&] {
    const int code = c_api::number_of(warning->code);
    expect(code >= 0 && code <= NPT_WARNING_PART_OF_MESH, "npt_warning_text: an unknown code");
    const npt::Warning own{static_cast<npt::WarningCode>(code),
                           c_api::number_of(warning->mesh) == NPT_POSE ? npt::MeshRole::pose : npt::MeshRole::identity,
                           warning->value, npt::Remedy::none, static_cast<const npt::KindWords*>(warning->words)};
    text = kept(npt::text_of(own, identity != nullptr ? identity : "identity", pose != nullptr ? pose : "pose"));
  });
  return text;
}

const char* npt_remedy_text(npt_remedy remedy) {
  const char* text = "";
  guarded([&] { text = kept(npt::text_of(static_cast<npt::Remedy>(c_api::number_of(remedy)))); });
  return text;
}

npt_status npt_default_options(npt_options* options) {
  return guarded([&] {
    expect(options != nullptr && options->size == sizeof(npt_options),
           "npt_default_options: a null pointer, or a size that isn't sizeof(npt_options)");
    const npt::TransferOptions own;
    *options = {};
    options->size = sizeof(npt_options);
    options->version = NPT_OPTIONS_VERSION;
    options->body = {NPT_BALANCED, own.body.least_confidence, own.body.high_confidence, own.body.figure};
    options->network.pairings = own.network.pairings;
    options->network.resample = own.network.resample ? 1 : 0;
  });
}

npt_status npt_open(const char* weights, const npt_options* options, npt_transfer** transfer) {
  return npt_open_files(&weights, 1, options, transfer);
}

npt_status npt_open_files(const char* const* weights, size_t count, const npt_options* options,
                          npt_transfer** transfer) {
  return open(options, transfer, [&](const npt::TransferOptions& own, npt::DefaultExecutor executor) {
    expect(weights != nullptr && count > 0, "npt_open: no weights");
    std::vector<std::filesystem::path> files;
    for (std::size_t i = 0; i < count; ++i) {
      expect(weights[i] != nullptr, "npt_open: a null pointer for the weights");
      files.push_back(path_of(weights[i]));
    }
    return npt::PoseTransfer::open(std::span<const std::filesystem::path>(files), own, std::move(executor));
  });
}

npt_status npt_open_shipped(const char* folder, const npt_options* options, npt_transfer** transfer) {
  return open(options, transfer, [&](const npt::TransferOptions& own, npt::DefaultExecutor executor) {
    expect(folder != nullptr, "npt_open_shipped: a null pointer for the folder");
    std::vector<std::filesystem::path> files{path_of(folder) / "human.safetensors"};
    std::filesystem::path animals = path_of(folder) / "quadruped.safetensors";
    std::error_code code;
    if (own.method != npt::Method::network && std::filesystem::is_regular_file(animals, code))
      files.push_back(std::move(animals));
    return npt::PoseTransfer::open(std::span<const std::filesystem::path>(files), own, std::move(executor));
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

npt_status npt_run(const npt_transfer* transfer, const npt_mesh* identity, const npt_mesh* pose, float* xyz,
                   npt_result* result) {
  return guarded([&] {
    expect(transfer != nullptr && xyz != nullptr, "npt_run: a null pointer");
    expect_result(result);
    const npt::MeshView own = view_of(identity, "identity"), posed = view_of(pose, "pose");
    const npt::PoseTransfer& run = transfer->transfer;
    if (!run.has_body() && result == nullptr) return run(own, posed, std::span<float>(xyz, own.xyz.size()));
    npt::Character character;
    npt::Pose taken;
    run.prepare(own, posed, character, taken);
    const npt::TransferReport report = apply(run, character, taken, xyz);
    c_api::fill(result, report, character.confidence(), taken.confidence());
  });
}

npt_status npt_prepare_character(const npt_transfer* transfer, const npt_mesh* mesh, const npt_control* control,
                                 npt_character** character) {
  return guarded([&] {
    expect(transfer != nullptr && character != nullptr, "npt_prepare_character: a null pointer");
    const npt::MeshView view = view_of(mesh, "identity");
    *character =
        new npt_character{transfer->transfer.character(view, control_from(control)), name_of(mesh, "identity")};
  });
}
void npt_release_character(npt_character* character) { delete character; }

npt_status npt_prepare_pose(const npt_transfer* transfer, const npt_mesh* mesh, size_t identity_vertices,
                            const npt_control* control, npt_pose** pose) {
  return guarded([&] {
    expect(transfer != nullptr && pose != nullptr, "npt_prepare_pose: a null pointer");
    expect(identity_vertices <= most_vertices, "npt_prepare_pose: more than 2^28 vertices");
    auto made = std::make_unique<npt_pose>();
    transfer->transfer.prepare(view_of(mesh, "pose"), identity_vertices, made->own, control_from(control));
    *pose = made.release();
  });
}
void npt_release_pose(npt_pose* pose) { delete pose; }

npt_status npt_prepare(const npt_transfer* transfer, const npt_mesh* identity_mesh, const npt_mesh* pose_mesh,
                       npt_character** character, npt_pose** pose) {
  return guarded([&] {
    expect(transfer != nullptr && character != nullptr && pose != nullptr, "npt_prepare: a null pointer");
    const npt::MeshView own = view_of(identity_mesh, "identity"), posed = view_of(pose_mesh, "pose");
    auto made = std::make_unique<npt_character>();
    auto taken = std::make_unique<npt_pose>();
    made->name = name_of(identity_mesh, "identity");
    transfer->transfer.prepare(own, posed, made->character, taken->own);
    *character = made.release(), *pose = taken.release();
  });
}

npt_status npt_character_save(const npt_character* character, const char* file) {
  return guarded([&] {
    expect(character != nullptr && file != nullptr, "npt_character_save: a null pointer");
    character->character.save(path_of(file));
  });
}

npt_status npt_load_character(const npt_transfer* transfer, const char* file, npt_character** character) {
  return guarded([&] {
    expect(transfer != nullptr && file != nullptr && character != nullptr, "npt_load_character: a null pointer");
    *character = new npt_character{transfer->transfer.load_character(path_of(file)), file};
  });
}

npt_status npt_character_mesh(const npt_character* character, npt_mesh* mesh) {
  return guarded([&] {
    expect(character != nullptr && mesh != nullptr, "npt_character_mesh: a null pointer");
    expect(mesh->size == sizeof(npt_mesh), "npt_mesh: a size that isn't sizeof(npt_mesh)");
    const npt::Character& own = character->character;
    *mesh = {sizeof(npt_mesh),       own.positions().data(),
             own.vertex_count(),     own.triangles().empty() ? nullptr : own.triangles().front().data(),
             own.triangles().size(), character->name.c_str()};
  });
}

npt_status npt_character_estimate(const npt_character* character, npt_estimate* estimate) {
  return guarded([&] {
    expect(character != nullptr && estimate != nullptr, "npt_character_estimate: a null pointer");
    expect(estimate->size == sizeof(npt_estimate), "npt_estimate: a size that isn't sizeof(npt_estimate)");
    c_api::fill(*estimate, character->character, character->character.unit());
  });
}

npt_status npt_pose_estimate(const npt_pose* pose, npt_estimate* estimate) {
  return guarded([&] {
    expect(pose != nullptr && estimate != nullptr, "npt_pose_estimate: a null pointer");
    expect(estimate->size == sizeof(npt_estimate), "npt_estimate: a size that isn't sizeof(npt_estimate)");
    c_api::fill(*estimate, *pose->pose, 1);
  });
}

npt_status npt_character_joints(const npt_character* character, npt_joint_pose* joints) {
  return guarded([&] {
    expect(character != nullptr && joints != nullptr, "npt_character_joints: a null pointer");
    expect(joints->size == sizeof(npt_joint_pose), "npt_joint_pose: a size that isn't sizeof(npt_joint_pose)");
    c_api::fill(*joints, character->character.joints(), "a character");
  });
}

npt_status npt_pose_joints(const npt_pose* pose, npt_joint_pose* joints) {
  return guarded([&] {
    expect(pose != nullptr && joints != nullptr, "npt_pose_joints: a null pointer");
    expect(joints->size == sizeof(npt_joint_pose), "npt_joint_pose: a size that isn't sizeof(npt_joint_pose)");
    c_api::fill(*joints, pose->pose->joints(), "a pose");
  });
}

npt_status npt_apply(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose, float* xyz,
                     npt_result* result) {
  return guarded([&] {
    expect(transfer != nullptr && character != nullptr && pose != nullptr && xyz != nullptr,
           "npt_apply: a null pointer");
    expect_result(result);
    const npt::TransferReport report = apply(transfer->transfer, character->character, *pose->pose, xyz);
    c_api::fill(result, report, character->character.confidence(), pose->pose->confidence());
  });
}

npt_status npt_report(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose,
                      npt_result* result) {
  return guarded([&] {
    expect(transfer != nullptr && character != nullptr && pose != nullptr && result != nullptr,
           "npt_report: a null pointer");
    expect_result(result);
    c_api::fill(result, transfer->transfer.report(character->character, *pose->pose), character->character.confidence(),
                pose->pose->confidence());
  });
}

npt_status npt_measure(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose,
                       const float* xyz, npt_measures* measures) {
  return guarded([&] {
    expect(transfer != nullptr && character != nullptr && pose != nullptr && xyz != nullptr && measures != nullptr,
           "npt_measure: a null pointer");
    expect(measures->size == sizeof(npt_measures), "npt_measures: a size that isn't sizeof(npt_measures)");
    const npt::Character& own = character->character;
    const npt::ResultMeasures made = transfer->transfer.measure(own, *pose->pose, {xyz, 3 * own.vertex_count()});
    *measures = {sizeof(npt_measures),
                 made.stretch.common,
                 made.stretch.largest,
                 made.stretch.vertex,
                 made.penetration,
                 c_api::number_of(made.identity_coverage),
                 c_api::number_of(made.pose_coverage)};
  });
}

npt_status npt_open_tracker(const npt_transfer* transfer, npt_tracker** tracker) {
  return guarded([&] {
    expect(transfer != nullptr && tracker != nullptr, "npt_open_tracker: a null pointer");
    *tracker = new npt_tracker{npt::PoseTracker(transfer->transfer), {}};
  });
}
void npt_close_tracker(npt_tracker* tracker) { delete tracker; }
void npt_restart_tracker(npt_tracker* tracker) {
  if (tracker != nullptr) tracker->tracker.restart();
}

npt_status npt_next_pose(npt_tracker* tracker, const npt_mesh* frame, size_t identity_vertices, const npt_pose** pose) {
  return guarded([&] {
    expect(tracker != nullptr && pose != nullptr, "npt_next_pose: a null pointer");
    expect(identity_vertices <= most_vertices, "npt_next_pose: more than 2^28 vertices");
    tracker->last.pose = &tracker->tracker.next(view_of(frame, "pose"), identity_vertices);
    *pose = &tracker->last;
  });
}

npt_status npt_start_tracker(npt_tracker* tracker, const npt_mesh* first, const npt_mesh* others, size_t count,
                             size_t identity_vertices, const npt_pose** pose) {
  return guarded([&] {
    expect(tracker != nullptr && pose != nullptr, "npt_start_tracker: a null pointer");
    expect(others != nullptr || count == 0, "npt_start_tracker: a null pointer for other frames");
    expect(identity_vertices <= most_vertices, "npt_start_tracker: more than 2^28 vertices");
    const npt::MeshView view = view_of(first, "pose");
    for (std::size_t k = 0; k < count; ++k) view_of(others + k, "pose");
    tracker->last.pose =
        &tracker->tracker.start(mesh_of(view), view.name, identity_vertices, count,
                                [others](std::size_t k) { return mesh_of(view_of(others + k, "pose")); });
    *pose = &tracker->last;
  });
}

size_t npt_frames_to_try(size_t frames, size_t* numbers) {
  const std::size_t count = npt::frames_to_try(frames);
  for (std::size_t i = 0; numbers != nullptr && i < count; ++i) numbers[i] = npt::frame_to_try(i + 1, frames);
  return count;
}

npt_status npt_open_skeleton(const npt_character* character, const npt_skeleton** skeleton) {
  return guarded([&] {
    expect(character != nullptr && skeleton != nullptr, "npt_open_skeleton: a null pointer");
    auto made = character->character.skeleton();
    if (!made && character->character.recognised())
      throw npt::Error({.file = "skeleton",
                        .found = "a character whose results are refined",
                        .expected = "one without refinement, which no skeleton can do"});
    if (!made) throw c_api::not_recognised("skeleton", "a character");
    auto owned = std::make_unique<c_api::OwnedSkeleton>();
    owned->skeleton = *std::move(made);
    const npt::SkinnedSkeleton& own = owned->skeleton;
    for (std::size_t j = 0; j < own.joint_count(); ++j) {
      owned->name_pointers.push_back(own.names[j].c_str());
      owned->parent_numbers.push_back(
          own.parents[j] == npt::SkinnedSkeleton::no_parent ? -1 : static_cast<std::int32_t>(own.parents[j]));
    }
    static_cast<npt_skeleton&>(*owned) = {sizeof(npt_skeleton),
                                          own.joint_count(),
                                          owned->name_pointers.data(),
                                          owned->parent_numbers.data(),
                                          reinterpret_cast<const double*>(own.joints.data()),
                                          own.start.size() - 1,
                                          own.start.data(),
                                          reinterpret_cast<const npt_influence*>(own.influences.data())};
    *skeleton = owned.release();
  });
}
void npt_close_skeleton(const npt_skeleton* skeleton) { delete static_cast<const c_api::OwnedSkeleton*>(skeleton); }

npt_status npt_move_joints(const npt_transfer* transfer, const npt_character* character, const npt_pose* pose,
                           double* motions) {
  return guarded([&] {
    expect(transfer != nullptr && character != nullptr && pose != nullptr && motions != nullptr,
           "npt_move_joints: a null pointer");
    const auto own = transfer->transfer.motions(character->character, *pose->pose);
    if (!own) throw c_api::not_recognised("motions", "a character or a pose");
    c_api::expect_joints(own->size());
    write_motions(*own, motions);
  });
}
