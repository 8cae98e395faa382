#include "transfer_motion.hpp"

#include "arguments.hpp"
#include "open_transfer.hpp"
#include "remedies.hpp"
#include "report.hpp"
#include "stopwatch.hpp"
#include "transfer_picture.hpp"

#include <formats/motion.hpp>
#include <formats/read.hpp>
#include <render/colour.hpp>
#include <view/page.hpp>

#include <npt/body/joint_names.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/file.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/gltf_patch.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/scene/clip_of_motion.hpp>
#include <npt/scene/joined_nodes.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/animation.hpp>
#include <npt/transfer/motion/character_motion.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>
#include <npt/transfer/motion/motion_warning.hpp>
#include <npt/transfer/motion_transfer.hpp>
#include <npt/transfer/named_skeleton.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <span>
#include <string>
#include <utility>

namespace program {

namespace {

namespace fs = std::filesystem;

bool is_glb(const fs::path& file) { return extension_of(file) == ".glb" || extension_of(file) == ".vrm"; }

/// What the JSON of a glTF file holds; nothing where it isn't one.
std::optional<Report> gltf_json(const fs::path& file) {
  if (!is_glb(file) && extension_of(file) != ".gltf") return std::nullopt;
  try {
    const std::string bytes = npt::read_file(file);
    const std::string_view text =
        npt::internal::is_glb(bytes) ? npt::internal::read_glb(bytes, file.string()).json : std::string_view(bytes);
    Report json = Report::parse(text, nullptr, false);
    return json.is_object() ? std::optional(std::move(json)) : std::nullopt;
  } catch (const npt::Error&) {  // what it is, its reader says
    return std::nullopt;
  }
}
bool holds(const Report& json, const char* what) {
  const auto found = json.find(what);
  return found != json.end() && found->is_array() && !found->empty();
}

/// The clip that was asked for, or else all.
std::vector<const npt::Clip*> clips_of(const npt::Scene& scene, const std::optional<std::string>& name,
                                       const std::string& file) {
  if (name) return {&npt::find_clip(scene, *name, file)};
  std::vector<const npt::Clip*> clips;
  for (const npt::Clip& clip : scene.clips) clips.push_back(&clip);
  return clips;
}

npt::BoneMapText bone_map(const std::optional<fs::path>& file) {
  return file ? npt::BoneMapText{npt::read_file(*file), file->string()} : npt::BoneMapText{};
}

/// The bones as a mesh, to be drawn; of an animal those of its body alone, whose rigs have goals far from it.
npt::Mesh drawn_skeleton(const npt::Motion& motion, const npt::JointRoles& roles, std::optional<double> time) {
  const bool all = roles.kind() == npt::SkeletonKind::person;
  const auto of_body = [&](std::size_t joint) {
    while (joint != npt::no_item && roles.role_of(joint) == npt::JointRole::none) joint = motion.joints[joint].parent;
    return joint != npt::no_item;
  };
  npt::Mesh mesh;
  std::vector<npt::Triangle> triangles;
  const std::vector<npt::Vec3d> places = npt::joint_positions(motion, time);
  for (std::size_t j = 0; j < places.size(); ++j) {
    const std::size_t parent = motion.joints[j].parent;
    if (parent == npt::no_item || (all ? motion.joints[parent].parent == npt::no_item : !of_body(parent))) continue;
    const npt::Vec3d from = places[parent], bone = places[j] - from;
    const npt::Vec3d side =
        npt::normalised(cross(bone, std::abs(bone.y) > std::abs(bone.x) ? npt::Vec3d{1, 0, 0} : npt::Vec3d{0, 1, 0}));
    const npt::Vec3d other = npt::normalised(cross(bone, side));
    const double width = 0.12 * length(bone);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(from.as<float>());
    for (const npt::Vec3d& out : {side, other, side * -1.0, other * -1.0})
      mesh.positions.push_back((from + bone * 0.2 + out * width).as<float>());
    mesh.positions.push_back(places[j].as<float>());
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t a = first + 1 + i, b = first + 1 + (i + 1) % 4;
      triangles.push_back({first, b, a});
      triangles.push_back({first + 5, a, b});
    }
  }
  npt::set_faces(mesh, triangles);
  return mesh;
}

}  // namespace

