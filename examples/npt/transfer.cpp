/// npt transfer: gives an identity mesh the pose of another mesh, once or many times.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "open_transfer.hpp"
#include "progress.hpp"
#include "remedies.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"
#include "transfer_animation.hpp"
#include "transfer_arguments.hpp"
#include "transfer_batch.hpp"
#include "transfer_jobs.hpp"
#include "transfer_motion.hpp"
#include "transfer_picture.hpp"
#include "transfer_view.hpp"

#include <formats/read.hpp>
#include <training/group.hpp>

#include <npt/base/default_executor.hpp>
#include <npt/io/file.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/transfer/animation.hpp>
#include <npt/transfer/pose_tracker.hpp>
#include <npt/transfer/warning.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace transfer_command {

namespace fs = std::filesystem;
using program::TransferJob;

struct Options {
  std::optional<fs::path> identity, pose, character, clip, out, pairs, picture, page, report;
  std::optional<std::string> format, shard;
  program::TransferArguments transfer;
  program::AnimationArguments animation;
  int in_flight = 0;  ///< 0: as many as the threads
  bool keep_going = false, skip_existing = false, each = false;
};

/// A mesh as read, and as it was prepared for its role.
struct PreparedMesh {
  explicit PreparedMesh(const fs::path& path)
      : file(path), name(path.string()), mesh(formats::read_mesh(path, &notes)), triangles(npt::triangulate(mesh)) {}
  npt::MeshView view() const { return {mesh.coordinates(), triangles, name}; }

  fs::path file;
  std::string name;
  std::vector<std::string> notes{};  ///< a sentence for each thing that was repaired
  npt::Mesh mesh;
  std::vector<npt::Triangle> triangles;
  npt::Character character{};  ///< of an identity, once it is prepared
  npt::Pose pose{};            ///< of the other
};

/// Meshes that further pairs of a list take, too: each is read and estimated once. Any number of threads may use it.
class KeptMeshes {
 public:
  /// A pair that will take both of its meshes. All are told of before the first is taken.
  void expect(const TransferJob& job) { ++identities_[job.identity].uses, ++poses_[job.pose].uses; }

  /// What was kept of a file in its role, or nothing; one of the pairs that take it is about to have it.
  std::shared_ptr<PreparedMesh> take(const fs::path& file, npt::MeshRole role) {
    const std::lock_guard lock(mutex_);
    Entry& entry = entry_of(file, role);
    std::shared_ptr<PreparedMesh> mesh = entry.mesh;
    if (--entry.uses == 0 && mesh != nullptr) {
      vertices_ -= mesh->mesh.vertex_count();
      entry.mesh = nullptr;
    }
    return mesh;
  }
  /// Keeps a prepared mesh where another pair takes it and memory allows. It must not change from now on.
  void keep(const std::shared_ptr<PreparedMesh>& mesh, npt::MeshRole role) {
    const std::lock_guard lock(mutex_);
    Entry& entry = entry_of(mesh->file, role);
    const std::size_t count = mesh->mesh.vertex_count();
    if (entry.uses == 0 || entry.mesh != nullptr || vertices_ + count > most_vertices) return;
    entry.mesh = mesh;
    vertices_ += count;
  }
  /// Reads a pair's meshes before it asks for them, of a list that one thread works off. What can't be read is left to
  /// the pair, which says why.
  void read_ahead(const TransferJob& job) {
    try {
      keep(std::make_shared<PreparedMesh>(job.identity), npt::MeshRole::identity);
      keep(std::make_shared<PreparedMesh>(job.pose), npt::MeshRole::pose);
    } catch (const npt::Error&) {  // NOLINT(bugprone-empty-catch)
    }
  }

 private:
  /// Of all kept meshes: some 300 MB.
  static constexpr std::size_t most_vertices = 1'000'000;

  struct Entry {
    std::size_t uses = 0;  ///< pairs that are still to take it
    std::shared_ptr<PreparedMesh> mesh;
  };
  Entry& entry_of(const fs::path& file, npt::MeshRole role) {
    return (role == npt::MeshRole::identity ? identities_ : poses_)[file];
  }

  std::mutex mutex_;
  std::map<fs::path, Entry> identities_, poses_;
  std::size_t vertices_ = 0;
};

