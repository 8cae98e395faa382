#include "transfer_animation.hpp"

#include "arguments.hpp"
#include "interrupt.hpp"
#include "open_transfer.hpp"
#include "progress.hpp"
#include "sequence_start.hpp"
#include "stopwatch.hpp"
#include "transfer_batch.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"
#include "transfer_view.hpp"

#include <formats/read.hpp>
#include <render/colour.hpp>
#include <view/page.hpp>

#include <npt/body/joint_names.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/pose_sequence.hpp>
#include <npt/transfer/root_way.hpp>
#include <npt/transfer/unit.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <span>
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
      files_ = meshes_in(pose);
      for (std::size_t i = 0; i < files_.size(); ++i) times_.push_back(static_cast<double>(i) / rate);
      return;
    }
    expect_extension(pose, formats::scenes);
    scene_ = formats::read_scene(pose);
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
      mesh_ = formats::read_mesh(files_[i]);
    }
    return mesh_;
  }

  /// Meshes in which the figure may read better than in the first frame: a rig at rest, and other frames.
  std::size_t other_count() const { return (poser_ ? 1 : 0) + frames_to_try(size()); }
  const npt::Mesh& load_other(std::size_t i) {
    if (poser_ && i == 0) return mesh_ = poser_->mesh();
    return load(frame_to_try(poser_ ? i : i + 1, size()));
  }

 private:
  static constexpr int most_frames = 100'000;

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
  AnimationTransfer(const TransferJob& job, const Animations& all)
      : job_(job), all_(all), frames_(job.pose, all.animation), identity_(formats::read_mesh(job.identity)) {
    check();
  }

  /// Whether a run before left all that this one would write.
  bool is_done() const {
    if (!to_folder() || all_.animation.time) return is_there(job_);
    for (std::size_t i = 0; i < frames_.size(); ++i)
      if (!is_there({{}, {}, frame_file(i), {}})) return false;
    return true;
  }

  JobOutcome run(const PoseTransfer& transfer, view::Page* page) {
    const Stopwatch watch;
    const std::vector<std::string> notes = transfer_frames(transfer);
    for (const std::string& note : notes) std::cerr << "npt: note: " << note << '\n';
    write();
    if (all_.picture) draw();
    if (page != nullptr) show(*page);
    const bool by_body = done_.worst.method != npt::Method::network;
    const double seconds = watch.seconds();
    char time[32];
    std::snprintf(time, sizeof time, "%.2f s", seconds);
    std::cout << job_.out.string() << ": " << frames_.size() << (frames_.size() == 1 ? " frame" : " frames") << " of "
              << frames_.clip_name() << how_ << " in " << time << " ("
              << (by_body ? "through bodies, confidence " +
                                std::to_string(std::lround(100 * done_.worst.confidence())) + " %"
                          : transfer.description())
              << ")\n";
    JobOutcome outcome;
    outcome.status = JobOutcome::Status::done;
    outcome.read = done_.worst.read;
    outcome.method = by_body ? "body" : "network";
    outcome.confidence = done_.worst.confidence();
    outcome.seconds = seconds;
    outcome.notes = notes;
    outcome.frames = frames_.size();
    return outcome;
  }

 private:
  bool to_folder() const { return extension_of(job_.out).empty(); }
  fs::path frame_file(std::size_t i) const {
    char name[32];
    std::snprintf(name, sizeof name, "frame_%04zu", i);
    return job_.out / (name + result_extension(job_.identity, all_.format));
  }

  /// Before long work.
  void check() {
    if (to_folder() && !all_.animation.time) {
      folder_.emplace(job_.out);
      return;
    }
    if (all_.format && all_.jobs.size() == 1)
      throw npt::Error({"--format", {}, "one output file", "a folder for the frames"});
    static constexpr std::array<std::string_view, 1> moving{".glb"};
    if (all_.animation.time)
      expect_extension(job_.out, output_extensions);
    else
      expect_extension(job_.out, moving);
    check_output(job_.out, std::array{job_.identity, job_.pose});
  }

  std::vector<std::string> transfer_frames(const PoseTransfer& transfer) {
    const std::vector<npt::Triangle> own = npt::triangulate(identity_);
    const std::string name = job_.identity.string();
    const npt::MeshView view{identity_.coordinates(), own, name};
    std::vector<npt::JointPose> poses;
    std::string worst_name, of_unit;
    npt::PreparedIdentity prepared;
    npt::PreparedPose pose;
    npt::PoseSequence frames(transfer);
    catch_interrupts();
    {
      Progress progress("frames", frames_.size());
      transfer.prepare_identity(view, prepared);
      done_.skeleton = named_skeleton(transfer, prepared, all_.animation.names);
      for (std::size_t i = 0; i < frames_.size(); ++i) {
        stop_if_interrupted();
        const npt::Mesh& mesh = frames_.load(i);
        const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
        const std::string pose_name = frames_.name(i);
        frames.prepare({mesh.coordinates(), triangles, pose_name}, identity_.vertex_count(), pose);
        if (i == 0)
          start_where_it_reads(transfer, frames, npt::Mesh(mesh), identity_.vertex_count(), pose, frames_.other_count(),
                               [this](std::size_t k) -> npt::Mesh { return frames_.load_other(k); });
        std::vector<float>& result = done_.positions.emplace_back(3 * identity_.vertex_count());
        const npt::TransferReport report = transfer.report(prepared, pose);
        try {
          transfer(prepared, pose, result);
        } catch (const npt::Error& error) {
          throw with_confidence(error, report, name, pose_name);
        }
        if (i == 0 || report.confidence() < done_.worst.confidence()) done_.worst = report, worst_name = pose_name;
        if (report.method != npt::Method::body) done_.skeleton.reset();
        if (done_.skeleton) done_.motions.push_back(transfer.motions(prepared, pose));
        if (report.method == npt::Method::body) poses.push_back(transfer.joints(pose));
        if (report.method == npt::Method::network && i == 0) of_unit = unit_note(transfer, view);
        progress.advance();
      }
    }
    if (!all_.animation.time && !all_.animation.in_place && poses.size() == frames_.size())
      follow_root(transfer.joints(prepared).leg, poses);
    std::vector<std::string> notes = method_notes(done_.worst, name, worst_name);
    if (!of_unit.empty()) notes.push_back(of_unit);
    std::string in_metres;
    metres_ = metres_in(transfer, view, job_.identity, to_folder() ? frame_file(0) : job_.out, in_metres);
    if (!in_metres.empty()) notes.push_back(in_metres);
    return notes;
  }

  /// Takes the frames, which all have their root joint in one place, along the pose's way, from where the identity is.
  void follow_root(double leg, const std::vector<npt::JointPose>& poses) {
    std::vector<double> lowest_of;
    for (const std::vector<float>& xyz : done_.positions) lowest_of.push_back(npt::bounding_box(xyz).low.y);
    const std::vector<npt::Vec3d> way =
        npt::root_way(leg, poses, lowest_of, npt::bounding_box(identity_.coordinates()).low.y);
    for (std::size_t i = 0; i < way.size(); ++i) {
      npt::move_points(done_.positions[i], way[i]);
      if (done_.skeleton)
        for (npt::Affine& motion : done_.motions[i]) motion.shift += way[i];
    }
  }

  npt::Mesh frame(std::size_t i) const {
    npt::Mesh mesh = identity_;
    std::ranges::copy(done_.positions[i], mesh.coordinates().begin());
    npt::recompute_normals(mesh);
    npt::validate(mesh, "result for " + job_.identity.string());
    return mesh;
  }

  void write() {
    if (all_.animation.time) {
      npt::write_mesh(job_.out, scaled(frame(0), metres_));
    } else if (to_folder()) {
      for (std::size_t i = 0; i < frames_.size(); ++i) npt::write_mesh(frame_file(i), scaled(frame(i), metres_));
    } else {
      write_moving();
    }
  }

  void write_moving() {
    for (std::size_t i = 0; i < frames_.size(); ++i) frame(i);  // validates
    const npt::Mesh identity = scaled(identity_, metres_);
    npt::MeshScene made = npt::scene_from(identity, job_.identity.stem().string());
    if (done_.skeleton) {
      npt::SkinnedSkeleton skeleton = *done_.skeleton;
      for (npt::Vec3d& joint : skeleton.joints) joint = joint * metres_;
      std::vector<std::vector<npt::Affine>> motions = done_.motions;
      for (auto& of_frame : motions)
        for (npt::Affine& motion : of_frame) motion.shift = motion.shift * metres_;
      const std::size_t first = npt::add_skeleton(made, skeleton);
      npt::add_skeleton_clip(made, skeleton, first, frames_.clip_name(), frames_.times(), motions);
      how_ = " on a skeleton of " + std::to_string(skeleton.joint_count()) + " joints";
    } else {
      std::vector<std::vector<float>> positions = done_.positions;
      if (metres_ != 1)
        for (std::vector<float>& xyz : positions)
          for (float& x : xyz) x = static_cast<float>(static_cast<double>(x) * metres_);
      npt::add_morph_clip(made, identity, frames_.clip_name(), frames_.times(), positions);
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
    draw_rows(*all_.picture, cells);
  }

  /// A group of the page: the result as a GLB where it is one, with its materials. A pose in quite another unit is
  /// shown in the identity's size.
  void show(view::Page& page) {
    view::Group& group = page.groups.emplace_back(view::Group{job_.out.filename().string(), {}});
    group.panels.push_back(view::mesh_panel("identity", scaled(identity_, metres_)));
    group.panels.back().colour = render::parse_colour("blue", "--view");
    const double ratio =
        metres_ * npt::extent_of(identity_.coordinates()) / npt::extent_of(frames_.load(0).coordinates());
    const double size = ratio > 1.5 || ratio < 1 / 1.5 ? ratio : 1;
    view::Panel pose = view::mesh_panel("pose", scaled(frames_.load(0), size));
    pose.colour = render::parse_colour("sand", "--view");
    for (std::size_t i = 1; i < frames_.size(); ++i)
      view::add_frame(pose, scaled(frames_.load(i), size), frames_.name(i));
    group.panels.push_back(std::move(pose));
    if (extension_of(job_.out) == ".glb") {
      view::Panel result;
      result.caption = "result", result.detail = job_.out.filename().string();
      result.glb = npt::read_file(job_.out);
      group.panels.push_back(std::move(result));
      if (identity_.appearance != nullptr)
        group.panels.front().glb = npt::glb_bytes(npt::scene_from(identity_).scene, job_.identity.string());
    } else {
      view::Panel result = view::mesh_panel("result", frame(0));
      result.colour = render::parse_colour("blue", "--view");
      for (std::size_t i = 1; i < frames_.size(); ++i) view::add_frame(result, frame(i), job_.out.string());
      group.panels.push_back(std::move(result));
    }
  }

  const TransferJob& job_;
  const Animations& all_;
  PoseFrames frames_;
  npt::Mesh identity_;
  double metres_ = 1;  ///< in a unit of the identity, where the result is in metres
  std::optional<OutputFolder> folder_;
  TransferredFrames done_;
  std::string how_;
};

}  // namespace

