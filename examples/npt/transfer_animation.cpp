#include "transfer_animation.hpp"

#include "arguments.hpp"
#include "interrupt.hpp"
#include "open_transfer.hpp"
#include "progress.hpp"
#include "remedies.hpp"
#include "stopwatch.hpp"
#include "transfer_batch.hpp"
#include "transfer_jobs.hpp"
#include "transfer_motion.hpp"
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
#include <npt/transfer/animation.hpp>
#include <npt/transfer/named_skeleton.hpp>
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

/// The poses of a sequence, one after another: a clip's at a rate, or a folder's meshes in the order of their names.
class PoseFrames {
 public:
  PoseFrames(const fs::path& pose, const AnimationArguments& animation) : name_(pose.string()) {
    const double rate = animation.fps.value_or(30);
    if (!fs::is_directory(pose)) {
      expect_extension(pose, formats::scenes);
      clip_.emplace(formats::read_scene(pose), name_,
                    npt::ClipFrames::Options{.clip = animation.clip, .rate = rate, .time = animation.time});
      return;
    }
    if (animation.clip || animation.time)
      throw npt::Error({animation.clip ? "--clip" : "--time", {}, "a folder of poses", "a .glb for --pose"});
    clip_name_ = fs::path(resolved(pose)).filename().string();
    files_ = meshes_in(pose);
    for (std::size_t i = 0; i < files_.size(); ++i) times_.push_back(static_cast<double>(i) / rate);
  }

  std::size_t size() const { return times().size(); }
  const std::vector<double>& times() const { return clip_ ? clip_->times() : times_; }
  const std::string& clip_name() const { return clip_ ? clip_->clip_name() : clip_name_; }
  /// The file that frame i comes from, for messages.
  std::string name(std::size_t i) const { return files_.empty() ? name_ : files_[i].string(); }

  const npt::Mesh& load(std::size_t i) { return clip_ ? clip_->frame(i) : mesh_ = formats::read_mesh(files_[i]); }

  npt::FrameSource source() {
    npt::FrameSource source;
    if (clip_) {
      source = npt::frame_source(*clip_);
    } else {
      source.count = files_.size();
      source.frame = [this](std::size_t i) -> const npt::Mesh& { return load(i); };
      source.other_count = npt::frames_to_try(files_.size());
      source.other = [this](std::size_t k) { return load(npt::frame_to_try(k + 1, files_.size())); };
    }
    source.name = [this](std::size_t i) { return name(i); };
    return source;
  }

