#include "transfer_animation.hpp"

#include "arguments.hpp"
#include "interrupt.hpp"
#include "open_transfer.hpp"
#include "progress.hpp"
#include "stopwatch.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"

#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/pose.hpp>
#include <npt/skeleton/joint_names.hpp>
#include <npt/transfer/pose_sequence.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <utility>
#include <vector>

namespace program {

namespace {

namespace fs = std::filesystem;

bool is_gltf(const fs::path& path) { return extension_of(path) == ".glb" || extension_of(path) == ".gltf"; }

/// The skeleton of a mesh that goes through bodies, with the names that were asked for.
std::optional<npt::SkinnedSkeleton> named_skeleton(const PoseTransfer& transfer, const npt::PreparedIdentity& identity,
                                                   const std::string& names) {
  std::optional<npt::SkinnedSkeleton> skeleton = transfer.skeleton(identity);
  const npt::JointNames how = names == "mixamo" ? npt::JointNames::mixamo
                              : names == "smpl" ? npt::JointNames::smpl
                                                : npt::JointNames::vrm;
  for (std::size_t j = 0; skeleton && j < skeleton->joint_count(); ++j)
    skeleton->names[j] = std::string(npt::joint_name(j, how));
  return skeleton;
}

/// The poses of a sequence, one after another: a clip's at a rate, or a folder's meshes in the order of their names.
class PoseFrames {
 public:
  PoseFrames(const fs::path& pose, const AnimationArguments& animation) : name_(pose.string()) {
    const double rate = animation.fps.value_or(30);
    if (fs::is_directory(pose)) {
      if (animation.clip || animation.time)
        throw npt::Error({animation.clip ? "--clip" : "--time", {}, "a folder of poses", "a .glb for --pose"});
      clip_name_ = fs::path(resolved(pose)).filename().string();
      for (const TransferJob& job : folder_jobs({}, pose, {}, ".glb")) files_.push_back(job.pose);
      for (std::size_t i = 0; i < files_.size(); ++i) times_.push_back(static_cast<double>(i) / rate);
      return;
    }
    expect_extension(pose, gltf_extensions);
    scene_ = npt::read_scene(pose);
    poser_.emplace(scene_, name_);
    clip_ = &choose_clip(animation);
    clip_name_ = clip_->name;
    mesh_ = poser_->mesh();
    if (!animation.time) {
      // Counted before any of them is made: a clip may claim to be a year long.
      if (clip_->length() * rate > most_frames)
        throw npt::Error({name_, "clip '" + clip_name_ + "'", std::to_string(clip_->length()) + " s",
                          "at most " + std::to_string(most_frames) + " frames"});
      times_ = npt::frame_times(*clip_, rate);
    } else if (*animation.time > clip_->length() + 1e-3) {
      throw npt::Error({"--time",
                        {},
                        std::to_string(*animation.time) + " s",
                        "at most " + std::to_string(clip_->length()) + " s, the clip's length"});
    } else {
      times_ = {*animation.time};
    }
  }

  std::size_t size() const { return times_.size(); }
  const std::vector<double>& times() const { return times_; }
  const std::string& clip_name() const { return clip_name_; }
  /// The file that frame i comes from, for messages.
  std::string name(std::size_t i) const { return files_.empty() ? name_ : files_[i].string(); }

  const npt::Mesh& load(std::size_t i) {
    if (files_.empty()) {
      poser_->positions(clip_, times_[i], mesh_.coordinates());
      npt::recompute_normals(mesh_);
    } else {
      mesh_ = npt::read_mesh(files_[i]);
    }
    return mesh_;
  }

 private:
  static constexpr int most_frames = 100'000;
  static constexpr std::array<std::string_view, 2> gltf_extensions{".glb", ".gltf"};

  const npt::Clip& choose_clip(const AnimationArguments& animation) const {
    if (animation.clip) return npt::find_clip(scene_, *animation.clip, name_);
    if (scene_.clips.size() == 1) return scene_.clips.front();
    throw npt::Error(
        {name_,
         {},
         std::to_string(scene_.clips.size()) + " clips",
         scene_.clips.empty() ? "a clip to take poses from" : "--clip, one of " + npt::clip_names(scene_)});
  }

