/// Motions of npt_c.h put onto characters, and written into their files.
#include "npt_c_motion_types.hpp"

#include <npt/base/control.hpp>
#include <npt/body/roles/bone_map.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/file.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_patch.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/clip_of_motion.hpp>
#include <npt/transfer/motion/character_motion.hpp>
#include <npt/transfer/motion/motion_checks.hpp>
#include <npt/transfer/motion/motion_warning.hpp>
#include <npt/transfer/motion_transfer.hpp>
#include <npt/transfer/retarget_options.hpp>

#include <cmath>
#include <string_view>
#include <system_error>

namespace {

namespace fs = std::filesystem;
using c_api::expect, c_api::guarded, c_api::has_extension, c_api::OwnedMotion;
using Motions = std::span<const npt_motion* const>;

// ---- Options and reports

npt_motion_options options_of(const npt_motion_options* given) {
  npt_motion_options options{};
  options.size = sizeof options;
  npt_default_motion_options(&options);
  if (given != nullptr) options = *given;
  expect(options.size == sizeof(npt_motion_options) && options.version == NPT_MOTION_OPTIONS_VERSION,
         "npt_motion_options: fill it with npt_default_motion_options, of this version's header");
  expect(options.fps == 0 || (options.fps >= 0.001 && options.fps <= 1000),
         "npt_motion_options: fps that isn't between 0.001 and 1000");
  expect(options.clearance >= 0 && options.clearance <= 1, "npt_motion_options: a clearance that isn't from 0 to 1");
  expect(options.key_tolerance >= 0 && std::isfinite(options.key_tolerance),
         "npt_motion_options: a key tolerance below 0");
  expect(!std::isnan(options.time), "npt_motion_options: a time that is no number");
  expect(options.apply == 0 || options.time >= 0, "npt_motion_options: apply wants a time: the pose's");
  const int root = c_api::number_of(options.root_motion);
  expect(root == NPT_ROOT_KEEP || root == NPT_ROOT_EXTRACT, "npt_motion_options: an unknown root motion");
  return options;
}
static_assert(static_cast<int>(npt::RootMotion::keep) == NPT_ROOT_KEEP &&
              static_cast<int>(npt::RootMotion::extract) == NPT_ROOT_EXTRACT);

npt::MotionOptions library_options(const npt_motion_options& given) {
  npt::MotionOptions options;
  if (given.clip_name != nullptr) options.clip_name = given.clip_name;
  if (given.time >= 0) options.time = given.time;
  if (given.fps > 0) options.rate = given.fps;
  options.retarget.foot_lock = given.foot_lock != 0;
  options.retarget.clearance = given.clearance;
  options.retarget.touch = given.touch != 0;
  options.retarget.in_place = given.in_place != 0;
  options.retarget.root_motion = static_cast<npt::RootMotion>(given.root_motion);
  options.retarget.twist = given.twist != 0;
  options.retarget.key_tolerance = given.key_tolerance;
  return options;
}

void expect_report(const npt_motion_report* report) {
  expect(report == nullptr || report->size == sizeof(npt_motion_report),
         "npt_motion_report: a size that isn't sizeof(npt_motion_report)");
}

static_assert(static_cast<int>(npt::MotionWarningCode::joints_uncertain) == NPT_MOTION_JOINTS_UNCERTAIN &&
              static_cast<int>(npt::MotionWarningCode::joints_missing) == NPT_MOTION_JOINTS_MISSING);
static_assert(npt::joint_role_count <= 64);

npt_motion_warning warning_of(const npt::MotionWarning& own) {
  npt_motion_warning warning{static_cast<npt_motion_warning_code>(own.code),
                             own.skeleton == npt::MeshRole::pose ? NPT_POSE : NPT_IDENTITY, own.value, 0,
                             own.kind == npt::SkeletonKind::four_legged ? 1 : 0};
  for (const npt::JointRole role : own.roles) warning.roles |= std::uint64_t{1} << npt::index_of(role);
  return warning;
}
npt::MotionWarning warning_from(const npt_motion_warning& given) {
  npt::MotionWarning warning{
      static_cast<npt::MotionWarningCode>(given.code),
      c_api::number_of(given.skeleton) == NPT_POSE ? npt::MeshRole::pose : npt::MeshRole::identity,
      given.four_legged != 0 ? npt::SkeletonKind::four_legged : npt::SkeletonKind::person,
      given.value,
      {}};
  for (std::size_t r = 0; r < npt::joint_role_count; ++r)
    if ((given.roles >> r & 1U) != 0) warning.roles.push_back(static_cast<npt::JointRole>(r));
  return warning;
}

/// What was said of several clips: each warning once, the lowest confidence.
struct Report {
  std::size_t clips = 0;
  double confidence = 1;
  std::vector<npt::MotionWarning> warnings{};

