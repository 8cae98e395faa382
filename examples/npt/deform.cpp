/// npt deform: deformation transfer (Sumner and Popovic 2004), with markers instead of a network. A target in rest gets
/// the poses of a source whose rest mesh is known. Or, with --protocol, its error on the paper's pairs.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "progress.hpp"
#include "protocol_arguments.hpp"
#include "shown_results.hpp"
#include "status_line.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"
#include "transfer_jobs.hpp"
#include "transfer_picture.hpp"

#include <formats/read.hpp>
#include <npt/baseline/deformation/control_points.hpp>
#include <npt/baseline/deformation/correspondence.hpp>
#include <npt/baseline/deformation/deformation_evaluation.hpp>
#include <npt/baseline/deformation/deformation_transfer.hpp>
#include <npt/baseline/deformation/markers.hpp>
#include <npt/body/body_file.hpp>

#include <npt/base/default_executor.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/validate.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace deform_command {

namespace fs = std::filesystem;
using program::TransferJob;

struct Options {
  std::optional<fs::path> source, pose, target, out, markers, source_body, target_body, registered, picture, page, body;
  std::optional<std::string> format;
  std::vector<std::size_t> control_points;
  bool align = false, open_seams = false;
  program::ProtocolArguments protocol;
  std::string third = "rest";
  int threads = 0;
};

npt::BodyModel body_of(const std::optional<fs::path>& file) {
  return file ? npt::load_body(file->string()) : npt::make_mannequin();
}

class Deform {
 public:
  explicit Deform(const Options& options)
      : options_(options),
        executor_(options.threads),
        jobs_(program::pose_jobs(*options.target, *options.pose, *options.out, options.format, folder_)),
        shown_(options.picture, options.page, jobs_, {*options.source}, options.registered,
               [this](const npt::Mesh& pose, const npt::Mesh& result) { return cells(pose, result); }) {
    program::check_outputs_apart(jobs_);
    for (const TransferJob& job : jobs_) {
      program::check_job(job);
      program::check_output(job.out, std::array{*options_.source});
    }
  }

  void run() {
    program::catch_interrupts();
    source_ = formats::read_mesh(*options_.source);
    target_ = formats::read_mesh(*options_.target);
    const npt::DeformationTransfer transfer = prepare();
    program::Progress progress("poses", jobs_.size());
    const program::Stopwatch watch;
    for (const TransferJob& job : jobs_) {
      program::stop_if_interrupted();
      npt::Mesh pose = formats::read_mesh(job.pose);
      if (pose.vertex_count() != source_.vertex_count())
        throw npt::Error(
            {job.pose.string(),
             {},
             std::to_string(pose.vertex_count()) + " vertices",
             std::to_string(source_.vertex_count()) + ", as many as " + options_.source->string() + " has"});
      npt::Mesh result = npt::deform(transfer, target_, pose, executor_);
      npt::validate(result, "result for " + job.pose.string());
      npt::write_mesh(job.out, result);
      shown_.add(static_cast<std::size_t>(&job - jobs_.data()), job, std::move(pose), std::move(result));
      progress.advance();
    }
    progress.clear();
    std::printf(
        "%s in %.2f s\n",
        jobs_.size() == 1 ? jobs_.front().out.string().c_str() : (std::to_string(jobs_.size()) + " meshes").c_str(),
        watch.seconds());
    shown_.write(options_.target->filename().string() + " in the poses of " + options_.source->filename().string());
  }

 private:
  /// Empty: none were asked for.
  std::vector<npt::Marker> markers() const {
    if (options_.markers) return npt::read_markers(*options_.markers);
    if (options_.control_points.empty()) return {};
    const npt::BodyModel from = body_of(options_.source_body), to = body_of(options_.target_body);
    const auto expect_body = [](const npt::BodyModel& body, const npt::Mesh& mesh, const fs::path& file) {
      if (body.vertex_count() != mesh.vertex_count())
        throw npt::Error({file.string(),
                          {},
                          std::to_string(mesh.vertex_count()) + " vertices",
                          std::to_string(body.vertex_count()) + ", those of its body, for control points"});
    };
    expect_body(from, source_, *options_.source);
    expect_body(to, target_, *options_.target);
    return npt::control_markers(from, to, options_.control_points.front());
  }

