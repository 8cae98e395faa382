/// Skeletons and clips for the page: read, put on another skeleton, shown and written.
///
/// A Motion is a skeleton and the clip that moves it, as a file has them, and also what comes of a transfer. It holds
/// all that it needs; its owner releases it.
#include "npt_web.hpp"

#include <formats/motion.hpp>
#include <formats/read.hpp>

#include <npt/body/roles/joint_role.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_patch.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/motion/character_motion.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>
#include <npt/transfer/motion/motion_warning.hpp>
#include <npt/transfer/motion_transfer.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace web;

/// A mesh on the skeleton of its estimated body.
struct Body {
  npt::Mesh mesh{};
  npt::SkinnedSkeleton skeleton{};
  double metres = 1;  ///< in a unit of the mesh

  void move(const npt::Motion& motion, std::optional<double> time, std::span<float> xyz) const {
    if (!time) {
      std::copy_n(mesh.coordinates().begin(), xyz.size(), xyz.begin());
      return;
    }
    const std::vector<npt::Affine> worlds = npt::joint_worlds(motion, time);
    std::vector<npt::Affine> moves(worlds.size());
    for (std::size_t j = 0; j < worlds.size(); ++j) {
      const std::size_t own = motion.joints[j].node;
      moves[own] = worlds[j] * npt::inverse(npt::Affine{npt::Matrix3::identity(), skeleton.joints[own]});
    }
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      const npt::Vec3d point = mesh.positions[v].as<double>();
      npt::Vec3d sum;
      for (std::size_t k = skeleton.start[v]; k < skeleton.start[v + 1]; ++k)
        sum += moves[skeleton.influences[k].joint](point) * static_cast<double>(skeleton.influences[k].weight);
      xyz[3 * v] = static_cast<float>(sum.x), xyz[3 * v + 1] = static_cast<float>(sum.y);
      xyz[3 * v + 2] = static_cast<float>(sum.z);
    }
  }
};

/// The scene of a file, which all motions of its character share; its mesh, where it has one.
struct File {
  npt::Scene scene{};
  std::optional<npt::Mesh> mesh{};
};

struct Motion {
  npt::MotionSkeleton skeleton;
  std::shared_ptr<const File> file{};  ///< whose nodes its joints are; none: BVH, or a body
  std::shared_ptr<const Body> body{};
  std::vector<npt::MotionWarning> warnings{};
  std::string source{};    ///< what it was taken from, for warnings
  std::string clips = "";  ///< of the file, as JSON
  std::vector<npt::Triangle> triangles{};
  npt::Clip own_clip{};  ///< its clip on the nodes of the file's scene

  const npt::Motion& motion() const { return skeleton.motion; }
  const npt::Mesh* mesh() const { return body ? &body->mesh : file && file->mesh ? &*file->mesh : nullptr; }
  double length() const { return motion().clip.channels.empty() ? 0 : motion().clip.length(); }
  double rate() const { return motion().rate > 0 ? motion().rate : 30; }

  /// What showing it needs, once its skeleton and its mesh are known.
  Motion* finished() {
    if (mesh() != nullptr) triangles = npt::triangulate(*mesh());
    own_clip = motion().clip;
    if (file != nullptr)
      for (npt::ClipChannel& channel : own_clip.channels) channel.node = motion().joints[channel.node].node;
    return this;
  }
};

/// What a motion that is being made would be released by, until it is the caller's.
Motion* adopted(std::unique_ptr<Motion> motion) {
  motion->finished();
  return motion.release();
}

std::string text_of(const std::vector<npt::Clip>& clips) {
  std::string text = "[";
  for (const npt::Clip& clip : clips)
    text += (text.back() == '[' ? "{\"name\":" : ",{\"name\":") + quoted(clip.name) +
            ",\"length\":" + number(clip.channels.empty() ? 0 : clip.length()) + "}";
  return text + "]";
}

std::string text_of(const Motion& motion) {
  std::string text = "[";
  for (const npt::MotionWarning& warning : motion.warnings)
    text += std::string(text.back() == '[' ? "" : ",") + "{\"code\":\"" +
            (warning.code == npt::MotionWarningCode::joints_missing ? "joints_missing" : "joints_uncertain") +
            "\",\"skeleton\":\"" + (warning.skeleton == npt::MeshRole::identity ? "character" : "source") +
            "\",\"text\":" + quoted(npt::text_of(warning, motion.skeleton.name, motion.source)) + "}";
  return text + "]";
}