  void add(const npt::MotionResult& result) {
    ++clips;
    confidence = std::min(confidence, result.confidence);
    for (const npt::MotionWarning& warning : result.warnings)
      if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
  }
  void fill(npt_motion_report* out) const {
    if (out == nullptr) return;
    out->clips = clips;
    out->confidence = confidence;
    out->warning_count = std::min<std::size_t>(warnings.size(), NPT_MOST_MOTION_WARNINGS);
    for (std::size_t i = 0; i < out->warning_count; ++i) out->warnings[i] = warning_of(warnings[i]);
  }
};

// ---- The transfer

OwnedMotion transfer(const npt_motion& character, const npt_motion& motion, const npt_motion_options& options,
                     Report& report) {
  for (const npt_motion* one : {&character, &motion})
    if (one->refusal) throw npt::Error(*one->refusal);
  npt::MotionResult made = npt::transfer_motion(motion.skeleton, character.skeleton, library_options(options));
  report.add(made);
  auto result = std::make_unique<npt_motion>();
  result->skeleton = {std::move(made.motion), character.skeleton.roles, character.skeleton.shape,
                      character.skeleton.name};
  result->character = character.character;
  result->result = true;
  result->applies = options.apply != 0;
  result->clips = {result->skeleton.motion.clip.name};
  result->order = character.order;
  return result;
}

// ---- Files

void expect_output(const fs::path& out) {
  if (!has_extension(out, {".glb", ".gltf", ".vrm", ".bvh"}))
    throw npt::Error({.file = out.string(),
                      .found = "extension " + npt::in_quotes(out.extension().string()),
                      .expected = ".glb, .gltf, .vrm or .bvh"});
}

npt::Bvh bvh_from(const npt_motion& motion) {
  const npt::Motion& own = motion.skeleton.motion;
  const std::string& name = motion.skeleton.name;
  if (std::ranges::count(own.joints, npt::no_item, &npt::MotionJoint::parent) != 1)
    throw npt::Error({.file = name, .found = "several joints without parent", .expected = "one, for a BVH file"});
  const double rate = npt::sampling_rate(own);
  if (own.clip.length() * rate > 100'000)
    throw npt::Error(
        {.file = name, .found = std::to_string(own.clip.length()) + " s", .expected = "at most 100000 frames"});
  return npt::bvh_of(own, rate);
}

/// All of one character.
const c_api::MotionCharacter& character_of(Motions motions) {
  for (const npt_motion* motion : motions) {
    expect(motion != nullptr, "npt_write_motions: a null pointer for a motion");
    expect(motion->result,
           "npt_write_motions: a motion that npt_transfer_motion didn't make, for another file than .bvh");
    expect(motion->character == motions.front()->character, "npt_write_motions: motions of different characters");
  }
  if (motions.front()->character == nullptr)
    throw npt::Error({.file = motions.front()->skeleton.name,
                      .found = "a character that is no file of a rig",
                      .expected = ".glb, .gltf, .vrm or .fbx, or .bvh for the result"});
  return *motions.front()->character;
}

/// Of a character that npt has as a scene, or makes one of.
npt::Scene scene_of(const c_api::MotionCharacter& character, Motions motions, c_api::Notes& notes) {
  const std::string& name = motions.front()->skeleton.name;
  if (character.estimated) {
    const auto& [mesh, skeleton, unit] = *character.estimated;
    std::vector<npt::Motion> own;
    for (const npt_motion* motion : motions) {
      expect(!motion->applies, "npt_write_motions: apply wants a character with joints of its own");
      own.push_back(motion->skeleton.motion);
    }
    return npt::scene_with_motions(mesh, name, skeleton, own, unit);
  }
  npt::Scene scene = *character.scene;
  for (const npt_motion* motion : motions) {
    const npt::Motion& own = motion->skeleton.motion;
    if (motion->applies)
      npt::set_rest(scene, own, 0);
    else
      npt::add_clip(scene, own, {});
  }
  std::string without;
  for (const std::string& lost : character.lost) without += (without.empty() ? "" : "; ") + lost;
  if (!without.empty()) notes.lines.push_back(name + ": a GLB of it lacks " + without);
  return scene;
}

bool is_scene(const c_api::MotionCharacter& character) { return character.scene || character.estimated; }

/// The bytes of a character's file with the motions.
std::string patched(std::string bytes, Motions motions, c_api::Notes& notes) {
  for (const npt_motion* motion : motions)
    bytes = npt::with_motion(bytes, motion->skeleton.motion, {.name = {}, .apply = motion->applies, .time = 0},
                             motion->skeleton.name, &notes.lines);
  return bytes;
}

void write_rig(const c_api::MotionCharacter& character, Motions motions, const fs::path& out, c_api::Notes& notes) {
  if (is_scene(character)) {
    if (!has_extension(out, {".glb"}))
      throw npt::Error({.file = out.string(),
                        .found = "extension " + npt::in_quotes(out.extension().string()),
                        .expected = ".glb, for this character"});
    return npt::write_scene(out, scene_of(character, motions, notes));
  }
  if (character.path.empty()) {
    const bool text = !character.bytes.starts_with("glTF");
    if (text != has_extension(out, {".gltf"}))
      throw npt::Error({.file = out.string(),
                        .found = "extension " + npt::in_quotes(out.extension().string()),
                        .expected = text ? ".gltf, as the character is" : ".glb or .vrm, as the character is"});
    return npt::write_file(out, patched(character.bytes, motions, notes));
  }
  fs::path from = character.path;
  for (const npt_motion* motion : motions) {
    npt::write_with_motion(from, motion->skeleton.motion, {.name = {}, .apply = motion->applies, .time = 0}, out,
                           &notes.lines);
    from = out;
  }
}

void write(Motions motions, const fs::path& out, c_api::Notes& notes) {
  expect(!motions.empty() && motions.front() != nullptr, "npt_write_motions: no motion");
  expect_output(out);
  if (!has_extension(out, {".bvh"})) return write_rig(character_of(motions), motions, out, notes);
  if (motions.size() != 1)
    throw npt::Error({.file = out.string(), .found = std::to_string(motions.size()) + " motions", .expected = "one"});
  npt::write_bvh(out, bvh_from(*motions.front()));
}

std::string rig_bytes(const npt_motion& motion, c_api::Notes& notes) {
  const npt_motion* const one = &motion;
  const Motions motions(&one, 1);
  const c_api::MotionCharacter& character = character_of(motions);
  if (is_scene(character)) return npt::glb_bytes(scene_of(character, motions, notes), motion.skeleton.name);
  return patched(character.path.empty() ? character.bytes : npt::read_file(character.path), motions, notes);
}

/// Bytes as npt_c.h shows them, and what it shows.
struct OwnedBytes : npt_bytes {
  std::string content;
};

// ---- From files to a file

void transfer_file(const npt_file* character, const npt_file* motion, const fs::path& out,
                   const npt_motion_options& options, const npt::Control& control, Report& report) {
  c_api::Notes notes;
  expect_output(out);
  std::error_code ignored;
  if (motion != nullptr && motion->size == sizeof(npt_file) && motion->path != nullptr && motion->bytes == nullptr &&
      fs::equivalent(out, c_api::path_of(motion->path), ignored))
    throw npt::Error({.file = out.string(), .found = "the clip's file", .expected = "another file"});
  control.step(0);
  const OwnedMotion hero = c_api::read_skeleton(character, options.character_bone_map, notes);
  control.step(0.3);
  c_api::WantedClips wanted{.name = {}, .several = !has_extension(out, {".bvh"}) && options.time < 0};
  if (options.clip != nullptr) wanted.name = options.clip;
  const std::vector<OwnedMotion> clips = c_api::read_clips(motion, wanted, options.motion_bone_map, notes);
  std::vector<OwnedMotion> results;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    control.step(0.5 + 0.4 * static_cast<double>(i) / static_cast<double>(clips.size()));
    const npt::Clip& clip = clips[i]->skeleton.motion.clip;
    if (clips.size() > 1 && (clip.channels.empty() || !(clip.length() > 0))) {
      notes.lines.push_back(clips[i]->skeleton.name + ": clip " + npt::in_quotes(clip.name) +
                            " lasts 0 s and is left out");
      continue;
    }
    npt_motion_options own = options;
    if (clips.size() > 1) own.clip_name = nullptr;
    results.push_back(transfer(*hero, *clips[i], own, report));
  }
  if (results.empty())
    throw npt::Error({.file = clips.front()->skeleton.name,
                      .found = "clips of 0 s alone",
                      .expected = "a clip that lasts, or a time for a pose"});
  control.step(0.9);
  std::vector<const npt_motion*> all;
  all.reserve(results.size());
  for (const OwnedMotion& result : results) all.push_back(result.get());
  write(all, out, notes);
  control.step(1);
}

}  // namespace

