/// npt transfer: gives an identity mesh the pose of another mesh, once or many times.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "open_transfer.hpp"
#include "progress.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"
#include "transfer_arguments.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"

#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/transfer/pose_sequence.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace transfer_command {

namespace fs = std::filesystem;
using program::TransferJob;

struct Options {
  std::optional<fs::path> identity, pose, out, pairs, picture;
  std::optional<std::string> format;
  program::TransferArguments transfer;
  bool keep_going = false;
};

/// A mesh as read, kept while successive jobs name the same file.
class LoadedMesh {
 public:
  /// Whether the file is another one than before, and was read.
  bool load(const fs::path& file) {
    if (loaded_ && file == file_) return false;
    loaded_ = false;
    mesh_ = npt::read_mesh(file);
    triangles_ = npt::triangulate(mesh_);
    name_ = file.string();
    file_ = file;
    loaded_ = true;
    return true;
  }
  const npt::Mesh& mesh() const { return mesh_; }
  npt::MeshView view() const { return {mesh_.coordinates(), triangles_, name_}; }

 private:
  bool loaded_ = false;
  fs::path file_;
  npt::Mesh mesh_;
  std::vector<npt::Triangle> triangles_;
  std::string name_;
};

/// The pairs of a run, one after another: an identity or a pose that the next pair shares is prepared once. A folder of
/// poses is a sequence, whose frames share their random choices, so that nothing flickers; in a list every pose is
/// chosen for itself.
class Transferring {
 public:
  Transferring(const program::TransferArguments& arguments, bool sequence)
      : transfer_(program::open_transfer(arguments)), frames_(transfer_), sequence_(sequence) {}

  const npt::Mesh& identity() const { return identity_.mesh(); }
  const npt::Mesh& pose() const { return pose_.mesh(); }

  npt::Mesh run(const fs::path& identity_file, const fs::path& pose_file) {
    const bool new_identity = identity_.load(identity_file), new_pose = pose_.load(pose_file);
    if (new_identity) prepared_identity_ = {};
    if (new_pose) prepared_pose_ = {};
    const std::size_t vertices = identity_.mesh().vertex_count();
    if (!sequence_ && prepared_identity_.vertex_count() == 0 && !prepared_pose_.encoded()) {
      transfer_.prepare(identity_.view(), pose_.view(), prepared_identity_, prepared_pose_);
    }
    if (prepared_identity_.vertex_count() == 0) transfer_.prepare_identity(identity_.view(), prepared_identity_);
    const std::size_t taken = prepared_pose_.identity_vertices();
    const bool fits = !transfer_.pairs_vertices() || taken == 0 || taken == vertices;
    if (!prepared_pose_.encoded() || !fits) {
      if (!sequence_) frames_.restart();
      frames_.prepare(pose_.view(), vertices, prepared_pose_);
    }
    npt::Mesh result = identity_.mesh();
    transfer_(prepared_identity_, prepared_pose_, result.coordinates());
    npt::recompute_normals(result);
    report_ = transfer_.report(prepared_identity_, prepared_pose_);
    program::note_method(report_, identity_file.string(), pose_file.string());
    if (report_.method == npt::Method::network) {
      if (new_identity) program::note_unit(transfer_, identity_.view());
      if (new_pose) program::note_unit(transfer_, pose_.view());
    }
    return result;
  }
  /// How the last pair was transferred.
  std::string way() const {
    if (report_.method == npt::Method::network) return transfer_.description();
    return "through bodies, trust " + std::to_string(std::lround(100 * report_.trust())) + " %";
  }

 private:
  npt::TransferReport report_;
  program::PoseTransfer transfer_;
  npt::PoseSequence<npt::TbbExecutor> frames_;
  bool sequence_;
  LoadedMesh identity_, pose_;
  npt::PreparedIdentity prepared_identity_;
  npt::PreparedPose prepared_pose_;
};

class Transfer {
 public:
  explicit Transfer(const Options& options) : options_(options), jobs_(list_jobs()) {
    program::check_outputs_apart(jobs_);
    if (options_.picture) program::check_picture(*options_.picture, jobs_, "pairs");
    std::erase_if(jobs_, [this](const TransferJob& job) { return !attempt(job, [&job] { program::check_job(job); }); });
  }