std::string joints_of(const npt::MotionSkeleton& skeleton) {
  std::string text = "[";
  for (std::size_t j = 0; j < skeleton.motion.joints.size(); ++j) {
    const npt::MotionJoint& joint = skeleton.motion.joints[j];
    const npt::JointRole role = skeleton.roles.role_of(j);
    text += (j == 0 ? "{\"name\":" : ",{\"name\":") + quoted(joint.name) +
            ",\"parent\":" + (joint.parent == npt::no_item ? "-1" : std::to_string(joint.parent)) +
            ",\"role\":" + (role == npt::JointRole::none ? "null" : quoted(skeleton.roles.role_name(role))) +
            ",\"end\":" + (joint.end ? "true" : "false") + "}";
  }
  return text + "]";
}

constexpr std::int32_t no_clip = -1, first_clip = -2;

/// A clip of a scene; none: the skeleton alone.
const npt::Clip* clip_of(const npt::Scene& scene, std::int32_t clip, const std::string& name) {
  if (clip == no_clip || (clip == first_clip && scene.clips.empty())) return nullptr;
  if (clip == first_clip) {
    const auto lasting = std::find_if(scene.clips.begin(), scene.clips.end(),
                                      [](const npt::Clip& c) { return !c.channels.empty() && c.length() > 0.1; });
    return lasting == scene.clips.end() ? &scene.clips.front() : &*lasting;
  }
  const auto wanted = static_cast<std::size_t>(clip);
  if (wanted < scene.clips.size()) return &scene.clips[wanted];
  throw npt::Error({.file = name,
                    .found = std::to_string(scene.clips.size()) + " clips",
                    .expected = "more than " + std::to_string(wanted)});
}

npt::MotionOptions options_of(const char* clip_name, double time, double rate, bool foot_lock, double clearance,
                              bool in_place, bool root_motion) {
  npt::MotionOptions options;
  options.clip_name = clip_name;
  if (time >= 0) options.time = time;
  if (rate > 0) options.rate = rate;
  options.retarget.foot_lock = foot_lock;
  options.retarget.clearance = clearance;
  options.retarget.in_place = in_place;
  if (root_motion) options.retarget.root_motion = npt::RootMotion::extract;
  return options;
}

std::optional<double> time_or_rest(double time) { return time < 0 ? std::nullopt : std::optional(time); }

}  // namespace

extern "C" {

/// The skeleton of a file and its clip of this number; -1: none, as the file stands; -2: the first that is more than a pose.
/// BVH has one clip. map: a bone map as text, or empty
NPT_WEB Motion* web_read_motion(const char* path, const char* name, std::int32_t clip, const char* map) {
  return guarded(static_cast<Motion*>(nullptr), [&] {
    auto made = std::make_unique<Motion>();
    if (formats::is_bvh(path)) {
      npt::Motion motion = formats::read_bvh_motion(path);
      made->clips = text_of(std::vector<npt::Clip>{motion.clip});
      if (clip == no_clip) motion.clip = {motion.clip.name, {}};
      made->skeleton = npt::motion_skeleton(std::move(motion), name, {map, "bone map"});
      return adopted(std::move(made));
    }
    auto file = std::make_shared<File>(File{.scene = formats::read_scene(path)});
    if (!file->scene.shown.empty()) file->mesh = npt::ScenePoser(file->scene, name).mesh();
    made->clips = text_of(file->scene.clips);
    made->skeleton = npt::motion_skeleton(npt::motion_of(file->scene, clip_of(file->scene, clip, name), name), name,
                                          {map, "bone map"}, file->mesh ? &file->scene : nullptr);
    made->file = std::move(file);
    return adopted(std::move(made));
  });
}

/// The skeleton of a character's estimated body. mesh: the one that the character was made of
NPT_WEB Motion* web_character_motion(const Character* character, const Mesh* mesh) {
  return guarded(static_cast<Motion*>(nullptr), [&] {
    auto made = std::make_unique<Motion>();
    made->skeleton = npt::motion_skeleton(character->character, character->name);
    made->body = std::make_shared<Body>(
        Body{mesh->mesh, *character->character.skeleton(), metres_in(&character->owner, *mesh, "result.glb")});
    made->clips = "[]";
    return adopted(std::move(made));
  });
}

/// The source's clip on the target's skeleton. clip_name: empty: as the source's; time below 0: all of it, else the
/// pose at this second; rate 0: keys as the source has them; root_motion: the way over the ground on the topmost joint
NPT_WEB Motion* web_transfer_motion(const Motion* target, const Motion* source, const char* clip_name, double time,
                                    double rate, int foot_lock, double clearance, int in_place, int root_motion) {
  return guarded(static_cast<Motion*>(nullptr), [&] {
    npt::MotionResult result = npt::transfer_motion(
        source->skeleton, target->skeleton,
        options_of(clip_name, time, rate, foot_lock != 0, clearance, in_place != 0, root_motion != 0));
    auto made = std::make_unique<Motion>(Motion{.skeleton = target->skeleton});
    made->skeleton.motion = std::move(result.motion);
    made->skeleton.roles.confidence = result.confidence;
    made->file = target->file, made->body = target->body;
    made->warnings = std::move(result.warnings), made->source = source->skeleton.name;
    made->clips = text_of(std::vector<npt::Clip>{made->motion().clip});
    return adopted(std::move(made));
  });
}

/// Names, counts, joints, clips and warnings, as JSON.
NPT_WEB const char* web_motion_info(const Motion* motion) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    const npt::Mesh* mesh = motion->mesh();
    return returned("{\"name\":" + quoted(motion->skeleton.name) + ",\"clip\":" + quoted(motion->motion().clip.name) +
                    ",\"length\":" + number(motion->length()) + ",\"fps\":" + number(motion->rate()) +
                    ",\"confidence\":" + number(motion->skeleton.roles.confidence) +
                    ",\"ownJoints\":" + (motion->file != nullptr ? "true" : "false") +
                    ",\"vertexCount\":" + std::to_string(mesh == nullptr ? 0 : mesh->vertex_count()) +
                    ",\"triangleCount\":" + std::to_string(motion->triangles.size()) + ",\"clips\":" + motion->clips +
                    ",\"joints\":" + joints_of(motion->skeleton) + ",\"warnings\":" + text_of(*motion) + "}");
  });
}

