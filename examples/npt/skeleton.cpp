/// npt skeleton: pose transfer through a fitted body's skeleton, without a network. An identity mesh gets the joint
/// angles of one or many pose meshes. Or, with --protocol, its error on the paper's pairs.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "networks.hpp"
#include "progress.hpp"
#include "protocol_arguments.hpp"
#include "shipped_weights.hpp"
#include "shown_results.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"

#include <formats/read.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/lab/body_pairs.hpp>

#include <npt/base/default_executor.hpp>
#include <npt/baseline/fit/fit_start.hpp>
#include <npt/baseline/skeleton/skeleton_transfer.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace skeleton_command {

namespace fs = std::filesystem;
using program::TransferJob;

struct Options {
  std::optional<fs::path> identity, pose, out, body, fitted, picture, page;
  std::optional<std::string> format;
  program::ProtocolArguments protocol;
  int threads = 0;
};

/// Metres; a body that is farther from a mesh than this has not found its pose, or the mesh is no such body.
constexpr double poor_fit = 0.015;

std::shared_ptr<const npt::BodyModel> body_of(const Options& o) {
  return o.body ? std::make_shared<const npt::BodyModel>(npt::load_body(*o.body)) : npt::borrowed(npt::mannequin());
}

/// The shipped body estimation, from whose estimates fits begin; none where it isn't found: fits then search alone.
std::optional<program::PoseTransfer> shipped_estimation(int threads) {
  if (const auto file = program::find_shipped("human.safetensors"))
    return program::PoseTransfer::open(*file, {.method = npt::Method::body}, threads);
  std::cerr << "npt: note: found no shipped weights (human.safetensors): bodies are searched from the usual poses\n";
  return std::nullopt;
}

class Skeleton {
 public:
  explicit Skeleton(const Options& options)
      : options_(options),
        executor_(options.threads),
        jobs_(program::pose_jobs(*options.identity, *options.pose, *options.out, options.format, folder_)),
        shown_(options.picture, options.page, jobs_, {}, options.fitted,
               [this](const npt::Mesh& pose, const npt::Mesh& result) { return cells(pose, result); }) {
    program::check_outputs_apart(jobs_);
    for (const TransferJob& job : jobs_) program::check_job(job);
  }

  void run() {
    program::catch_interrupts();
    const program::Stopwatch watch;
    fitter_ = std::make_shared<const npt::BodyFitter>(body_of(options_));
    estimation_ = shipped_estimation(options_.threads);
    program::Progress progress("poses", jobs_.size());
    prepare();
    std::mutex mutex;
    executor_.for_each(static_cast<int>(jobs_.size()), [&](int i, int) {
      program::stop_if_interrupted();
      run_job(static_cast<std::size_t>(i), mutex);
      const std::lock_guard lock(mutex);
      progress.advance();
    });
    progress.clear();
    for (const std::string& note : notes_) std::cerr << "npt: note: " << note << '\n';
    if (options_.fitted) write_fitted();
    const std::string what = jobs_.size() == 1 ? jobs_.front().out.string() : std::to_string(jobs_.size()) + " meshes";
    std::printf("%s in %.2f s (bodies fitted to %.1f mm)\n", what.c_str(), watch.seconds(), 1000 * worst_fit_);
    shown_.write(options_.identity->filename().string() + " in the pose of " + options_.pose->filename().string());
  }

 private:
  /// Fits the identity mesh and, beside it, the first pose.
  void prepare() {
    identity_ = formats::read_mesh(*options_.identity);
    executor_.for_each(2, [&](int i, int) {
      if (i == 0) {
        const std::string name = options_.identity->string();
        const std::optional<npt::BodyFit> start = start_of(identity_, name);
        transfer_.emplace(fitter_, identity_, name, start ? &*start : nullptr);
      } else {
        first_fit_ = fit(jobs_.front().pose, formats::read_mesh(jobs_.front().pose));
      }
    });
    note_fit(transfer_->fit(), options_.identity->string());
  }

  npt::BodyFit fit(const fs::path& file, const npt::Mesh& mesh) const {
    const std::optional<npt::BodyFit> start = start_of(mesh, file.string());
    return npt::fit_body(*fitter_, mesh, file.string(), start ? &*start : nullptr);
  }

  /// The estimated pose of a mesh that is recognised as a person.
  std::optional<npt::BodyFit> start_of(const npt::Mesh& mesh, const std::string& name) const {
    if (!estimation_ || fitter_->model().joint_count() != npt::smpl_joint_count) return std::nullopt;
    try {
      const npt::Pose pose = estimation_->pose(mesh, 0, name);
      if (*pose.confidence() < npt::sure_start) return std::nullopt;
      return npt::start_of(*pose.joints(), fitter_->model());
    } catch (const npt::Error&) {
      return std::nullopt;  // what is wrong with the mesh, the fit says
    }
  }

