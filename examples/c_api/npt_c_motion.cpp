/// Motions of npt_c.h: read from files, made of arrays, described and sampled.
#include "npt_c_motion_types.hpp"

#include <formats/read.hpp>

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/placed_motion.hpp>
#include <npt/body/roles/rest_pose.hpp>
#include <npt/body/roles/root_motion.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/joined_nodes.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/animation.hpp>
#include <npt/transfer/motion/character_motion.hpp>

#include <cmath>
#include <string_view>

namespace {

namespace fs = std::filesystem;
using c_api::expect, c_api::guarded, c_api::OwnedMotion;

constexpr std::size_t most_frames = 100'000;

// ---- Files

enum class Kind { gltf, bvh, foreign };

Kind kind_of_path(const fs::path& path) {
  if (c_api::has_extension(path, {".glb", ".gltf", ".vrm"})) return Kind::gltf;
  if (c_api::has_extension(path, {".bvh"})) return Kind::bvh;
  if (c_api::has_extension(path, {".fbx", ".dae"})) return Kind::foreign;
  throw npt::Error({.file = path.string(),
                    .found = "extension " + npt::in_quotes(path.extension().string()),
                    .expected = ".glb, .gltf, .vrm, .bvh or .fbx"});
}

Kind kind_of_bytes(std::string_view bytes, const std::string& name) {
  if (bytes.starts_with("glTF")) return Kind::gltf;
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
  if (bytes.starts_with('{')) return Kind::gltf;
  std::string word(bytes.substr(0, 9));
  for (char& c : word)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  if (word == "HIERARCHY") return Kind::bvh;
  const bool fbx = bytes.starts_with("Kaydara FBX") || bytes.starts_with("; FBX");
  throw npt::Error({.file = name,
                    .found = fbx ? "the bytes of an FBX file" : "bytes of no known format",
                    .expected = fbx ? "its path" : "a GLB, a glTF, a VRM or a BVH"});
}

/// A file of the caller's, read as what it is.
struct ReadFile {
  std::string name;
  fs::path path;           ///< empty where it was given as bytes
  std::string_view bytes;  ///< the caller's
  Kind kind = Kind::gltf;
  std::optional<npt::Scene> scene;  ///< of all but BVH
  std::vector<std::string> lost;    ///< what of an FBX file isn't in the scene
};

ReadFile read(const npt_file* given, const char* name, c_api::Notes& notes) {
  expect(given != nullptr && given->size == sizeof(npt_file),
         "npt_file: a null pointer, or a size that isn't sizeof(npt_file)");
  expect(given->path != nullptr || given->bytes != nullptr, "npt_file: neither a path nor bytes");
  ReadFile file{.name = given->path != nullptr ? given->path : name, .path = {}, .bytes = {}, .scene = {}, .lost = {}};
  if (given->bytes != nullptr) {
    file.bytes = {static_cast<const char*>(given->bytes), given->byte_count};
    file.kind = kind_of_bytes(file.bytes, file.name);
    if (file.kind == Kind::gltf) file.scene = npt::scene_of_bytes(file.bytes, file.name, &notes.lines);
    return file;
  }
  file.path = c_api::path_of(given->path);
  file.kind = kind_of_path(file.path);
  if (file.kind == Kind::gltf) file.scene = npt::read_scene(file.path, &notes.lines);
  if (file.kind == Kind::foreign) file.scene = npt::with_joined_nodes(formats::read_foreign(file.path, &file.lost));
  return file;
}

npt::Motion bvh_motion(const ReadFile& file) {
  const std::string clip = file.path.empty() ? "motion" : file.path.stem().string();
  const npt::Bvh bvh = file.path.empty() ? npt::parse_bvh(file.bytes, file.name) : npt::read_bvh(file.path);
  return npt::placed_motion(npt::motion_of(bvh, clip));
}

std::vector<std::string> clip_names(const std::optional<npt::Scene>& scene, const npt::Motion& motion) {
  if (!scene) return {motion.clip.name};
  std::vector<std::string> names;
  for (const npt::Clip& clip : scene->clips) names.push_back(clip.name);
  return names;
}

OwnedMotion motion_from(npt::Motion own, const ReadFile& file, const char* bone_map) {
  auto motion = std::make_unique<npt_motion>();
  motion->clips = clip_names(file.scene, own);
  const bool has_mesh = file.scene && !file.scene->shown.empty();
  c_api::find_roles(*motion, std::move(own), file.name, bone_map, has_mesh ? &*file.scene : nullptr);
  return motion;
}

}  // namespace