bool is_animation(const AnimationArguments& animation, const fs::path& pose, const fs::path& out) {
  if (animation.clip || animation.fps || animation.time || animation.in_place) return true;
  return fs::is_directory(pose) && is_gltf(out);
}

void animate(const Animations& all, const TransferArguments& arguments) {
  using Status = JobOutcome::Status;
  std::vector<fs::path> files;
  for (const TransferJob& job : all.jobs) files.insert(files.end(), {job.identity, job.pose, job.out});
  check_outputs_apart(all.jobs);
  if (all.picture && all.jobs.size() != 1)
    throw npt::Error({"--render", {}, std::to_string(all.jobs.size()) + " sequences", "one, or --view"});
  if (all.picture) check_picture(*all.picture, all.jobs, "frames");
  if (all.page) check_page(*all.page, all.jobs, "sequences");
  if (all.report) check_output(*all.report, files);
  std::vector<JobOutcome> outcomes(all.jobs.size());
  std::optional<PoseTransfer> transfer;
  view::Page page;
  page.fps = all.animation.fps.value_or(30);
  JobOutcome there;
  there.status = Status::skipped;
  const auto one = [&](const TransferJob& job) {
    // Links and pipes are left to the readers' own messages.
    for (const fs::path& input : {job.identity, job.pose})
      if (!fs::exists(input)) throw npt::Error({input.string(), {}, "no such file", "a mesh"});
    expect_extension(job.identity, mesh_extensions);
    if (all.skip_existing && is_there(job)) return there;
    AnimationTransfer own(job, all);
    if (all.skip_existing && own.is_done()) return there;
    if (!transfer) transfer.emplace(open_transfer(arguments));
    return own.run(*transfer, all.page ? &page : nullptr);
  };
  const auto write_report = [&] {
    if (!all.report) return;
    std::string text;
    for (std::size_t i = 0; i < all.jobs.size(); ++i)
      if (outcomes[i].status != Status::none) text += report_line(all.jobs[i], outcomes[i]);
    npt::write_file(*all.report, text);
  };
  std::size_t failed = 0, skipped = 0;
  for (std::size_t i = 0; i < all.jobs.size(); ++i) {
    try {
      outcomes[i] = one(all.jobs[i]);
      skipped += outcomes[i].status == Status::skipped ? 1U : 0U;
    } catch (const npt::Error& error) {
      const std::string& place = all.jobs[i].place;
      outcomes[i].status = Status::failed;
      outcomes[i].error = (place.empty() ? "" : place + ": ") + error.what();
      ++failed;
      if (!all.keep_going) {
        write_report();
        throw npt::Error({outcomes[i].error, {}, {}, {}});
      }
      std::cerr << "npt: error: " << outcomes[i].error << '\n';
    }
  }
  write_report();
  if (!page.groups.empty()) {
    page.title = all.jobs.size() == 1 ? all.jobs.front().out.filename().string()
                                      : std::to_string(page.groups.size()) + " sequences";
    view::write_page(*all.page, page);
  }
  if (skipped > 0)
    std::cout << (skipped == all.jobs.size() ? "nothing to do: " : "") << skipped << (skipped == 1 ? " was" : " were")
              << " there\n";
  if (all.jobs.size() > 1) print_failures(std::cerr, all.jobs, outcomes);
  if (failed > 0)
    throw npt::Error(
        {std::to_string(failed) + " of " + std::to_string(all.jobs.size()) + " sequences failed", {}, {}, {}});
}