  void run() {
    const std::size_t total = jobs_.size() + failures_;
    if (!jobs_.empty()) run_jobs();
    if (failures_ > 0)
      throw npt::Error({std::to_string(failures_) + " of " + std::to_string(total) + " pairs failed", {}, {}, {}});
  }

 private:
  std::vector<TransferJob> list_jobs() {
    if (options_.pairs) return program::read_pairs(*options_.pairs);
    return program::pose_jobs(*options_.identity, *options_.pose, *options_.out, options_.format, folder_);
  }

  /// Runs `step` of a job. With --keep-going an error is printed and counted; otherwise it goes on to main.
  template <class Step>
  bool attempt(const TransferJob& job, Step&& step) {
    try {
      step();
      return true;
    } catch (const npt::Error& error) {
      const std::string message = (job.place.empty() ? "" : job.place + ": ") + error.what();
      if (!options_.keep_going) throw npt::Error({message, {}, {}, {}});
      if (progress_) progress_->clear();
      std::cerr << "npt: error: " << message << '\n';
      ++failures_;
      return false;
    }
  }

  void run_jobs() {
    Transferring transferring(options_.transfer, !options_.pairs);
    program::catch_interrupts();
    progress_.emplace("pairs", jobs_.size());
    const program::Stopwatch watch;
    std::size_t done = 0;
    for (const TransferJob& job : jobs_) {
      program::stop_if_interrupted();
      done += attempt(job, [&] { run_job(job, transferring); }) ? 1 : 0;
      progress_->advance();
    }
    progress_.reset();
    if (!rows_.empty()) draw_picture();
    char time[32];
    std::snprintf(time, sizeof time, "%.2f s", watch.seconds());
    if (done > 0)
      std::cout << (done == 1 ? jobs_.front().out.string() : std::to_string(done) + " meshes") << " in " << time << " ("
                << transferring.way() << ")\n";
  }

  void run_job(const TransferJob& job, Transferring& transferring) {
    const npt::Mesh result = transferring.run(job.identity, job.pose);
    npt::validate(result, "result for " + job.identity.string());
    npt::write_mesh(job.out, result);
    if (options_.picture)
      for (const npt::Mesh* mesh : {&transferring.identity(), &transferring.pose(), &result}) rows_.push_back(*mesh);
  }

  void draw_picture() const {
    std::vector<std::vector<program::PictureCell>> rows;
    for (std::size_t i = 0; i + 2 < rows_.size(); i += 3)
      rows.push_back(
          {{&rows_[i], "identity", "blue"}, {&rows_[i + 1], "pose", "sand"}, {&rows_[i + 2], "result", "blue"}});
    program::draw_rows(*options_.picture, rows);
  }

  const Options& options_;
  std::optional<program::OutputFolder> folder_;
  std::vector<TransferJob> jobs_;
  std::size_t failures_ = 0;
  std::optional<program::Progress> progress_;
  std::vector<npt::Mesh> rows_;  ///< identity, pose and result of every pair, for the picture
};

void run(Options options) {
  if (!options.pairs && !(options.identity && options.pose && options.out))
    throw CLI::RequiredError("--identity, --pose and --out, or --pairs");
  Transfer(options).run();
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  CLI::Option* identity = command.add_option("--identity", o->identity, "Mesh that gives the shape (.ply, .obj)");
  CLI::Option* pose =
      command.add_option("--pose", o->pose, "Mesh that gives the pose, or a folder of them: a sequence");
  CLI::Option* out = command.add_option("-o,--out", o->out, "Result (.ply, .obj); a folder for a folder of poses");
  command.add_option("--pairs", o->pairs, "File with lines of: identity pose output")
      ->excludes(identity)
      ->excludes(pose)
      ->excludes(out);
  program::add_transfer_options(command, o->transfer);
  command.add_option("--seed", o->transfer.options.seed, "Of pairings, drawn points and random weights")
      ->check(program::whole_number())
      ->capture_default_str();
  command.add_option("--format", o->format, "ply or obj: of the results in a folder; without: as the identity")
      ->check(CLI::IsMember({"ply", "obj"}))
      ->excludes("--pairs");
  command.add_flag("--keep-going", o->keep_going, "Go on after a pair that fails, and report at the end");
  command.add_option("--render", o->picture, "Also draw identity, pose and result (.png)");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("transfer", "Give one mesh the pose of another", add);

}  // namespace transfer_command