OwnedMotion c_api::read_skeleton(const npt_file* given, const char* bone_map, Notes& notes) {
  ReadFile file = read(given, "character", notes);
  npt::Motion own = file.kind == Kind::bvh ? bvh_motion(file) : npt::motion_of(*file.scene, nullptr, file.name);
  const std::string clip = own.clip.name;
  if (file.kind == Kind::bvh) own.clip = {}, own.rate = 0;
  OwnedMotion motion = motion_from(std::move(own), file, bone_map);
  if (file.kind == Kind::bvh) {
    motion->clips = {clip};
    return motion;
  }
  MotionCharacter character{std::move(file.path), std::string(file.bytes), {}, std::move(file.lost), {}};
  if (file.kind == Kind::foreign) character.scene = *std::move(file.scene);
  motion->character = std::make_shared<const MotionCharacter>(std::move(character));
  return motion;
}

std::vector<OwnedMotion> c_api::read_clips(const npt_file* given, const WantedClips& wanted, const char* bone_map,
                                           Notes& notes) {
  const ReadFile file = read(given, "motion", notes);
  std::vector<OwnedMotion> motions;
  if (file.kind == Kind::bvh) {
    npt::Motion own = bvh_motion(file);
    if (wanted.name && *wanted.name != own.clip.name)
      throw npt::Error({.file = file.name,
                        .found = "no clip " + npt::in_quotes(*wanted.name),
                        .expected = npt::in_quotes(own.clip.name)});
    motions.push_back(motion_from(std::move(own), file, bone_map));
    return motions;
  }
  const std::vector<npt::Clip>& clips = file.scene->clips;
  if (clips.empty()) throw npt::Error({.file = file.name, .found = "no clip", .expected = "curves that move joints"});
  if (!wanted.name && !wanted.several && clips.size() > 1)
    throw npt::Error({.file = file.name,
                      .found = std::to_string(clips.size()) + " clips",
                      .expected = "the name of one of them: " + npt::clip_names(*file.scene)});
  const npt::Clip* const one = wanted.name ? &npt::find_clip(*file.scene, *wanted.name, file.name) : nullptr;
  for (const npt::Clip& clip : clips)
    if (one == nullptr || &clip == one)
      motions.push_back(motion_from(npt::motion_of(*file.scene, &clip, file.name), file, bone_map));
  return motions;
}

namespace {

// ---- Arrays

npt::Vec3d vector_at(const float* values, std::size_t i) {
  return {static_cast<double>(values[3 * i]), static_cast<double>(values[3 * i + 1]),
          static_cast<double>(values[3 * i + 2])};
}
npt::Quaternion quaternion_at(const float* values, std::size_t i) {
  return {static_cast<double>(values[4 * i]), static_cast<double>(values[4 * i + 1]),
          static_cast<double>(values[4 * i + 2]), static_cast<double>(values[4 * i + 3])};
}

/// A motion of arrays whose joints stand in any order with parents first, as one whose joints stand depth first.
class MotionOfData {
 public:
  MotionOfData(const npt_motion_data& data, std::string name) : data_(data), name_(std::move(name)) {}

  npt::Motion make(std::vector<std::size_t>& order) {
    check();
    number_joints();
    npt::Motion motion;
    motion.joints.resize(data_.joints);
    for (std::size_t j = 0; j < data_.joints; ++j) motion.joints[number_[j]] = joint(j);
    if (data_.base != nullptr)
      motion.base = {npt::Matrix3{{{row(0), row(1), row(2)}}}, {data_.base[3], data_.base[7], data_.base[11]}};
    if (data_.frames > 0) add_clip(motion);
    order = number_;
    return motion;
  }

 private:
  void check() const {
    constexpr std::size_t most_joints = 65536, most_values = std::size_t{1} << 28;
    expect(data_.joints > 0 && data_.joints <= most_joints, "npt_motion_data: not between 1 and 65536 joints");
    expect(data_.names != nullptr && data_.parents != nullptr && data_.rest_translations != nullptr,
           "npt_motion_data: a null pointer for names, parents or places at rest");
    expect(data_.frames <= most_frames && data_.frames * data_.joints <= most_values,
           "npt_motion_data: more than 100000 frames, or 2^28 places");
    for (std::size_t j = 0; j < data_.joints; ++j) {
      expect(data_.names[j] != nullptr, "npt_motion_data: a null pointer for a name");
      if (data_.parents[j] < -1 || data_.parents[j] >= static_cast<std::int32_t>(j))
        throw npt::Error({.file = name_,
                          .place = "joint " + npt::in_quotes(data_.names[j]),
                          .found = "parent " + std::to_string(data_.parents[j]),
                          .expected = "-1 or a joint before it"});
      check_rotations(data_.rest_rotations, 1, j);
      check_rotations(data_.rotations, data_.frames, j);
    }
  }
  void check_rotations(const float* rotations, std::size_t frames, std::size_t joint) const {
    for (std::size_t f = 0; rotations != nullptr && f < frames; ++f)
      if (const npt::Quaternion q = quaternion_at(rotations, f * data_.joints + joint); !(dot(q, q) > 1e-12))
        throw npt::Error({.file = name_,
                          .place = "joint " + npt::in_quotes(data_.names[joint]) + ", frame " + std::to_string(f),
                          .found = "a rotation that is none",
                          .expected = "a quaternion of length 1"});
  }