/// The character: its file with joints of its own, or a mesh with those of its body.
class MotionCharacter {
 public:
  /// lost: what of the file isn't in the scene
  MotionCharacter(npt::Scene scene, npt::MotionSkeleton skeleton, std::vector<std::string> lost)
      : scene_(std::move(scene)), skeleton_(std::move(skeleton)), lost_(std::move(lost)) {
    if (!scene_->shown.empty()) mesh_ = npt::ScenePoser(*scene_, skeleton_.name).mesh();
  }
  /// metres: in a unit of the mesh, where a result is in metres
  MotionCharacter(npt::Mesh mesh, const npt::Character& character, const fs::path& file, npt::JointNames names,
                  double metres)
      : skeleton_(npt::motion_skeleton(character, file.string(), names)),
        skin_(npt::named_skeleton(character, names)),
        mesh_(std::move(mesh)),
        confidence_(character.confidence().value_or(0)),
        metres_(metres) {}

  bool has_own_joints() const { return scene_.has_value(); }
  const npt::Scene& scene() const { return *scene_; }
  const npt::MotionSkeleton& skeleton() const { return skeleton_; }
  const npt::SkinnedSkeleton& skin() const { return *skin_; }
  const npt::Mesh& mesh() const { return mesh_; }
  const std::vector<std::string>& lost() const { return lost_; }
  double confidence() const { return confidence_; }
  double metres() const { return metres_; }
  std::size_t joint_count() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(skeleton_.motion.joints, [](const npt::MotionJoint& joint) { return !joint.end; }));
  }

  /// The mesh at a time; the bones, where there is none.
  npt::Mesh moved(const npt::Motion& motion, double time) const {
    if (mesh_.vertex_count() == 0) return drawn_skeleton(motion, skeleton_.roles, time);
    npt::Mesh mesh = mesh_;
    if (scene_)
      move_scene(motion, time, mesh);
    else
      move_skin(motion, time, mesh);
    npt::recompute_normals(mesh);
    return mesh;
  }

 private:
  void move_scene(const npt::Motion& motion, double time, npt::Mesh& mesh) const {
    npt::Scene scene = *scene_;
    scene.clips.clear();
    npt::add_clip(scene, motion, {});
    npt::ScenePoser(scene, skeleton_.name).positions(&scene.clips.back(), time, mesh.coordinates());
  }
  void move_skin(const npt::Motion& motion, double time, npt::Mesh& mesh) const {
    const std::vector<npt::Affine> worlds = npt::joint_worlds(motion, time);
    std::vector<npt::Affine> moves(worlds.size());
    for (std::size_t j = 0; j < worlds.size(); ++j) {
      const std::size_t own = motion.joints[j].node;
      moves[own] = worlds[j] * npt::inverse(skin_->bind(own));
    }
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      const npt::Vec3d point = mesh_.positions[v].as<double>();
      npt::Vec3d sum;
      for (std::size_t k = skin_->start[v]; k < skin_->start[v + 1]; ++k)
        sum += moves[skin_->influences[k].joint](point) * static_cast<double>(skin_->influences[k].weight);
      mesh.positions[v] = sum.as<float>();
    }
  }

  std::optional<npt::Scene> scene_;
  npt::MotionSkeleton skeleton_;
  std::optional<npt::SkinnedSkeleton> skin_;
  npt::Mesh mesh_;
  std::vector<std::string> lost_;
  double confidence_ = 1, metres_ = 1;
};

namespace {

class MotionTransfer {
 public:
  MotionTransfer(const TransferJob& job, const Animations& all, const TransferArguments& arguments, LastCharacter& last)
      : job_(job), all_(all), options_(all.animation), arguments_(arguments), last_(last) {}