/// Pairs, one after another: an identity or a pose that another pair of the list shares is prepared once. A folder of
/// poses is a sequence, whose frames share their random choices, so that nothing flickers; in a list every pose is
/// chosen for itself.
class Transferring {
 public:
  Transferring(const program::PoseTransfer& transfer, bool sequence, KeptMeshes& kept)
      : transfer_(transfer), tracker_(transfer_), sequence_(sequence), kept_(kept) {}

  const npt::Mesh& identity() const { return identity_->mesh; }
  const npt::Mesh& pose() const { return pose_->mesh; }

  /// `metres`: in a unit of the result, where it is to be written in metres; else 1.
  npt::Mesh run(const TransferJob& job, program::JobOutcome& outcome, double& metres) {
    prepare(job, outcome.notes);
    npt::Mesh result = identity_->mesh;
    const npt::TransferReport report = transfer_.apply(identity_->character, pose_->pose, result.coordinates());
    npt::recompute_normals(result);
    outcome.confidence = report.confidence;
    outcome.measures = report.measures;
    outcome.method = report.method == npt::Method::network ? "network" : "body";
    outcome.kind = report.kind;
    for (std::string& note : program::notes_of(report.warnings, job.identity.string(), job.pose.string()))
      outcome.notes.push_back(std::move(note));
    std::string note;
    metres = program::metres_in(transfer_, identity_->character, job.identity, job.out, note);
    if (!note.empty()) outcome.notes.push_back(std::move(note));
    return result;
  }

  /// Takes a frame whose result is there already: the next ones depend on it.
  void pass(const TransferJob& job) {
    std::vector<std::string> notes;
    prepare(job, notes);
  }

 private:
  /// The last pair's mesh, or a kept one, or the file's. notes: of another mesh than the last pair's
  void load(std::shared_ptr<PreparedMesh>& mesh, const fs::path& file, npt::MeshRole role,
            std::vector<std::string>& notes) {
    std::shared_ptr<PreparedMesh> kept = kept_.take(file, role);
    if (mesh != nullptr && mesh->file == file) return;
    mesh = nullptr;
    mesh = kept != nullptr ? std::move(kept) : std::make_shared<PreparedMesh>(file);
    notes.insert(notes.end(), mesh->notes.begin(), mesh->notes.end());
  }

  void prepare(const TransferJob& job, std::vector<std::string>& notes) {
    const bool first = series_ != job.series;
    if (first) tracker_.restart();
    series_ = job.series;
    load(identity_, job.identity, npt::MeshRole::identity, notes);
    load(pose_, job.pose, npt::MeshRole::pose, notes);
    prepare_loaded(job, first);
    kept_.keep(identity_, npt::MeshRole::identity);
    if (!sequence_) kept_.keep(pose_, npt::MeshRole::pose);
  }

  void prepare_loaded(const TransferJob& job, bool first) {
    const std::size_t vertices = identity_->mesh.vertex_count();
    npt::Character& character = identity_->character;
    if (!sequence_ && character.vertex_count() == 0 && !pose_->pose.prepared())
      return transfer_.prepare(identity_->view(), pose_->view(), character, pose_->pose);
    if (character.vertex_count() == 0) transfer_.prepare(identity_->view(), character);
    const std::size_t taken = pose_->pose.identity_vertices();
    if (pose_->pose.prepared() && (!transfer_.pairs_vertices() || taken == 0 || taken == vertices)) return;
    if (pose_->pose.prepared()) pose_ = std::make_shared<PreparedMesh>(*pose_);  // another pair has this one
    if (!sequence_) {
      transfer_.prepare(pose_->view(), vertices, pose_->pose);
    } else if (first) {
      const std::vector<fs::path> all = program::meshes_in(job.pose.parent_path());
      pose_->pose = tracker_.start(
          pose_->mesh, job.pose.string(), vertices, npt::frames_to_try(all.size()),
          [&all](std::size_t k) { return formats::read_mesh(all[npt::frame_to_try(k + 1, all.size())]); });
    } else {
      pose_->pose = tracker_.next(pose_->view(), vertices);
    }
  }