  std::string name_, clip_name_;
  std::vector<fs::path> files_;
  npt::Scene scene_;
  std::optional<npt::ScenePoser> poser_;
  const npt::Clip* clip_ = nullptr;
  std::vector<double> times_;
  npt::Mesh mesh_;
};

/// What the frames of a transferred sequence are: positions, and the joints' motions where all of them went through
/// bodies.
struct TransferredFrames {
  std::vector<std::vector<float>> positions;
  std::vector<std::vector<npt::Affine>> motions;
  std::optional<npt::SkinnedSkeleton> skeleton;
  npt::TransferReport worst;
};

class AnimationTransfer {
 public:
  AnimationTransfer(const AnimationJob& job, const TransferArguments& arguments)
      : job_(job), frames_(job.pose, job.animation), identity_(npt::read_mesh(job.identity)) {
    check();
    transfer_.emplace(open_transfer(arguments));
  }

  void run() {
    const Stopwatch watch;
    transfer_frames();
    write();
    if (job_.picture) draw();
    char time[32];
    std::snprintf(time, sizeof time, "%.2f s", watch.seconds());
    std::cout << job_.out.string() << ": " << frames_.size() << (frames_.size() == 1 ? " frame" : " frames") << " of "
              << frames_.clip_name() << how_ << " in " << time << " (" << way() << ")\n";
  }

 private:
  bool to_folder() const { return extension_of(job_.out).empty(); }

  /// Before long work.
  void check() {
    if (job_.picture) check_picture(*job_.picture, {{job_.identity, job_.pose, job_.out, {}}}, "frames");
    if (to_folder() && !job_.animation.time) {
      folder_.emplace(job_.out);
      return;
    }
    if (job_.format) throw npt::Error({"--format", {}, "one output file", "a folder for the frames"});
    static constexpr std::array<std::string_view, 1> moving{".glb"};
    if (job_.animation.time)
      expect_extension(job_.out, output_extensions);
    else
      expect_extension(job_.out, moving);
    check_output(job_.out, std::array{job_.identity, job_.pose});
  }

  void transfer_frames() {
    const std::vector<npt::Triangle> own = npt::triangulate(identity_);
    const std::string name = job_.identity.string();
    const npt::MeshView view{identity_.coordinates(), own, name};
    npt::PreparedIdentity prepared;
    npt::PreparedPose pose;
    npt::PoseSequence frames(*transfer_);
    catch_interrupts();
    Progress progress("frames", frames_.size());
    transfer_->prepare_identity(view, prepared);
    done_.skeleton = named_skeleton(*transfer_, prepared, job_.animation.names);
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      stop_if_interrupted();
      const npt::Mesh& mesh = frames_.load(i);
      const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
      const std::string pose_name = frames_.name(i);
      frames.prepare({mesh.coordinates(), triangles, pose_name}, identity_.vertex_count(), pose);
      std::vector<float>& result = done_.positions.emplace_back(3 * identity_.vertex_count());
      (*transfer_)(prepared, pose, result);
      const npt::TransferReport report = transfer_->report(prepared, pose);
      if (i == 0 || report.trust() < done_.worst.trust()) done_.worst = report, worst_name_ = pose_name;
      if (report.method != npt::Method::body) done_.skeleton.reset();
      if (done_.skeleton) done_.motions.push_back(transfer_->motions(prepared, pose));
      if (report.method == npt::Method::network && i == 0) unit_note_ = unit_note(*transfer_, view);
      progress.advance();
    }
    progress.clear();
    std::vector<std::string> notes = method_notes(done_.worst, name, worst_name_);
    if (!unit_note_.empty()) notes.push_back(unit_note_);
    for (const std::string& note : notes) std::cerr << "npt: note: " << note << '\n';
  }

  npt::Mesh frame(std::size_t i) const {
    npt::Mesh mesh = identity_;
    std::ranges::copy(done_.positions[i], mesh.coordinates().begin());
    npt::recompute_normals(mesh);
    npt::validate(mesh, "result for " + job_.identity.string());
    return mesh;
  }

  void write() {
    if (job_.animation.time) {
      npt::write_mesh(job_.out, frame(0));
    } else if (to_folder()) {
      const std::string extension = result_extension(job_.identity, job_.format);
      for (std::size_t i = 0; i < frames_.size(); ++i) {
        char name[32];
        std::snprintf(name, sizeof name, "frame_%04zu", i);
        npt::write_mesh(job_.out / (name + extension), frame(i));
      }
    } else {
      write_moving();
    }
  }