  /// Reads both files as far as is needed to tell. `alone`: there is no other way than by joints.
  bool applies() {
    if (fs::is_directory(job_.pose)) return false;
    const bool asked = options_.skeleton == "own" || extension_of(job_.out) == ".bvh";
    const bool alone = (asked && formats::is_scene(job_.pose)) || is_motion(job_.pose) || options_.across;
    const bool asks_for_mesh = options_.skeleton == "npt" || arguments_.method != "auto" || arguments_.refine;
    if (!alone && (asks_for_mesh || !formats::is_scene(job_.pose) || !formats::is_scene(job_.identity))) return false;
    if (last_.character != nullptr && last_.file == job_.identity)
      character_ = last_.character, notes_ = last_.notes;
    else
      read_character(alone);
    if (!alone && (character_ == nullptr || !character_->has_own_joints() || !is_certain(character_->skeleton())))
      return false;
    return read_clips(alone);
  }

  JobOutcome run(const std::function<const PoseTransfer&()>& transfer, view::Page* page) {
    const Stopwatch watch;
    check();
    if (character_ == nullptr) character_ = estimated(transfer(), job_.identity);
    if (clips_.empty()) {  // the pose that the mesh stands in
      clips_.push_back(estimated(transfer(), job_.pose)->skeleton());
      clips_.back().motion.clip.name = job_.pose.stem().string();
    }
    last_ = {job_.identity, character_, notes_};
    confidence_ = character_->confidence();
    for (const npt::MotionSkeleton& clip : clips_) take(clip);
    if (results_.empty())
      throw npt::Error({job_.pose.string(), {}, "clips of 0 s alone", "a clip that lasts, or --time 0 for a pose"});
    write();
    for (const std::string& note : notes_) std::cerr << "npt: note: " << note << '\n';
    JobOutcome outcome = say(watch.seconds());
    if (all_.picture) draw();
    if (page != nullptr) show(*page);
    return outcome;
  }

 private:
  // Clips with a mesh have another way, which knows nothing of joints: theirs must be certain.
  static bool is_certain(const npt::MotionSkeleton& skeleton) { return skeleton.roles.confidence >= 0.6; }

  /// With joints of its own, where they are known and wanted.
  void read_character(bool needed) {
    const bool own = options_.skeleton == "own";
    if (!formats::is_scene(job_.identity) || options_.skeleton == "npt") {
      if (own)
        throw npt::Error(
            {job_.identity.string(), {}, "a mesh without joints", "a rigged character, for --skeleton own"});
      return;
    }
    try {
      std::vector<std::string> lost;
      const bool foreign = std::ranges::find(formats::foreign, extension_of(job_.identity)) != formats::foreign.end();
      npt::Scene scene = foreign ? npt::with_joined_nodes(formats::read_foreign(job_.identity, &lost))
                                 : formats::read_scene(job_.identity);
      if (!own && scene.skins.empty() && !npt::has_skeleton(scene) && !scene.shown.empty()) return;
      npt::MotionSkeleton skeleton = npt::motion_skeleton(scene, job_.identity.string(), bone_map(options_.bone_map));
      character_ = std::make_shared<const MotionCharacter>(std::move(scene), std::move(skeleton), std::move(lost));
    } catch (const npt::Error& error) {
      if (own || options_.bone_map || !needed || error.code() != npt::ErrorCode::not_recognised) {
        if (needed || own || options_.bone_map) throw;
        return;
      }
      notes_.push_back(std::string(error.what()) + ": the clip goes onto the skeleton that npt gives the mesh");
    }
  }

  /// Whether a file has a skeleton that moves; else its mesh has a pose.
  static bool moves(const fs::path& file) {
    if (!formats::is_scene(file)) return formats::is_bvh(file);
    const npt::Scene scene = formats::read_scene(file);
    return npt::has_skeleton(scene) && !scene.clips.empty();
  }