  void run_job(std::size_t i, std::mutex& mutex) {
    const TransferJob& job = jobs_[i];
    npt::Mesh pose;
    if (i > 0 || shown_.any()) pose = formats::read_mesh(job.pose);
    const npt::BodyFit found = i == 0 ? first_fit_ : fit(job.pose, pose);
    npt::Mesh result = identity_;
    transfer_->pose(found.axis_angles, result.coordinates());
    npt::recompute_normals(result);
    npt::validate(result, "result for " + job.pose.string());
    npt::write_mesh(job.out, result);
    const std::lock_guard lock(mutex);
    note_fit(found, job.pose.string());
    shown_.add(i, job, std::move(pose), std::move(result));
  }

  void note_fit(const npt::BodyFit& found, const std::string& name) {
    worst_fit_ = std::max(worst_fit_, found.distance);
    if (found.distance <= poor_fit) return;
    char distance[32];
    std::snprintf(distance, sizeof distance, "%.0f mm", 1000 * found.distance);
    notes_.push_back(name + ": the body lies " + distance + " off; the pose may be wrong");
  }

  void write_fitted() const {
    const npt::BodyFit& found = transfer_->fit();
    npt::Mesh mesh = npt::to_mesh(fitter_->model(), found.betas, found.axis_angles);
    for (npt::Vec3f& p : mesh.positions) p += found.translation.as<float>();
    npt::write_mesh(*options_.fitted, mesh);
  }

  std::vector<program::PictureCell> cells(const npt::Mesh& pose, const npt::Mesh& result) const {
    return {{&identity_, "identity", "blue"}, {&pose, "pose", "sand"}, {&result, "result", "blue"}};
  }

  const Options& options_;
  npt::DefaultExecutor executor_;
  std::optional<program::OutputFolder> folder_;
  std::vector<TransferJob> jobs_;
  program::ShownResults shown_;
  std::shared_ptr<const npt::BodyFitter> fitter_;
  std::optional<program::PoseTransfer> estimation_;
  npt::Mesh identity_;
  std::optional<npt::SkeletonTransfer> transfer_;
  npt::BodyFit first_fit_;
  double worst_fit_ = 0;
  std::vector<std::string> notes_;
};

/// The row of Table 7, on seen and on unseen poses.
void run_protocol(const Options& o) {
  const std::shared_ptr<const npt::BodyModel> body = body_of(o);
  std::vector<npt::EvaluationSet> sets = npt::protocol_sets(body, o.protocol.distribution());
  if (o.protocol.first > 0)
    for (npt::EvaluationSet& set : sets) set.count = std::min(set.count, o.protocol.first);
  const auto fitter = std::make_shared<const npt::BodyFitter>(body);
  const npt::DefaultExecutor executor(o.threads);
  program::catch_interrupts();
  program::Progress progress("pairs", sets[0].count + sets[1].count);
  std::mutex mutex;
  const program::Stopwatch watch;
  std::vector<npt::Evaluation> evaluations;
  evaluations.reserve(sets.size());
  for (const npt::EvaluationSet& set : sets)
    evaluations.push_back(npt::evaluate(set, npt::skeleton_system(fitter), executor, [&] {
      program::stop_if_interrupted();
      const std::lock_guard lock(mutex);
      progress.advance();
    }));
  progress.clear();
  const std::string name = o.body ? o.body->filename().string() : "mannequin";
  program::print_protocol(o.protocol, evaluations,
                          {{"system", "skeleton-driven transfer"}, {"data", "the paper's protocol on " + name}},
                          "skeleton-driven transfer on the paper's protocol on " + name, watch.seconds());
}

void run(const Options& options) {
  if (options.protocol.asked_for) return run_protocol(options);
  if (!(options.identity && options.pose && options.out))
    throw CLI::RequiredError("--identity, --pose and --out, or --protocol");
  Skeleton(options).run();
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  CLI::Option* identity =
      command.add_option("--identity", o->identity, "Pose this mesh, the target character (.ply, .obj, .glb)");
  command.add_option("--pose", o->pose, "Take the pose from this mesh, or from each mesh of this folder");
  command.add_option(
      "-o,--out", o->out,
      "Write the result to this file (.ply, .obj, .glb), or results of a folder of poses to this folder");
  command.add_option("--body", o->body, "Fit this body model (.safetensors) (default: the built-in mannequin)");
  command.add_option("--fitted", o->fitted, "Also write the body as it was fitted to the identity (.ply, .obj, .glb)");
  command.add_option("--format", o->format, "Write results in a folder in this format (default: the identity's)")
      ->check(CLI::IsMember({"ply", "obj"}));
  command.add_option("--render", o->picture, "Also draw identity, pose and result (.png)");
  command.add_option("--view", o->page, "Also write a page that shows them in a browser (.html)");
  command.add_option("--threads", o->threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  program::add_protocol_options(command, o->protocol, identity);
  command.footer(
      "Meshes need faces and the body model's unit, metres. Vertex counts and orders are free, and no\n"
      "markers are needed.\n"
      "RMS and PMD are those of npt evaluate, bounding boxes centred.");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("skeleton", "Give one mesh the joint angles of another, by a fitted body model",
                                     add);

}  // namespace skeleton_command