void rig(const fs::path& file, const fs::path& out, const AnimationArguments& animation,
         const TransferArguments& arguments) {
  static constexpr std::array<std::string_view, 1> moving{".glb"};
  expect_extension(out, moving);
  check_output(out, std::array{file});
  const Stopwatch watch;
  const npt::Mesh mesh = formats::read_mesh(file);
  const PoseTransfer transfer = open_transfer(arguments);
  const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
  const std::string name = file.string();
  const npt::MeshView view{mesh.coordinates(), triangles, name};
  const npt::PreparedIdentity prepared = transfer.prepare_identity(view);
  auto skeleton = named_skeleton(transfer, prepared, animation.names);
  const long confidence = std::lround(100 * prepared.body()->confidence);
  if (!skeleton || prepared.body()->confidence < npt::least_confidence)
    throw npt::Error({name,
                      {},
                      "a mesh that doesn't read as a person (confidence " + std::to_string(confidence) + " %)",
                      "a person"});
  std::string note;
  const double metres = metres_in(transfer, view, file, out, note);
  for (npt::Vec3d& joint : skeleton->joints) joint = joint * metres;
  npt::MeshScene made = npt::scene_from(scaled(mesh, metres), file.stem().string());
  npt::add_skeleton(made, *skeleton);
  npt::write_scene(out, made.scene);
  if (!note.empty()) std::cerr << "npt: note: " << note << '\n';
  if (prepared.body()->confidence < npt::high_confidence)
    std::cerr << "npt: note: " << name << " reads as a person with a confidence of only " << confidence
              << " %: look at the result before using it\n";
  char time[32];
  std::snprintf(time, sizeof time, "%.2f s", watch.seconds());
  std::cout << out.string() << ": " << skeleton->joint_count() << " joints in " << time << " (confidence " << confidence
            << " %)\n";
}

}  // namespace program