  const program::PoseTransfer& transfer_;
  npt::PoseTracker<npt::DefaultExecutor> tracker_;
  bool sequence_;
  KeptMeshes& kept_;
  std::optional<std::size_t> series_;
  std::shared_ptr<PreparedMesh> identity_, pose_;
};

/// The processes of a run under mpirun, or this one alone.
class Processes {
 public:
  /// Errors    npt::Error where mpirun started several processes for many `pairs` and this build can't divide them
  explicit Processes(std::size_t pairs) : group_(training::join_group()) {
    if (group_ != nullptr || pairs < 2) return;
    const char* size = std::getenv("OMPI_COMM_WORLD_SIZE");
    if (size != nullptr && std::string(size) != "1")
      throw npt::Error({"mpirun",
                        {},
                        std::string(size) + " processes and a build without MPI",
                        "-DNPT_WITH_MPI=ON, or --shard in each process"});
  }
  bool first() const { return group_ == nullptr || group_->rank() == 0; }
  program::Shard shard() const {
    if (group_ == nullptr) return {};
    return {static_cast<std::size_t>(group_->rank()) + 1, static_cast<std::size_t>(group_->size())};
  }
  /// The sum over all; returns when all have got there.
  double sum(double value) const {
    if (group_ != nullptr) group_->sum(std::span<double>(&value, 1));
    return value;
  }

 private:
  std::unique_ptr<npt::TrainingGroup> group_;
};

class Transfer {
 public:
  explicit Transfer(const Options& options)
      : options_(options),
        sequence_(!options.pairs && !options.each && fs::is_directory(*options.pose)),
        all_(list_jobs()) {
    program::check_outputs_apart(all_);
    if (options_.picture) program::check_picture(*options_.picture, all_, "pairs");
    if (options_.page) program::check_page(*options_.page, all_, "pairs");
    if (options_.report) check_report();
    std::vector<TransferJob> jobs = all_;
    if (options_.shard) jobs = program::jobs_of(std::move(jobs), program::parse_shard(*options_.shard, "--shard"));
    processes_.emplace(all_.size());
    if (processes_->shard().count > 1) jobs = program::jobs_of(std::move(jobs), processes_->shard());
    if (jobs.size() < all_.size()) keep_folders();
    jobs_ = std::move(jobs);
    outcomes_.resize(jobs_.size());
    for (std::size_t i = 0; i < jobs_.size(); ++i)
      if (options_.skip_existing && program::is_there(jobs_[i]))
        outcomes_[i].status = Status::skipped;
      else
        attempt(i, [&] { program::check_job(jobs_[i]); });
    if (options_.page) page_.emplace(jobs_.size());
    rows_.resize(options_.picture ? jobs_.size() : 0);
  }

  void run() {
    const program::Stopwatch watch;
    try {
      run_jobs();
    } catch (...) {
      if (options_.report) write_report();
      throw;
    }
    if (options_.report) write_report();
    draw();
    const auto total = [&](Status status) {
      const auto own = std::ranges::count(outcomes_, status, &program::JobOutcome::status);
      return static_cast<std::size_t>(processes_ ? processes_->sum(static_cast<double>(own))
                                                 : static_cast<double>(own));
    };
    const std::size_t done = total(Status::done), skipped = total(Status::skipped), failed = total(Status::failed);
    const bool first = !processes_ || processes_->first();
    if (options_.report && processes_) gather_report();
    const std::size_t processes = processes_ ? processes_->shard().count : 1;
    processes_.reset();  // one that left by an error would end the others
    if (first) say_done(done, skipped, processes, watch.seconds());
    if (jobs_.size() > 1) program::print_failures(std::cerr, jobs_, outcomes_);
    if (failed > 0)
      throw npt::Error(
          {std::to_string(failed) + " of " + std::to_string(done + skipped + failed) + " pairs failed", {}, {}, {}});
  }

 private:
  using Status = program::JobOutcome::Status;

  /// Jobs that one thread does one after another: a sequence, or some lines of a list.
  struct Piece {
    std::size_t first, last;
  };