/// Times of the clip's frames in seconds, as a JSON array.
NPT_WEB const char* web_motion_times(const Motion* motion, double rate) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    if (motion->length() == 0) return returned("[0]");
    npt::internal::expect_frames(motion->motion(), rate, motion->skeleton.name);
    std::string text = "[";
    for (const double time : npt::frame_times(motion->motion().clip, rate))
      text += (text.back() == '[' ? "" : ",") + number(time);
    return returned(text + "]");
  });
}

/// xyz: [J, 3] places of the joints in metres; time below 0: at rest
NPT_WEB int web_motion_joints(const Motion* motion, double time, float* xyz) {
  return guarded(0, [&] {
    for (const npt::Vec3d place : npt::joint_positions(motion->motion(), time_or_rest(time))) {
      *xyz++ = static_cast<float>(place.x), *xyz++ = static_cast<float>(place.y);
      *xyz++ = static_cast<float>(place.z);
    }
    return 1;
  });
}

/// xyz: [V, 3] the mesh; time below 0: as its file has it
NPT_WEB int web_motion_positions(const Motion* motion, double time, float* xyz) {
  return guarded(0, [&] {
    const npt::Mesh* mesh = motion->mesh();
    if (mesh == nullptr) return 1;
    const std::span<float> all(xyz, 3 * mesh->vertex_count());
    if (motion->body != nullptr)
      motion->body->move(motion->motion(), time_or_rest(time), all);
    else
      npt::ScenePoser(motion->file->scene, motion->skeleton.name)
          .positions(time < 0 ? nullptr : &motion->own_clip, time, all);
    return 1;
  });
}
NPT_WEB const void* web_motion_triangles(const Motion* motion) { return motion->triangles.data(); }

/// Writes BVH at a rate; or the character's own file, `from`, with the clip in it; or, where the skeleton is that of an
/// estimated body, a GLB. apply: the clip's first pose as the rest of the joints
NPT_WEB int web_write_motion(const Motion* motion, const char* from, const char* to, double rate, int apply) {
  return guarded(0, [&] {
    if (fs::path(to).extension() == ".bvh") {
      npt::write_bvh(to, npt::bvh_of(motion->motion(), rate > 0 ? rate : motion->rate()));
    } else if (motion->body != nullptr) {
      const Body& body = *motion->body;
      npt::write_scene(to, npt::scene_with_motions(body.mesh, fs::path(motion->skeleton.name).stem().string(),
                                                   body.skeleton, {&motion->motion(), 1}, body.metres));
    } else {
      npt::write_with_motion(from, motion->motion(), {.name = {}, .apply = apply != 0, .time = 0}, to);
    }
    return 1;
  });
}
NPT_WEB void web_release_motion(Motion* motion) { delete motion; }

}  // extern "C"