 private:
  std::string name_, clip_name_;
  std::vector<fs::path> files_;
  std::optional<npt::ClipFrames> clip_;
  std::vector<double> times_;
  npt::Mesh mesh_;
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
    const npt::TransferReport& report = done_.report;
    const bool by_body = report.method != npt::Method::network;
    const double seconds = watch.seconds();
    char time[32];
    std::snprintf(time, sizeof time, "%.2f s", seconds);
    std::cout << job_.out.string() << ": " << frames_.size() << (frames_.size() == 1 ? " frame" : " frames") << " of "
              << frames_.clip_name() << how_ << " in " << time << " ("
              << (by_body ? by_body_text(report.kind, *report.confidence) : transfer.description()) << ")\n";
    JobOutcome outcome;
    outcome.status = JobOutcome::Status::done;
    outcome.method = by_body ? "body" : "network";
    outcome.kind = report.kind;
    outcome.confidence = report.confidence;
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
    catch_interrupts();
    std::string in_metres;
    {
      Progress progress("frames", frames_.size());
      const npt::Character character = transfer.character(view);
      std::size_t done = 0;
      const npt::Control control{.progress = [&](double) {
        if (done++ > 0) progress.advance();
        stop_if_interrupted();
      }};
      const bool follow_root = !all_.animation.time && !all_.animation.in_place;
      done_ =
          npt::animate(transfer, character, frames_.source(), follow_root, joint_names(all_.animation.names), control);
      metres_ = metres_in(transfer, character, job_.identity, to_folder() ? frame_file(0) : job_.out, in_metres);
    }
    std::vector<std::string> notes = notes_of(done_.report.warnings, name, frames_.name(done_.weakest));
    if (!in_metres.empty()) notes.push_back(in_metres);
    return notes;
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
      npt::write_mesh(job_.out, npt::scaled(frame(0), metres_));
    } else if (to_folder()) {
      for (std::size_t i = 0; i < frames_.size(); ++i) npt::write_mesh(frame_file(i), npt::scaled(frame(i), metres_));
    } else {
      write_moving();
    }
  }

  void write_moving() {
    for (std::size_t i = 0; i < frames_.size(); ++i) frame(i);  // validates
    how_ = done_.skeleton ? " on a skeleton of " + std::to_string(done_.skeleton->joint_count()) + " joints"
                          : std::string(" as morph targets");
    npt::write_scene(job_.out, npt::animation_scene(identity_, job_.identity.stem().string(), done_,
                                                    frames_.clip_name(), frames_.times(), metres_));
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
    group.panels.push_back(view::mesh_panel("identity", npt::scaled(identity_, metres_)));
    group.panels.back().colour = render::parse_colour("blue", "--view");
    const double ratio =
        metres_ * npt::extent_of(identity_.coordinates()) / npt::extent_of(frames_.load(0).coordinates());
    const double size = ratio > 1.5 || ratio < 1 / 1.5 ? ratio : 1;
    view::Panel pose = view::mesh_panel("pose", npt::scaled(frames_.load(0), size));
    pose.colour = render::parse_colour("sand", "--view");
    for (std::size_t i = 1; i < frames_.size(); ++i)
      view::add_frame(pose, npt::scaled(frames_.load(i), size), frames_.name(i));
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
  npt::Animation done_;
  std::string how_;
};

}  // namespace

bool is_animation(const AnimationArguments& animation, const fs::path& pose, const fs::path& out) {
  if (animation.clip || animation.fps || animation.time || animation.in_place || animation.across) return true;
  if (animation.bake || animation.apply || animation.clip_name || animation.skeleton == "own") return true;
  if (fs::is_directory(pose)) return is_gltf(out) || !motions_in(pose).empty();
  return is_motion(pose);
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
  LastCharacter last;
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
    const auto opened = [&]() -> const PoseTransfer& {
      if (!transfer) transfer.emplace(open_transfer(arguments));
      return *transfer;
    };
    if (auto moved = transfer_motions(job, all, arguments, opened, last, all.page ? &page : nullptr)) return *moved;
    AnimationTransfer own(job, all);
    if (all.skip_existing && own.is_done()) return there;
    return own.run(opened(), all.page ? &page : nullptr);
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
      outcomes[i].error = (place.empty() ? "" : place + ": ") + message_of(error);
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
  const npt::Character character = transfer.character(view);
  character.expect_recognised();
  auto skeleton = npt::named_skeleton(character, joint_names(animation.names));
  std::string note;
  const double metres = metres_in(transfer, character, file, out, note);
  for (npt::Vec3d& joint : skeleton->joints) joint = joint * metres;
  npt::MeshScene made = npt::scene_from(npt::scaled(mesh, metres), file.stem().string());
  npt::add_skeleton(made, *skeleton);
  npt::write_scene(out, made.scene);
  if (!note.empty()) std::cerr << "npt: note: " << note << '\n';
  for (const std::string& text : notes_of(character.warnings(), name, name)) std::cerr << "npt: note: " << text << '\n';
  char time[32];
  std::snprintf(time, sizeof time, "%.2f s", watch.seconds());
  std::cout << out.string() << ": " << skeleton->joint_count() << " joints in " << time << " (confidence "
            << npt::percent_text(character.confidence().value_or(0)) << ")\n";
}

}  // namespace program