  std::vector<TransferJob> list_jobs() {
    if (options_.pairs) return program::read_pairs(*options_.pairs);
    std::vector<TransferJob> jobs;
    if (fs::is_directory(*options_.identity)) {
      jobs =
          program::identity_jobs(*options_.identity, *options_.pose, *options_.out, options_.format, folder_, folders_);
    } else {
      jobs = program::pose_jobs(*options_.identity, *options_.pose, *options_.out, options_.format, folder_);
    }
    if (options_.each)
      for (std::size_t i = 0; i < jobs.size(); ++i) jobs[i].series = i;
    return jobs;
  }

  /// Other processes write into them too.
  void keep_folders() {
    if (folder_) folder_->keep();
    for (const auto& folder : folders_) folder->keep();
  }

  void check_report() const {
    std::vector<fs::path> files;
    for (const TransferJob& job : all_) files.insert(files.end(), {job.identity, job.pose, job.out});
    for (const auto& other : {options_.picture, options_.page})
      if (other) files.push_back(*other);
    program::check_output(*options_.report, files);
  }

  /// Runs `step` of a job. With --keep-going an error is printed and counted; otherwise it goes on to main.
  template <class Step>
  void attempt(std::size_t i, Step&& step) {
    try {
      step();
    } catch (const npt::Error& error) {
      const TransferJob& job = jobs_[i];
      const std::string message = (job.place.empty() ? "" : job.place + ": ") + program::message_of(error);
      const std::lock_guard lock(mutex_);
      outcomes_[i].status = Status::failed;
      outcomes_[i].error = message;
      if (!options_.keep_going) throw npt::Error({message, {}, {}, {}});
      if (progress_) progress_->clear();
      std::cerr << "npt: error: " << message << '\n';
    }
  }

  bool waits(std::size_t i) const { return outcomes_[i].status == Status::none; }

  /// Jobs that are to be done, in pieces for one thread. Frames of a sequence that are there or failed stay in it up to
  /// its last frame that is to be done.
  std::vector<Piece> pieces(std::size_t longest) const {
    std::vector<Piece> pieces;
    for (std::size_t i = 0; i < jobs_.size();) {
      std::size_t last = i + 1;
      if (sequence_) {
        while (last < jobs_.size() && jobs_[last].series == jobs_[i].series) ++last;
      } else {
        while (last < jobs_.size() && last - i < longest) ++last;
      }
      const std::size_t next = last;
      while (last > i && !waits(last - 1)) --last;
      if (last > i) pieces.push_back({i, last});
      i = next;
    }
    return pieces;
  }

  /// Meshes of this size have work for all threads; several at a time would only take memory.
  static constexpr std::uint64_t large_job = std::uint64_t{16} << 20;

  void run_jobs() {
    const auto total =
        static_cast<std::size_t>(std::ranges::count(outcomes_, Status::none, &program::JobOutcome::status));
    if (total == 0) return;
    program::catch_interrupts();
    const int processors = npt::DefaultExecutor().slots();  // those that this process may use
    const int threads = options_.transfer.threads > 0 ? options_.transfer.threads : processors;
    // Each pair in flight has a workspace of its own (112 MB at 6890 vertices and bottleneck 1024), hence the limit.
    const int in_flight = std::min(processors, options_.in_flight > 0 ? options_.in_flight : std::min(threads, 16));
    const std::size_t longest = std::clamp<std::size_t>(total / (4 * static_cast<std::size_t>(in_flight)), 1, 16);
    std::vector<Piece> small, large;
    for (const Piece piece : pieces(longest)) {
      bool is_large = false;
      for (std::size_t i = piece.first; i < piece.last; ++i) is_large |= program::bytes_of(jobs_[i]) > large_job;
      (is_large ? large : small).push_back(piece);
    }
    if (small.size() < 2 || in_flight == 1) {
      large.insert(large.begin(), small.begin(), small.end());
      small.clear();
    }
    progress_.emplace("pairs", total);
    if (!small.empty()) run_pieces(small, std::min(in_flight, static_cast<int>(small.size())), 1);
    if (!large.empty()) run_pieces(large, 1, options_.transfer.threads);
    progress_.reset();
  }