  bool read_clips(bool alone) {
    const std::string name = job_.pose.string();
    if (options_.across && !moves(job_.pose)) {
      time_ = 0;
      return true;
    }
    const npt::BoneMapText map = bone_map(options_.source_bone_map);
    if (formats::is_bvh(job_.pose)) {
      if (options_.clip)
        throw npt::Error({"--clip", {}, "a file with one clip", "a .glb or .fbx for the clip, or no --clip"});
      clips_.push_back(npt::motion_skeleton(formats::read_bvh_motion(job_.pose), name, map));
      return true;
    }
    const npt::Scene scene = formats::read_scene(job_.pose);
    if (!alone && !options_.clip && scene.clips.size() != 1) return false;
    const std::vector<const npt::Clip*> clips = clips_of(scene, options_.clip, name);
    if (clips.empty()) npt::expect_clip(npt::motion_of(scene, nullptr, name), name);
    try {
      for (const npt::Clip* clip : clips)
        clips_.push_back(
            npt::motion_skeleton(npt::motion_of(scene, clip, name), name, map, scene.shown.empty() ? nullptr : &scene));
    } catch (const npt::Error&) {
      if (alone || options_.source_bone_map) throw;
      return false;
    }
    return alone || std::ranges::all_of(clips_, is_certain);
  }

  /// Before long work.
  void check() {
    const std::string extension = extension_of(job_.out);
    static constexpr std::array<std::string_view, 3> moving{".glb", ".vrm", ".bvh"};
    static constexpr std::array<std::string_view, 5> posed{".glb", ".vrm", ".bvh", ".ply", ".obj"};
    if (options_.apply && !time_)
      throw npt::Error({"--apply", {}, "a clip", "--time SECONDS: the pose that becomes the rest"});
    if (extension.empty() && !time_) {
      folder_.emplace(job_.out);
      return;
    }
    expect_extension(job_.out, time_ ? std::span<const std::string_view>(posed) : moving);
    check_output(job_.out, std::array{job_.identity, job_.pose});
    const bool one = extension == ".bvh" || options_.bake || !extension.empty();
    if (clips_.size() > 1 && one && (extension == ".bvh" || options_.bake || time_)) say_which_clip();
  }
  [[noreturn]] void say_which_clip() const {
    throw npt::Error({job_.pose.string(),
                      {},
                      std::to_string(clips_.size()) + " clips",
                      "the name of one of them, by --clip: npt info lists them"});
  }

  std::shared_ptr<const MotionCharacter> estimated(const PoseTransfer& transfer, const fs::path& file) {
    if (arguments_.method == "network")
      throw npt::Error({"--method", {}, "network for a clip without a mesh", "body or auto: the clip moves joints"});
    const npt::Mesh mesh = formats::read_mesh(file);
    const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
    const std::string name = file.string();
    const npt::MeshView view{mesh.coordinates(), triangles, name};
    const npt::Character character = transfer.character(view);
    character.expect_recognised();
    for (std::string& note : notes_of(character.warnings(), name, name)) notes_.push_back(std::move(note));
    std::string note;
    const double metres = metres_in(transfer, character, file, job_.out, note);
    if (!note.empty()) notes_.push_back(note);
    return std::make_shared<const MotionCharacter>(mesh, character, file, joint_names(options_.names), metres);
  }

  void take(const npt::MotionSkeleton& clip) {
    npt::MotionOptions options;
    options.clip_name = clips_.size() == 1 ? options_.clip_name.value_or("") : "";
    options.time = time_;
    options.across = options_.across;
    options.rate = options_.fps;
    options.retarget = options_.retarget();
    if (clips_.size() > 1 && !time_ && !(clip.motion.clip.length() > 0)) {
      notes_.push_back(clip.name + ": clip '" + clip.motion.clip.name + "' lasts 0 s and is left out");
      return;
    }
    npt::MotionResult result = npt::transfer_motion(clip, character_->skeleton(), options);
    confidence_ = std::min(confidence_, result.confidence);
    for (const npt::MotionWarning& warning : result.warnings) {
      std::string note = npt::text_of(warning, job_.identity.string(), job_.pose.string());
      if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(std::move(note));
    }
    sources_.push_back(&clip);
    results_.push_back(std::move(result.motion));
  }

  double rate() const { return options_.fps ? *options_.fps : npt::sampling_rate(results_.front()); }
  std::vector<double> times() const { return npt::frame_times(results_.front().clip, rate()); }
  double in_output() const { return folder_ || extension_of(job_.out) != ".glb" ? 1 : character_->metres(); }