  npt::DeformationTransfer prepare() const {
    npt::DeformationTransferOptions options;
    options.weld = !options_.open_seams;
    const std::vector<npt::Marker> list = markers();
    std::vector<npt::TrianglePair> pairs;
    if (!list.empty()) {
      npt::Correspondence found = correspondence(list);
      if (options_.align) options.turn = found.similarity.rotation;
      pairs = std::move(found.pairs);
    } else if (npt::same_topology(source_, target_)) {
      std::printf("faces are the same: paired one to one\n");
      pairs = npt::identical_pairs(npt::triangulate(source_).size());
    } else {
      throw npt::Error({"--markers", {}, "none, and meshes of different faces", "markers, or --control-points"});
    }
    const program::Stopwatch watch;
    npt::DeformationTransfer transfer(source_, target_, pairs, options);
    std::printf("prepared in %.2f s\n", watch.seconds());
    return transfer;
  }

  npt::Correspondence correspondence(const std::vector<npt::Marker>& list) const {
    npt::CorrespondenceOptions options;
    options.weld = !options_.open_seams;
    program::StatusLine status;
    const program::Stopwatch watch;
    double distance = 0;
    npt::Correspondence found = npt::find_correspondence(
        source_, target_, list, options,
        [&](const npt::RegistrationStep& step) {
          program::stop_if_interrupted();
          distance = step.distance;
          if (status.due())
            status.show("correspondence: step " + std::to_string(step.step) + " of " + std::to_string(step.steps));
        },
        executor_);
    status.clear();
    std::printf("%zu markers, %zu triangle pairs, registered to %.3g of the mesh's unit, in %.2f s\n", list.size(),
                found.pairs.size(), distance, watch.seconds());
    if (options_.registered) {
      npt::Mesh registered = source_;
      registered.positions = found.registered;
      npt::recompute_normals(registered);
      npt::validate(registered, "registered source");
      npt::write_mesh(*options_.registered, registered);
    }
    return found;
  }

  std::vector<program::PictureCell> cells(const npt::Mesh& pose, const npt::Mesh& result) const {
    return {{&source_, "source", "sand"},
            {&pose, "deformed source", "sand"},
            {&target_, "target", "blue"},
            {&result, "deformed target", "blue"}};
  }

  const Options& options_;
  npt::DefaultExecutor executor_;
  std::optional<program::OutputFolder> folder_;
  std::vector<TransferJob> jobs_;
  program::ShownResults shown_;
  npt::Mesh source_, target_;
};

/// The rows of Table 1: each number of control points on seen and on unseen poses.
void run_protocol(const Options& o) {
  const npt::BodyModel body = body_of(o.body);
  const npt::ThirdMesh third = o.third == "rest" ? npt::ThirdMesh::rest : npt::ThirdMesh::identity_pose;
  struct Set {
    const char* name;
    std::vector<npt::BodyPair> pairs;
    std::uint64_t seed;
  };
  std::array<Set, 2> sets{Set{"seen poses", npt::seen_pose_pairs(body.shape_count(), o.protocol.distribution()),
                              npt::protocol::seen_pair_seed},
                          Set{"unseen poses", npt::unseen_pose_pairs(body.shape_count(), o.protocol.distribution()),
                              npt::protocol::unseen_pair_seed}};
  if (o.protocol.first > 0)
    for (Set& set : sets) set.pairs.resize(std::min(set.pairs.size(), o.protocol.first));
  const std::vector<std::size_t> counts = o.control_points.empty() ? std::vector<std::size_t>{5, 13} : o.control_points;
  const npt::DefaultExecutor executor(o.threads);
  program::catch_interrupts();
  program::Progress progress("pairs", counts.size() * (sets[0].pairs.size() + sets[1].pairs.size()));
  std::mutex mutex;
  const program::Stopwatch watch;
  std::vector<npt::Evaluation> evaluations;
  for (const std::size_t count : counts)
    for (const Set& set : sets)
      evaluations.push_back(npt::evaluate_deformation(
          body, set.pairs, "DT (" + std::to_string(count) + "), " + set.name, set.seed, count, third, executor, [&] {
            program::stop_if_interrupted();
            const std::lock_guard lock(mutex);
            progress.advance();
          }));
  progress.clear();
  const std::string name = o.body ? o.body->filename().string() : "mannequin";
  program::print_protocol(
      o.protocol, evaluations,
      {{"system", "deformation transfer"}, {"data", "the paper's protocol on " + name}, {"third_mesh", o.third}},
      "deformation transfer on the paper's protocol on " + name + ", third mesh in " +
          (o.third == "rest" ? "rest" : "the identity's pose"),
      watch.seconds());
}

