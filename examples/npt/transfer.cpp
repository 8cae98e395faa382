/// npt transfer: gives an identity mesh the pose of another mesh, once or many times.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "network_arguments.hpp"
#include "progress.hpp"
#include "quality_arguments.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"
#include "transfer_backend.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"

#include <npt/io/mesh_file.hpp>
#include <npt/mesh/validate.hpp>

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
  std::optional<std::string> format, normalise;
  std::string resample = "auto";
  program::TransferOptions transfer;
  bool keep_going = false;
};

/// Reads meshes; keeps the last one while successive jobs name the same file.
class MeshSlot {
 public:
  const program::LoadedMesh& get(const fs::path& file) {
    if (loaded_.number == 0 || file != file_) {
      loaded_.number = 0;
      loaded_.mesh = npt::read_mesh(file);
      loaded_.name = file.string();
      loaded_.number = ++last_number();
      file_ = file;
    }
    return loaded_;
  }

 private:
  static std::uint64_t& last_number() {
    static std::uint64_t number = 0;
    return number;
  }
  fs::path file_;
  program::LoadedMesh loaded_;
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
    const std::unique_ptr<program::TransferBackend> backend = program::make_transfer_backend(options_.transfer);
    if (!backend->notice().empty()) std::cerr << "npt: note: " << backend->notice() << '\n';
    program::catch_interrupts();
    progress_.emplace("pairs", jobs_.size());
    const program::Stopwatch watch;
    std::size_t done = 0;
    for (const TransferJob& job : jobs_) {
      program::stop_if_interrupted();
      done += attempt(job, [&] { run_job(job, *backend); }) ? 1 : 0;
      progress_->advance();
    }
    progress_.reset();
    if (!rows_.empty()) draw_picture();
    char time[32];
    std::snprintf(time, sizeof time, "%.2f s", watch.seconds());
    if (done > 0)
      std::cout << (done == 1 ? jobs_.front().out.string() : std::to_string(done) + " meshes") << " in " << time << " ("
                << backend->description() << ")\n";
  }

  void run_job(const TransferJob& job, program::TransferBackend& backend) {
    const program::LoadedMesh& identity = identity_.get(job.identity);
    const program::LoadedMesh& pose = pose_.get(job.pose);
    npt::Mesh result = backend.transfer(identity, pose);
    npt::validate(result, "result for " + identity.name);
    npt::write_mesh(job.out, result);
    if (options_.picture)
      for (const npt::Mesh* mesh : {&identity.mesh, &pose.mesh, &std::as_const(result)}) rows_.push_back(*mesh);
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
  MeshSlot identity_, pose_;
  std::vector<npt::Mesh> rows_;  ///< identity, pose and result of every pair, for the picture
};

void run(Options options) {
  if (!options.pairs && !(options.identity && options.pose && options.out))
    throw CLI::RequiredError("--identity, --pose and --out, or --pairs");
  if (options.normalise) options.transfer.normalisation = npt::parse_normalisation(*options.normalise, "--normalise");
  options.transfer.resample = options.resample == "auto";
  // A folder of poses with the same faces is a sequence: nothing may flicker.
  options.transfer.sequence = !options.pairs;
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
  program::add_network_options(command, o->transfer.network);
  command.add_option("--threads", o->transfer.threads, "Threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command
      .add_option("--normalise", o->normalise,
                  "How meshes are brought to the network's frame; without: the weights' own way")
      ->check(CLI::IsMember({"sphere", "centre", "none"}));
  command
      .add_option("--resample", o->resample,
                  "auto: bring the pose mesh to the identity's vertex count; off: refuse another count")
      ->check(CLI::IsMember({"auto", "off"}))
      ->capture_default_str();
  command.add_option("--seed", o->transfer.seed, "Of resampling, of the invariant order, of random weights")
      ->check(program::whole_number())
      ->capture_default_str();
  command.add_flag("--invariant", o->transfer.invariant, "Make the result independent of the inputs' vertex orders");
  program::add_quality_options(command, o->transfer);
  command.add_option("--format", o->format, "ply or obj: of the results in a folder; without: as the identity")
      ->check(CLI::IsMember({"ply", "obj"}))
      ->excludes("--pairs");
  command.add_flag("--keep-going", o->keep_going, "Go on after a pair that fails, and report at the end");
  command.add_option("--render", o->picture, "Also draw identity, pose and result (.png)");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("transfer", "Give one mesh the pose of another", add);

}  // namespace transfer_command