  /// `threads`: of each pair.
  void run_pieces(const std::vector<Piece>& pieces, int in_flight, int threads) {
    program::TransferArguments arguments = options_.transfer;
    arguments.threads = threads;
    arguments.options.measure = options_.report.has_value();
    KeptMeshes kept;
    for (const Piece piece : pieces)
      for (std::size_t i = piece.first; i < piece.last; ++i)
        if (waits(i) || sequence_) kept.expect(jobs_[i]);
    std::optional<program::PoseTransfer> opened;
    npt::DefaultExecutor(threads).for_each(2, [&](int i, int) {
      if (i == 0) return void(opened.emplace(program::open_transfer(arguments)));
      if (in_flight == 1 && waits(pieces.front().first)) kept.read_ahead(jobs_[pieces.front().first]);
    });
    const program::PoseTransfer& transfer = *opened;
    description_ = transfer.description();
    const npt::DefaultExecutor executor(in_flight);
    std::vector<std::unique_ptr<Transferring>> workers(static_cast<std::size_t>(executor.slots()));
    executor.for_each(static_cast<int>(pieces.size()), [&](int p, int slot) {
      const Piece piece = pieces[static_cast<std::size_t>(p)];
      auto& worker = workers[static_cast<std::size_t>(slot)];
      if (worker == nullptr || sequence_) worker = std::make_unique<Transferring>(transfer, sequence_, kept);
      for (std::size_t i = piece.first; i < piece.last; ++i) {
        program::stop_if_interrupted();
        if (waits(i))
          run_job(i, *worker);
        else if (sequence_ && outcomes_[i].status == Status::skipped)
          attempt(i, [&] { worker->pass(jobs_[i]); });
      }
    });
  }

  void run_job(std::size_t i, Transferring& worker) {
    const TransferJob& job = jobs_[i];
    attempt(i, [&] {
      const program::Stopwatch watch;
      program::JobOutcome outcome;
      double metres = 1;
      const npt::Mesh result = worker.run(job, outcome, metres);
      npt::validate(result, "result for " + job.identity.string());
      npt::write_mesh(job.out, npt::scaled(result, metres));
      outcome.seconds = watch.seconds();
      outcome.status = Status::done;
      const std::lock_guard lock(mutex_);
      if (!outcome.notes.empty()) progress_->clear();
      for (const std::string& note : outcome.notes) std::cerr << "npt: note: " << note << '\n';
      outcomes_[i] = std::move(outcome);
      if (options_.picture) rows_[i] = {worker.identity(), worker.pose(), result};
      if (page_)
        page_->add(
            i, job,
            {{&worker.identity(), "identity", "blue"}, {&worker.pose(), "pose", "sand"}, {&result, "result", "blue"}});
    });
    const std::lock_guard lock(mutex_);
    progress_->advance();
  }

  /// The report of this process, beside the whole one where there are several.
  fs::path report_file(std::size_t process) const {
    fs::path file = *options_.report;
    if (processes_ && processes_->shard().count > 1) file += ".process-" + std::to_string(process);
    return file;
  }
  void write_report() const {
    std::string text;
    for (std::size_t i = 0; i < jobs_.size(); ++i)
      if (outcomes_[i].status != Status::none) text += program::report_line(jobs_[i], outcomes_[i]);
    npt::write_file(report_file(processes_ ? processes_->shard().number : 1), text);
  }
  /// The processes' reports as one, in the list's order. All have written theirs by now.
  void gather_report() const {
    const std::size_t count = processes_->shard().count;
    if (count < 2 || !processes_->first()) return;
    std::string text;
    for (std::size_t p = 1; p <= count; ++p) text += npt::read_file(report_file(p));
    npt::write_file(*options_.report, text);
    for (std::size_t p = 1; p <= count; ++p) fs::remove(report_file(p));
  }

  void draw() {
    std::vector<std::vector<program::PictureCell>> rows;
    for (const std::vector<npt::Mesh>& row : rows_)
      if (!row.empty())
        rows.push_back({{&row[0], "identity", "blue"}, {&row[1], "pose", "sand"}, {&row[2], "result", "blue"}});
    if (!rows.empty()) program::draw_rows(*options_.picture, rows);
    if (page_) page_->write(*options_.page, title());
  }

  std::string title() const {
    if (options_.pairs) return options_.pairs->filename().string();
    return options_.identity->filename().string() + " in the pose of " + options_.pose->filename().string();
  }