npt_status npt_default_motion_options(npt_motion_options* options) {
  return guarded([&] {
    expect(options != nullptr && options->size == sizeof(npt_motion_options),
           "npt_default_motion_options: a null pointer, or a size that isn't sizeof(npt_motion_options)");
    const npt::RetargetOptions own;
    *options = {};
    options->size = sizeof(npt_motion_options);
    options->version = NPT_MOTION_OPTIONS_VERSION;
    options->time = -1;
    options->foot_lock = own.foot_lock ? 1 : 0;
    options->clearance = own.clearance;
    options->touch = own.touch ? 1 : 0;
    options->twist = own.twist ? 1 : 0;
    options->key_tolerance = own.key_tolerance;
  });
}

const char* npt_motion_warning_text(const npt_motion_warning* warning, const char* character, const char* motion) {
  if (warning == nullptr) return "";
  const char* text = "";
  guarded([&] {
    const int code = c_api::number_of(warning->code);
    expect(code >= 0 && code <= NPT_MOTION_JOINTS_MISSING, "npt_motion_warning_text: an unknown code");
    text = c_api::kept(npt::text_of(warning_from(*warning), character != nullptr ? character : "character",
                                    motion != nullptr ? motion : "motion"));
  });
  return text;
}

npt_status npt_transfer_motion(const npt_motion* character, const npt_motion* motion, const npt_motion_options* options,
                               npt_motion** result, npt_motion_report* report) {
  return guarded([&] {
    expect(character != nullptr && motion != nullptr && result != nullptr, "npt_transfer_motion: a null pointer");
    expect_report(report);
    c_api::Notes notes;
    Report own;
    *result = c_api::given(transfer(*character, *motion, options_of(options), own));
    own.fill(report);
  });
}

