/// A clip onto a character, from files to a file: npt_animate_file of npt_c.h.
#include "npt_c_motion_types.hpp"
#include "npt_c_types.hpp"

#include <npt/body/joint_names.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/scene/clip_frames.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/transfer/animation.hpp>
#include <npt/transfer/motion/character_motion.hpp>
#include <npt/transfer/motion_transfer.hpp>

#include <initializer_list>
#include <system_error>

namespace {

namespace fs = std::filesystem;
using c_api::expect;

bool is_scene(const fs::path& path) {
  const npt::MeshFormat format = npt::mesh_format(path);
  return format == npt::MeshFormat::glb || format == npt::MeshFormat::gltf;
}

bool is_bvh(const fs::path& path) { return c_api::has_extension(path, {".bvh"}); }

struct Files {
  fs::path identity, pose, out;
};

/// Before long work.
void expect_usable(const Files& files) {
  const auto& [identity, pose, out] = files;
  npt::mesh_format(identity);
  if (!is_bvh(pose) && !is_scene(pose))
    throw npt::Error(
        {.file = pose.string(), .found = "no moving scene", .expected = "a .glb or .gltf with a clip, or a .bvh"});
  if (npt::mesh_format(out) != npt::MeshFormat::glb)
    throw npt::Error({.file = out.string(), .found = "no .glb", .expected = "a .glb, which can move"});
  std::error_code ignored;
  for (const fs::path& input : {identity, pose})
    if (fs::equivalent(out, input, ignored))
      throw npt::Error({.file = out.string(), .found = "one of the inputs", .expected = "another file"});
  const fs::path folder = out.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    throw npt::Error({.file = folder.string(), .found = "no such folder", .expected = "one to write to"});
}

npt_clip_options options_of(const npt_clip_options* given) {
  npt_clip_options options{};
  options.size = sizeof options;
  if (given != nullptr) options = *given;
  expect(options.size == sizeof(npt_clip_options), "npt_clip_options: a size that isn't sizeof(npt_clip_options)");
  if (options.fps == 0) options.fps = 30;
  expect(options.fps >= 0.001 && options.fps <= 1000, "npt_clip_options: fps that isn't between 0.001 and 1000");
  const int names = c_api::number_of(options.names);
  expect(names >= NPT_VRM && names <= NPT_SMPL, "npt_clip_options: unknown names of joints");
  return options;
}
static_assert(static_cast<int>(npt::JointNames::vrm) == NPT_VRM &&
              static_cast<int>(npt::JointNames::mixamo) == NPT_MIXAMO &&
              static_cast<int>(npt::JointNames::smpl) == NPT_SMPL);

void expect_finite(const npt::Mesh& identity, const npt::Animation& animation, const std::string& name) {
  npt::Mesh mesh = identity;
  for (const std::vector<float>& xyz : animation.positions) {
    std::ranges::copy(xyz, mesh.coordinates().begin());
    npt::validate(mesh, "result for " + name);
  }
}

void warn_of_unit(const npt::PoseTransfer& transfer, double unit, npt::Warnings& warnings) {
  if (unit != 1 && !transfer.options().import.unit && !warnings.contains(npt::WarningCode::unit_assumed))
    warnings.push_back({npt::WarningCode::unit_assumed, npt::MeshRole::identity, unit, npt::Remedy::give_unit});
}

/// A clip without a mesh, on the joints that body estimation gives the identity.
void animate_by_joints(const npt::PoseTransfer& transfer, const Files& files, const npt_clip_options& options,
                       const npt::Control& control, npt_result* result) {
  const std::string pose = files.pose.string(), name = files.identity.string();
  const npt_file file{sizeof(npt_file), pose.c_str(), nullptr, 0};
  c_api::Notes notes;
  c_api::WantedClips wanted;
  if (options.clip != nullptr) wanted.name = options.clip;
  const c_api::OwnedMotion clip = std::move(c_api::read_clips(&file, wanted, nullptr, notes).front());
  if (clip->refusal) throw npt::Error(*clip->refusal);
  const npt::Mesh mesh = npt::read_mesh(files.identity);
  const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
  const npt::MeshView view{mesh.coordinates(), triangles, name};
  const npt::Character character = transfer.character(view, control.part(0, 0.9));
  const double unit = npt::output_unit(transfer, character, is_scene(files.identity));
  const auto names = static_cast<npt::JointNames>(options.names);
  npt::MotionOptions own;
  own.rate = options.fps;
  own.retarget.in_place = options.in_place != 0;
  const npt::MotionResult made =
      npt::transfer_motion(clip->skeleton, npt::motion_skeleton(character, name, names, unit), own);
  npt::write_scene(files.out, npt::scene_with_motions(mesh, files.identity.stem().string(), *character.skeleton(),
                                                      {&made.motion, 1}, unit));
  control.step(1);
  npt::TransferReport report;
  report.method = npt::Method::body;
  report.confidence = std::min(*character.confidence(), made.confidence);
  report.warnings = character.warnings();
  warn_of_unit(transfer, unit, report.warnings);
  c_api::fill(result, report, character.confidence(), made.confidence);
}

void animate(const npt::PoseTransfer& transfer, const Files& files, const npt_clip_options& options,
             const npt::Control& control, npt_result* result) {
  expect_usable(files);
  const fs::path &identity = files.identity, &pose = files.pose;
  if (is_bvh(pose)) return animate_by_joints(transfer, files, options, control, result);
  npt::Scene scene = npt::read_scene(pose);
  if (scene.shown.empty() && npt::has_skeleton(scene))
    return animate_by_joints(transfer, files, options, control, result);
  const npt::Mesh mesh = npt::read_mesh(identity);
  npt::ClipFrames::Options clip{.clip = {}, .rate = options.fps, .time = {}};
  if (options.clip != nullptr) clip.clip = options.clip;
  npt::ClipFrames frames(std::move(scene), pose.string(), clip);
  npt::FrameSource source = npt::frame_source(frames);
  source.name = [&pose](std::size_t) { return pose.string(); };

  const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
  const std::string name = identity.string();
  const npt::MeshView view{mesh.coordinates(), triangles, name};
  const double share = 1 / (1 + static_cast<double>(frames.size()));  // estimating it takes about as long as a frame
  const npt::Character character = transfer.character(view, control.part(0, share));
  npt::Animation made = npt::animate(transfer, character, source, options.in_place == 0,
                                     static_cast<npt::JointNames>(options.names), control.part(share, 1));
  expect_finite(mesh, made, name);
  const double unit = npt::output_unit(transfer, character, is_scene(identity));
  npt::write_scene(
      files.out, npt::animation_scene(mesh, identity.stem().string(), made, frames.clip_name(), frames.times(), unit));

  warn_of_unit(transfer, unit, made.report.warnings);
  c_api::fill(result, made.report, character.confidence(), made.pose_confidence);
}

}  // namespace

npt_status npt_animate_file(const npt_transfer* transfer, const char* identity, const char* pose, const char* out,
                            const npt_clip_options* options, const npt_control* control, npt_result* result) {
  return c_api::guarded([&] {
    expect(transfer != nullptr && identity != nullptr && pose != nullptr && out != nullptr,
           "npt_animate_file: a null pointer");
    c_api::expect_result(result);
    animate(transfer->transfer, {c_api::path_of(identity), c_api::path_of(pose), c_api::path_of(out)},
            options_of(options), c_api::control_from(control), result);
  });
}