  /// How the last pair was transferred.
  std::string how() const {
    for (auto outcome = outcomes_.rbegin(); outcome != outcomes_.rend(); ++outcome)
      if (outcome->status == Status::done && outcome->method == "body")
        return program::by_body_text(outcome->kind, *outcome->confidence);
      else if (outcome->status == Status::done)
        break;
    return description_;
  }

  void say_done(std::size_t done, std::size_t skipped, std::size_t processes, double seconds) const {
    char time[32];
    std::snprintf(time, sizeof time, "%.2f s", seconds);
    const std::string there =
        skipped == 0 ? "" : std::to_string(skipped) + (skipped == 1 ? " was" : " were") + " there";
    if (done == 0) {
      if (skipped > 0 || jobs_.empty())
        std::cout << (there.empty() ? "no pairs in this part" : "nothing to do: " + there) << '\n';
      return;
    }
    const std::string what = done == 1 && all_.size() == 1 ? all_.front().out.string()
                             : done == 1                   ? "1 mesh"
                                                           : std::to_string(done) + " meshes";
    std::cout << what << " in " << time << (description_.empty() ? "" : " (" + how() + ")")
              << (processes > 1 ? ", " + std::to_string(processes) + " processes" : "")
              << (there.empty() ? "" : ", " + there) << '\n';
  }

  const Options& options_;
  bool sequence_;
  std::optional<program::OutputFolder> folder_;
  std::vector<std::unique_ptr<program::OutputFolder>> folders_;
  std::vector<TransferJob> all_, jobs_;  ///< jobs_: this process's and part's
  std::optional<Processes> processes_;
  std::mutex mutex_;
  std::vector<program::JobOutcome> outcomes_;  ///< [jobs_]
  std::optional<program::Progress> progress_;
  std::string description_;
  std::vector<std::vector<npt::Mesh>> rows_;  ///< identity, pose and result of every pair, for the picture
  std::optional<program::TransferPage> page_;
};

/// Of one character or of each in a folder, with one clip or with each in a folder of motions: OUT, OUT/CHARACTER.glb,
/// OUT/CLIP.glb, or OUT/CHARACTER/CLIP.glb.
std::vector<TransferJob> animation_jobs(const Options& options,
                                        std::vector<std::unique_ptr<program::OutputFolder>>& folders) {
  const bool many = fs::is_directory(*options.identity);
  const std::vector<fs::path> clips =
      fs::is_directory(*options.pose) ? program::motions_in(*options.pose) : std::vector<fs::path>{};
  if (!many && clips.empty()) return {{*options.identity, *options.pose, *options.out, {}, 0}};
  program::expect_folder_name(*options.out, "a folder for the results");
  folders.push_back(std::make_unique<program::OutputFolder>(*options.out));
  const std::string moving = options.format == "bvh" ? ".bvh" : ".glb";
  std::vector<TransferJob> jobs;
  for (const fs::path& identity : many ? program::meshes_in(*options.identity) : std::vector{*options.identity}) {
    const std::string extension = options.animation.time ? program::result_extension(identity, options.format) : moving;
    fs::path out = *options.out;
    if (many && !clips.empty()) {
      out /= identity.stem();
      folders.push_back(std::make_unique<program::OutputFolder>(out));
    }
    for (const fs::path& clip : clips)
      jobs.push_back({identity, clip, out / clip.filename().replace_extension(extension), {}, jobs.size()});
    if (clips.empty())
      jobs.push_back(
          {identity, *options.pose, out / identity.filename().replace_extension(extension), {}, jobs.size()});
  }
  return jobs;
}

/// Sequences that are one file, or one pose of a clip: of one identity, of each in a folder, or of a list.
void animate(const Options& options) {
  if (options.each)
    throw npt::Error({"--each", {}, "a sequence in one file", "a folder of poses and a folder for the results"});
  program::Animations all{.jobs = {},
                          .format = options.format,
                          .picture = options.picture,
                          .page = options.page,
                          .report = options.report,
                          .keep_going = options.keep_going,
                          .skip_existing = options.skip_existing,
                          .animation = options.animation};
  std::vector<std::unique_ptr<program::OutputFolder>> folders;
  all.jobs = options.pairs ? program::read_pairs(*options.pairs) : animation_jobs(options, folders);
  if (options.shard) {
    all.jobs = program::jobs_of(std::move(all.jobs), program::parse_shard(*options.shard, "--shard"));
    for (const auto& folder : folders) folder->keep();
  }
  program::animate(all, options.transfer);
}