  void write() {
    const std::string extension = extension_of(job_.out);
    if (extension == ".bvh") return npt::write_bvh(job_.out, npt::bvh_of(results_.front(), rate()));
    if (folder_) return write_frames();
    const bool as_mesh = extension == ".ply" || extension == ".obj";
    if (as_mesh || (time_ && (options_.bake || !character_->has_own_joints())))
      return npt::write_mesh(job_.out, npt::scaled(character_->moved(results_.front(), 0), in_output()));
    if (options_.bake) return write_baked();
    if (character_->has_own_joints()) return write_own_rig();
    npt::write_scene(job_.out, npt::scene_with_motions(character_->mesh(), job_.identity.stem().string(),
                                                       character_->skin(), results_, character_->metres()));
  }

  void write_frames() {
    if (clips_.size() > 1) say_which_clip();
    const std::vector<double> all = times();
    for (std::size_t i = 0; i < all.size(); ++i) {
      char name[32];
      std::snprintf(name, sizeof name, "frame_%04zu", i);
      npt::write_mesh(job_.out / (name + result_extension(job_.identity, all_.format)),
                      character_->moved(results_.front(), all[i]));
    }
  }

  /// A morph target for each frame.
  void write_baked() {
    npt::Animation animation;
    const std::vector<double> all = times();
    for (const double time : all) {
      const npt::Mesh mesh = character_->moved(results_.front(), time);
      animation.positions.emplace_back(mesh.coordinates().begin(), mesh.coordinates().end());
    }
    npt::write_scene(job_.out, npt::animation_scene(character_->mesh(), job_.identity.stem().string(), animation,
                                                    results_.front().clip.name, all, character_->metres()));
  }

  /// The character's file with the clips, or with the pose as its rest.
  void write_own_rig() {
    const std::string extension = extension_of(job_.identity);
    if (std::ranges::find(formats::foreign, extension) != formats::foreign.end()) return write_foreign_rig();
    fs::path from = job_.identity;
    for (const npt::Motion& motion : results_) {
      npt::write_with_motion(from, motion, {.name = {}, .apply = options_.apply, .time = 0}, job_.out, &notes_);
      from = job_.out;
    }
  }
  /// As a GLB: npt writes no such files.
  void write_foreign_rig() {
    npt::Scene scene = character_->scene();
    for (const npt::Motion& motion : results_)
      if (options_.apply)
        npt::set_rest(scene, motion, 0);
      else
        npt::add_clip(scene, motion, {});
    npt::write_scene(job_.out, scene);
    std::string without;
    for (const std::string& lost : character_->lost()) without += (without.empty() ? "" : "; ") + lost;
    if (!without.empty()) notes_.push_back(job_.out.string() + " has not what a GLB of this file lacks: " + without);
  }

  /// Frames evenly over the first clip.
  void draw() const {
    const std::vector<double> all = times();
    const std::size_t rows = std::min<std::size_t>(all.size(), 6);
    std::vector<npt::Mesh> meshes;
    for (std::size_t r = 0; r < rows; ++r) {
      const double time = all[rows == 1 ? 0 : r * (all.size() - 1) / (rows - 1)];
      meshes.push_back(drawn_skeleton(sources_.front()->motion, sources_.front()->roles, time_.value_or(time)));
      meshes.push_back(character_->moved(results_.front(), time));
    }
    const npt::Mesh still = character_->mesh().vertex_count() > 0
                                ? character_->mesh()
                                : drawn_skeleton(results_.front(), character_->skeleton().roles, std::nullopt);
    std::vector<std::vector<PictureCell>> cells;
    for (std::size_t r = 0; r < rows; ++r)
      cells.push_back(
          {{&still, "identity", "blue"}, {&meshes[2 * r], "clip", "sand"}, {&meshes[2 * r + 1], "result", "blue"}});
    draw_rows(*all_.picture, cells);
  }