  void number_joints() {
    std::vector<std::vector<std::size_t>> children(data_.joints + 1);  // 0: of what is above the roots
    for (std::size_t j = 0; j < data_.joints; ++j)
      children[data_.parents[j] < 0 ? 0 : static_cast<std::size_t>(data_.parents[j]) + 1].push_back(j + 1);
    number_.resize(data_.joints);
    std::vector<std::size_t> open(children[0].rbegin(), children[0].rend());
    for (std::size_t next = 0; !open.empty(); ++next) {
      const std::size_t at = open.back();
      open.pop_back();
      number_[at - 1] = next;
      open.insert(open.end(), children[at].rbegin(), children[at].rend());
    }
  }

  npt::MotionJoint joint(std::size_t j) const {
    npt::MotionJoint made{.name = data_.names[j], .parent = npt::no_item};
    if (data_.parents[j] >= 0) made.parent = number_[static_cast<std::size_t>(data_.parents[j])];
    made.rest.translation = vector_at(data_.rest_translations, j);
    if (data_.rest_rotations != nullptr) made.rest.rotation = npt::normalised(quaternion_at(data_.rest_rotations, j));
    if (data_.rest_scales != nullptr) made.rest.scale = vector_at(data_.rest_scales, j);
    return made;
  }
  npt::Vec3d row(std::size_t r) const { return {data_.base[4 * r], data_.base[4 * r + 1], data_.base[4 * r + 2]}; }

  void add_clip(npt::Motion& motion) const {
    motion.clip.name = data_.clip != nullptr ? data_.clip : name_;
    std::vector<float> times;
    for (std::size_t f = 0; f < data_.frames; ++f)
      times.push_back(static_cast<float>(data_.times != nullptr ? data_.times[f] : static_cast<double>(f) / 30));
    const auto add = [&](const float* values, npt::ChannelPath path, std::size_t width) {
      for (std::size_t j = 0; values != nullptr && j < data_.joints; ++j) {
        npt::ClipChannel channel{number_[j], path, npt::Interpolation::linear, width, times, {}};
        for (std::size_t f = 0; f < data_.frames; ++f)
          channel.values.insert(channel.values.end(), values + width * (f * data_.joints + j),
                                values + width * (f * data_.joints + j + 1));
        motion.clip.channels.push_back(std::move(channel));
      }
    };
    add(data_.translations, npt::ChannelPath::translation, 3);
    add(data_.rotations, npt::ChannelPath::rotation, 4);
    motion.rate = npt::key_rate(motion.clip);
  }