npt_status npt_write_motions(const npt_motion* const* motions, size_t count, const char* path) {
  return guarded([&] {
    expect(motions != nullptr && path != nullptr, "npt_write_motions: a null pointer");
    c_api::Notes notes;
    write({motions, count}, c_api::path_of(path), notes);
  });
}
npt_status npt_write_motion(const npt_motion* motion, const char* path) { return npt_write_motions(&motion, 1, path); }

npt_status npt_motion_bytes(const npt_motion* motion, npt_motion_format format, const npt_bytes** bytes) {
  return guarded([&] {
    expect(motion != nullptr && bytes != nullptr, "npt_motion_bytes: a null pointer");
    c_api::Notes notes;
    auto made = std::make_unique<OwnedBytes>();
    switch (c_api::number_of(format)) {
      case NPT_FORMAT_RIG:
        made->content = rig_bytes(*motion, notes);
        break;
      case NPT_FORMAT_BVH:
        made->content = npt::format_bvh(bvh_from(*motion));
        break;
      case NPT_FORMAT_BONE_MAP:
        made->content = npt::format_bone_map(motion->skeleton.motion, motion->skeleton.roles);
        break;
      default:
        throw c_api::BadArgument{"npt_motion_bytes: an unknown format"};
    }
    static_cast<npt_bytes&>(*made) = {sizeof(npt_bytes), made->content.c_str(), made->content.size()};
    *bytes = made.release();
  });
}
void npt_close_bytes(const npt_bytes* bytes) { delete static_cast<const OwnedBytes*>(bytes); }

npt_status npt_transfer_motion_file(const npt_file* character, const npt_file* motion, const char* out,
                                    const npt_motion_options* options, const npt_control* control,
                                    npt_motion_report* report) {
  return guarded([&] {
    expect(out != nullptr, "npt_transfer_motion_file: a null pointer for the output");
    expect_report(report);
    Report own;
    transfer_file(character, motion, c_api::path_of(out), options_of(options), c_api::control_from(control), own);
    own.fill(report);
  });
}