  void show(view::Page& page) const {
    view::Group& group = page.groups.emplace_back(view::Group{job_.out.filename().string(), {}});
    const npt::Motion& source = sources_.front()->motion;
    const npt::JointRoles& roles = sources_.front()->roles;
    const std::vector<double> all = times();
    view::Panel clip = view::mesh_panel("clip", drawn_skeleton(source, roles, all.front()));
    clip.colour = render::parse_colour("sand", "--view");
    for (std::size_t i = 1; i < all.size(); ++i)
      view::add_frame(clip, drawn_skeleton(source, roles, all[i]), job_.pose.string());
    group.panels.push_back(std::move(clip));
    if (extension_of(job_.out) == ".glb" && character_->mesh().vertex_count() > 0) {
      view::Panel result;
      result.caption = "result", result.detail = job_.out.filename().string();
      result.glb = npt::read_file(job_.out);
      group.panels.push_back(std::move(result));
      return;
    }
    view::Panel result = view::mesh_panel("result", character_->moved(results_.front(), all.front()));
    result.colour = render::parse_colour("blue", "--view");
    for (std::size_t i = 1; i < all.size(); ++i)
      view::add_frame(result, character_->moved(results_.front(), all[i]), job_.out.string());
    group.panels.push_back(std::move(result));
  }

  JobOutcome say(double seconds) const {
    JobOutcome outcome;
    outcome.status = JobOutcome::Status::done;
    outcome.method = "joints";
    outcome.confidence = confidence_;
    outcome.seconds = seconds;
    outcome.notes = notes_;
    for (const npt::Motion& motion : results_) outcome.frames += npt::frame_times(motion.clip, rate()).size();
    char time[32];
    std::snprintf(time, sizeof time, "%.2f s", seconds);
    const std::string what =
        results_.size() == 1 ? results_.front().clip.name : std::to_string(results_.size()) + " clips";
    std::cout << job_.out.string() << ": " << outcome.frames << (outcome.frames == 1 ? " frame" : " frames") << " of "
              << what << " on " << (character_->has_own_joints() ? "its own " : "a skeleton of ")
              << character_->joint_count() << " joints in " << time << " (confidence " << npt::percent_text(confidence_)
              << ")\n";
    return outcome;
  }

  const TransferJob& job_;
  const Animations& all_;
  const AnimationArguments& options_;
  const TransferArguments& arguments_;
  LastCharacter& last_;
  std::shared_ptr<const MotionCharacter> character_;
  std::vector<npt::MotionSkeleton> clips_;
  std::vector<const npt::MotionSkeleton*> sources_;  ///< of each result
  std::vector<npt::Motion> results_;
  std::optional<double> time_ = options_.time;
  std::optional<OutputFolder> folder_;
  std::vector<std::string> notes_;
  double confidence_ = 1;
};

}  // namespace

bool is_motion(const fs::path& file) {
  if (formats::is_bvh(file)) return true;
  if (!formats::is_scene(file) || !fs::is_regular_file(file)) return false;
  if (const std::optional<Report> json = gltf_json(file))
    return !holds(*json, "meshes") && (holds(*json, "animations") || holds(*json, "skins"));
  if (is_glb(file) || extension_of(file) == ".gltf") return false;
  try {
    const npt::Scene scene = formats::read_scene(file);
    return scene.shown.empty() && npt::has_skeleton(scene);
  } catch (const npt::Error&) {
    return false;
  }
}

std::vector<fs::path> motions_in(const fs::path& folder) {
  std::vector<fs::path> files;
  bool bvh = false;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    bvh = bvh || formats::is_bvh(entry.path());
    if (formats::is_bvh(entry.path()) || formats::is_scene(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  if (files.empty() || (!bvh && !is_motion(files.front()))) return {};
  return files;
}

std::optional<JobOutcome> transfer_motions(const TransferJob& job, const Animations& all,
                                           const TransferArguments& arguments,
                                           const std::function<const PoseTransfer&()>& transfer, LastCharacter& last,
                                           view::Page* page) {
  MotionTransfer own(job, all, arguments, last);
  if (!own.applies()) return std::nullopt;
  return own.run(transfer, page);
}

}  // namespace program