  const npt_motion_data& data_;
  std::string name_;
  std::vector<std::size_t> number_;  ///< [joints] of the caller's, in the motion
};

void write_frame(const npt_motion& motion, std::optional<double> time, std::size_t frame,
                 const npt_motion_frames& out) {
  const npt::Motion& own = motion.skeleton.motion;
  const std::size_t count = own.joints.size();
  const auto put = [](float* to, auto... values) { ((*to++ = static_cast<float>(values)), ...); };
  const std::vector<npt::NodePlace> places = npt::local_places(own, time);
  std::vector<npt::Affine> worlds;
  if (out.positions != nullptr) worlds = npt::joint_worlds(own, time);
  for (std::size_t j = 0; j < count; ++j) {
    const npt::NodePlace& place = places[motion.own(j)];
    const std::size_t at = frame * count + j;
    if (out.translations != nullptr)
      put(out.translations + 3 * at, place.translation.x, place.translation.y, place.translation.z);
    if (out.rotations != nullptr)
      put(out.rotations + 4 * at, place.rotation.x, place.rotation.y, place.rotation.z, place.rotation.w);
    if (out.scales != nullptr) put(out.scales + 3 * at, place.scale.x, place.scale.y, place.scale.z);
    if (out.positions == nullptr) continue;
    const npt::Vec3d& world = worlds[motion.own(j)].shift;
    put(out.positions + 3 * at, world.x, world.y, world.z);
  }
}

npt_rest_pose rest_pose_of(const npt::MotionSkeleton& skeleton) {
  if (skeleton.roles.confidence < npt::least_skeleton_confidence) return NPT_REST_OTHER;
  return static_cast<npt_rest_pose>(npt::rest_pose_of(skeleton.motion, skeleton.roles));
}
static_assert(static_cast<int>(npt::RestPose::t) == NPT_REST_T && static_cast<int>(npt::RestPose::a) == NPT_REST_A &&
              static_cast<int>(npt::RestPose::arms_down) == NPT_REST_ARMS_DOWN &&
              static_cast<int>(npt::RestPose::other) == NPT_REST_OTHER);
static_assert(NPT_ROLES == npt::joint_role_count);

/// The caller's number of a joint.
std::int32_t given_number(const npt_motion& motion, std::size_t joint) {
  if (joint == npt::no_item || motion.order.empty())
    return joint == npt::no_item ? -1 : static_cast<std::int32_t>(joint);
  return static_cast<std::int32_t>(std::ranges::find(motion.order, joint) - motion.order.begin());
}

void describe(const npt_motion& motion, npt_motion_info& info) {
  const npt::Motion& own = motion.skeleton.motion;
  const npt::JointRoles& roles = motion.skeleton.roles;
  const npt::RootPath root = npt::root_motion_of(own, roles);
  info.joints = own.joints.size();
  info.names = motion.name_pointers.data();
  info.parents = motion.parents.data();
  info.nodes = motion.nodes.data();
  info.clip = own.clip.name.c_str();
  info.length = own.clip.length();
  info.rate = own.rate;
  info.clip_count = motion.clips.size();
  info.clips = motion.clip_pointers.data();
  info.unit = npt::metres_a_unit(own);
  info.up = npt::up_axis(own).data();  // of a literal
  const std::array<double, 3> shift{own.base.shift.x, own.base.shift.y, own.base.shift.z};
  for (std::size_t r = 0; r < 3; ++r) {
    const npt::Vec3d& row = own.base.linear.rows[r];
    info.base[r][0] = row.x, info.base[r][1] = row.y, info.base[r][2] = row.z, info.base[r][3] = shift[r];
  }
  info.rest_pose = rest_pose_of(motion.skeleton);
  info.dialect = roles.dialect.c_str();
  info.confidence = roles.confidence;
  info.four_legged = roles.kind() == npt::SkeletonKind::four_legged ? 1 : 0;
  info.root_joint = given_number(motion, root.joint);
  info.root_shift[0] = root.way.x, info.root_shift[1] = root.way.y, info.root_shift[2] = root.way.z;
}

}  // namespace

int npt_reads_fbx(void) { return formats::reads_foreign() ? 1 : 0; }
const char* npt_last_notes(void) { return c_api::last_notes.c_str(); }

npt_status npt_read_skeleton(const npt_file* file, const char* bone_map, npt_motion** motion) {
  return guarded([&] {
    expect(motion != nullptr, "npt_read_skeleton: a null pointer for the motion");
    c_api::Notes notes;
    *motion = c_api::given(c_api::read_skeleton(file, bone_map, notes));
  });
}

npt_status npt_read_motion(const npt_file* file, const char* clip, const char* bone_map, npt_motion** motion) {
  return guarded([&] {
    expect(motion != nullptr, "npt_read_motion: a null pointer for the motion");
    c_api::Notes notes;
    c_api::WantedClips wanted;
    if (clip != nullptr) wanted.name = clip;
    *motion = c_api::given(std::move(c_api::read_clips(file, wanted, bone_map, notes).front()));
  });
}

npt_status npt_make_motion(const npt_motion_data* data, const char* bone_map, npt_motion** motion) {
  return guarded([&] {
    expect(data != nullptr && motion != nullptr, "npt_make_motion: a null pointer");
    expect(data->size == sizeof(npt_motion_data), "npt_motion_data: a size that isn't sizeof(npt_motion_data)");
    c_api::Notes notes;
    const std::string name = data->name != nullptr ? data->name : "motion";
    auto made = std::make_unique<npt_motion>();
    npt::Motion own = MotionOfData(*data, name).make(made->order);
    if (data->frames > 0) made->clips = {own.clip.name};
    c_api::find_roles(*made, std::move(own), name, bone_map, nullptr);
    *motion = c_api::given(std::move(made));
  });
}