void run(const Options& options) {
  if (options.protocol.asked_for) return run_protocol(options);
  if (!(options.source && options.pose && options.target && options.out))
    throw CLI::RequiredError("--source, --pose, --target and --out, or --protocol");
  if (options.control_points.size() > 1)
    throw CLI::ValidationError("--control-points", "one number, but with --protocol");
  Deform(options).run();
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  CLI::Option* source =
      command.add_option("--source", o->source, "Read the source's rest mesh from this file (.ply, .obj, .glb)");
  command.add_option(
      "--pose", o->pose,
      "Read the deformed source, with the same vertices, from this mesh, or from each mesh of this folder");
  command.add_option("--target", o->target, "Pose this mesh, at rest as the source");
  command.add_option(
      "-o,--out", o->out,
      "Write the result to this file (.ply, .obj, .glb), or results of a folder of poses to this folder");
  CLI::Option* markers = command.add_option(
      "--markers", o->markers,
      "Match source and target by this list, with lines of: source_vertex target_vertex, numbered from 0");
  command
      .add_option(
          "--control-points", o->control_points,
          "Match them by 5 or 13 markers that all bodies in SMPL's layout have, on meshes in their body's vertex order")
      ->check(CLI::IsMember({"5", "13"}))
      ->delimiter(',')
      ->excludes(markers);
  command.add_option(
      "--source-body", o->source_body,
      "Take the source's markers of --control-points from this body model (.safetensors) (default: the mannequin)");
  command.add_option("--target-body", o->target_body, "Take the target's from this one (default: the mannequin)");
  command.add_flag("--align", o->align,
                   "Turn deformations by the markers, for a target that faces another way than the source");
  command.add_flag("--open-seams", o->open_seams, "Keep vertices that lie in one place apart instead of welding them");
  command.add_option("--registered", o->registered, "Also write the source as it was registered onto the target");
  command.add_option("--format", o->format, "Write results in a folder in this format (default: the target's)")
      ->check(CLI::IsMember({"ply", "obj"}));
  command.add_option("--render", o->picture, "Also draw source, pose, target and result (.png)");
  command.add_option("--view", o->page, "Also write a page that shows them in a browser (.html)");
  command.add_option("--threads", o->threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  CLI::Option* protocol = program::add_protocol_options(command, o->protocol, source);
  command.add_option("--body", o->body, "Measure on this body model (.safetensors) (default: the mannequin)")
      ->needs(protocol);
  command
      .add_option("--third-mesh", o->third,
                  "Give the protocol's source and target meshes at rest, or in the identity's pose")
      ->check(CLI::IsMember({"rest", "identity-pose"}))
      ->capture_default_str()
      ->needs(protocol);
  command.footer(
      "Without markers both meshes must have the same faces; they are paired one to one. Source and target\n"
      "should stand in about the same rest pose: what is transferred is the change from it.\n"
      "RMS and PMD are those of npt evaluate, bounding boxes centred.");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("deform", "Give a mesh the poses of another, by deformation gradients", add);

}  // namespace deform_command