  void write_moving() {
    for (std::size_t i = 0; i < frames_.size(); ++i) frame(i);  // validates
    npt::MeshScene made = npt::scene_from(identity_, job_.identity.stem().string());
    if (done_.skeleton) {
      const std::size_t first = npt::add_skeleton(made, *done_.skeleton);
      npt::add_skeleton_clip(made, *done_.skeleton, first, frames_.clip_name(), frames_.times(), done_.motions);
      how_ = " on a skeleton of " + std::to_string(done_.skeleton->joint_count()) + " joints";
    } else {
      npt::add_morph_clip(made, identity_, frames_.clip_name(), frames_.times(), done_.positions);
      how_ = " as morph targets";
    }
    npt::write_scene(job_.out, made.scene);
  }

  /// Frames evenly over the sequence.
  void draw() {
    const std::size_t rows = std::min<std::size_t>(frames_.size(), 6);
    std::vector<npt::Mesh> meshes;
    for (std::size_t r = 0; r < rows; ++r) {
      const std::size_t i = rows == 1 ? 0 : r * (frames_.size() - 1) / (rows - 1);
      meshes.push_back(frames_.load(i));
      meshes.push_back(frame(i));
    }
    std::vector<std::vector<PictureCell>> cells;
    for (std::size_t r = 0; r < rows; ++r)
      cells.push_back(
          {{&identity_, "identity", "blue"}, {&meshes[2 * r], "pose", "sand"}, {&meshes[2 * r + 1], "result", "blue"}});
    draw_rows(*job_.picture, cells);
  }

  std::string way() const {
    if (done_.worst.method == npt::Method::network) return transfer_->description();
    return "through bodies, trust " + std::to_string(std::lround(100 * done_.worst.trust())) + " %";
  }

  const AnimationJob& job_;
  PoseFrames frames_;
  npt::Mesh identity_;
  std::optional<OutputFolder> folder_;
  std::optional<PoseTransfer> transfer_;
  TransferredFrames done_;
  std::string worst_name_, how_, unit_note_;
};

}  // namespace

bool is_animation(const AnimationArguments& animation, const fs::path& pose, const fs::path& out) {
  if (animation.clip || animation.fps || animation.time) return true;
  return fs::is_directory(pose) && is_gltf(out);
}

void animate(const AnimationJob& job, const TransferArguments& arguments) {
  // Links and pipes are left to the readers' own messages.
  for (const fs::path& input : {job.identity, job.pose})
    if (!fs::exists(input)) throw npt::Error({input.string(), {}, "no such file", "a mesh"});
  expect_extension(job.identity, mesh_extensions);
  AnimationTransfer(job, arguments).run();
}

void rig(const AnimationJob& job, const TransferArguments& arguments) {
  static constexpr std::array<std::string_view, 1> moving{".glb"};
  expect_extension(job.out, moving);
  check_output(job.out, std::array{job.identity});
  const Stopwatch watch;
  const npt::Mesh mesh = npt::read_mesh(job.identity);
  const PoseTransfer transfer = open_transfer(arguments);
  const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
  const std::string name = job.identity.string();
  const npt::PreparedIdentity prepared = transfer.prepare_identity({mesh.coordinates(), triangles, name});
  const auto skeleton = named_skeleton(transfer, prepared, job.animation.names);
  const long trust = std::lround(100 * prepared.body()->trust);
  if (!skeleton || prepared.body()->trust < npt::least_trust)
    throw npt::Error(
        {name, {}, "a mesh that doesn't read as a person (trust " + std::to_string(trust) + " %)", "a person"});
  npt::MeshScene made = npt::scene_from(mesh, job.identity.stem().string());
  npt::add_skeleton(made, *skeleton);
  npt::write_scene(job.out, made.scene);
  if (prepared.body()->trust < npt::sure_trust)
    std::cerr << "npt: note: " << name << " reads as a person with a trust of only " << trust
              << " %: look at the result before using it\n";
  char time[32];
  std::snprintf(time, sizeof time, "%.2f s", watch.seconds());
  std::cout << job.out.string() << ": " << skeleton->joint_count() << " joints in " << time << " (trust " << trust
            << " %)\n";
}

}  // namespace program