/// Of a list: it says whether the list is one of clips.
fs::path first_pose(const fs::path& list) {
  const std::vector<TransferJob> jobs = program::read_pairs(list);
  return jobs.empty() || fs::is_directory(jobs.front().pose) ? fs::path() : jobs.front().pose;
}

void run(Options options) {
  if (options.character) options.identity = options.character;
  if (options.clip) options.pose = options.clip;
  const bool names_file = options.animation.clip && fs::exists(*options.animation.clip);
  if (names_file && !options.pose && !options.pairs)
    options.pose = *std::exchange(options.animation.clip, std::nullopt);
  if (!options.pairs && !(options.identity && options.pose && options.out))
    throw CLI::RequiredError("--identity, --pose and --out, or --pairs");
  const bool moves = options.pairs ? program::is_animation(options.animation, first_pose(*options.pairs), "")
                                   : program::is_animation(options.animation, *options.pose, *options.out);
  if (moves) return animate(options);
  if (options.format == "bvh") throw npt::Error({"--format", {}, "bvh for meshes", "ply, obj or glb"});
  if (options.animation.names != "vrm")
    std::cerr << "npt: note: --names changes nothing: only animated results have joints\n";
  Transfer(options).run();
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  CLI::Option* identity = command.add_option(
      "--identity", o->identity,
      "Pose this mesh, the target character (.ply, .obj, .glb, .fbx, ...), or every mesh of this folder");
  CLI::Option* pose =
      command.add_option("--pose", o->pose,
                         "Take the pose from this mesh; the frames of a sequence from a folder of meshes, or from a "
                         ".glb or .fbx with --clip; the motion from a .bvh, or from a .glb or .fbx without a mesh");
  CLI::Option* out = command.add_option("-o,--out", o->out,
                                        "Write the result to this file (.ply, .obj, .glb); results of a folder to this "
                                        "folder; a sequence to a folder or an animated .glb; a motion also to a .bvh");
  CLI::Option* character = command.add_option("CHARACTER", o->character, "The same as --identity");
  CLI::Option* clip = command.add_option("CLIP", o->clip, "The same as --pose");
  character->excludes(identity);
  clip->excludes(pose);
  command.add_option("--pairs", o->pairs, "Transfer all pairs of this list, with lines of: identity pose output")
      ->excludes(identity)
      ->excludes(pose)
      ->excludes(character)
      ->excludes(clip)
      ->excludes(out);
  program::add_animation_options(command, o->animation);
  program::add_motion_options(command, o->animation);
  program::add_transfer_options(command, o->transfer);
  command.add_option("--seed", o->transfer.options.seed, "Draw pairings, points and random weights from this seed")
      ->check(program::whole_number())
      ->capture_default_str();
  command.add_option("--format", o->format, "Write results in a folder in this format (default: the identity's)")
      ->check(CLI::IsMember({"ply", "obj", "glb", "bvh"}))
      ->excludes("--pairs");
  command
      .add_flag("--each", o->each,
                "Transfer each pose of a folder by itself, several at a time, instead of as a sequence")
      ->excludes("--pairs");
  command
      .add_option("--in-flight", o->in_flight,
                  "Transfer this many pairs or sequences at a time, each on one thread; 0: one a thread, 16 at most. "
                  "Large meshes come one at a time, on all threads")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command.add_flag("--keep-going", o->keep_going, "Go on after a pair that fails, and list failures at the end");
  command.add_flag("--skip-existing", o->skip_existing,
                   "Leave out pairs whose output is there, to resume a run that was stopped");
  command
      .add_option("--shard", o->shard,
                  "Transfer only this part of the pairs, such as 3/16, the third of sixteen: for the jobs of a cluster")
      ->type_name("PART");
  command.add_option(
      "--report", o->report,
      "Write a line of JSON for each pair: files, status, method, confidence, notes, measures, seconds or error");
  command.add_option("--render", o->picture, "Also draw identity, pose and result (.png)");
  command.add_option("--view", o->page, "Also write a page that shows identity, pose and result in a browser (.html)");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("transfer", "Give one mesh the pose of another", add);

}  // namespace transfer_command