npt_status npt_motion_of_character(const npt_transfer* transfer, const npt_character* character, npt_joint_names names,
                                   npt_motion** motion) {
  return guarded([&] {
    expect(transfer != nullptr && character != nullptr && motion != nullptr, "npt_motion_of_character: a null pointer");
    const int called = c_api::number_of(names);
    expect(called >= NPT_VRM && called <= NPT_SMPL, "npt_motion_of_character: unknown names of joints");
    c_api::Notes notes;
    const npt::Character& own = character->character;
    npt::Mesh mesh;
    mesh.positions.resize(own.vertex_count());
    std::ranges::copy(own.positions(), mesh.coordinates().begin());
    npt::set_faces(mesh, own.triangles());
    const double unit = npt::output_unit(transfer->transfer, own, false);
    auto made = std::make_unique<npt_motion>();
    made->skeleton = npt::motion_skeleton(own, character->name, static_cast<npt::JointNames>(called), unit);
    const std::vector<npt::MotionJoint>& joints = made->skeleton.motion.joints;
    made->order.resize(joints.size());  // as npt_open_skeleton has them
    for (std::size_t j = 0; j < joints.size(); ++j) made->order[joints[j].node] = j;
    made->character = std::make_shared<const c_api::MotionCharacter>(
        c_api::MotionCharacter{{}, {}, {}, {}, c_api::EstimatedCharacter{std::move(mesh), *own.skeleton(), unit}});
    *motion = c_api::given(std::move(made));
  });
}

void npt_release_motion(npt_motion* motion) { delete motion; }

npt_status npt_describe_motion(const npt_motion* motion, npt_motion_info* info) {
  return guarded([&] {
    expect(motion != nullptr && info != nullptr, "npt_describe_motion: a null pointer");
    expect(info->size == sizeof(npt_motion_info), "npt_motion_info: a size that isn't sizeof(npt_motion_info)");
    describe(*motion, *info);
  });
}

const char* npt_role_name(int role) {
  static const std::array<std::string, NPT_ROLES> names = [] {
    std::array<std::string, NPT_ROLES> made;
    for (std::size_t r = 0; r < made.size(); ++r) made[r] = npt::role_name(static_cast<npt::JointRole>(r));
    return made;
  }();
  return role >= 0 && role < NPT_ROLES ? names[static_cast<std::size_t>(role)].c_str() : nullptr;
}

npt_status npt_motion_roles(const npt_motion* motion, int32_t* joints, double* confidences) {
  return guarded([&] {
    expect(motion != nullptr, "npt_motion_roles: a null pointer");
    const npt::JointRoles& roles = motion->skeleton.roles;
    for (std::size_t r = 0; r < NPT_ROLES; ++r) {
      if (joints != nullptr) joints[r] = given_number(*motion, roles.joints[r]);
      if (confidences != nullptr) confidences[r] = roles.confidences[r];
    }
  });
}

npt_status npt_frame_times(const npt_motion* motion, double fps, size_t* count, double* times) {
  return guarded([&] {
    expect(motion != nullptr && count != nullptr, "npt_frame_times: a null pointer");
    expect(fps == 0 || (fps >= 0.001 && fps <= 1000), "npt_frame_times: fps that isn't between 0.001 and 1000");
    const npt::Motion& own = motion->skeleton.motion;
    if (own.clip.channels.empty())
      throw npt::Error(
          {.file = motion->skeleton.name, .found = "a skeleton without a clip", .expected = "curves that move joints"});
    const double rate = fps > 0 ? fps : npt::sampling_rate(own);
    if (own.clip.length() * rate > static_cast<double>(most_frames))
      throw npt::Error({.file = motion->skeleton.name,
                        .place = "clip " + npt::in_quotes(own.clip.name),
                        .found = std::to_string(own.clip.length()) + " s",
                        .expected = "at most 100000 frames"});
    const std::vector<double> all = npt::frame_times(own.clip, rate);
    *count = all.size();
    if (times != nullptr) std::ranges::copy(all, times);
  });
}

npt_status npt_sample_motion(const npt_motion* motion, const double* times, size_t count,
                             const npt_motion_frames* frames) {
  return guarded([&] {
    expect(motion != nullptr && frames != nullptr, "npt_sample_motion: a null pointer");
    expect(frames->size == sizeof(npt_motion_frames), "npt_motion_frames: a size that isn't sizeof(npt_motion_frames)");
    expect(times != nullptr || count == 1, "npt_sample_motion: no times, and a count that isn't 1");
    for (std::size_t f = 0; times != nullptr && f < count; ++f)
      expect(std::isfinite(times[f]), "npt_sample_motion: a time that is no number");
    for (std::size_t f = 0; f < count; ++f)
      write_frame(*motion, times != nullptr ? std::optional(times[f]) : std::nullopt, f, *frames);
  });
}
