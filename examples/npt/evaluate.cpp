/// npt evaluate: how far a network's results are from the truth, on the paper's protocol, fresh pairs of a body, a
/// family of meshes, rigged characters, or files. Pairs take the way of `npt transfer`.
#include "arguments.hpp"
#include "evaluation_report.hpp"
#include "interrupt.hpp"
#include "motion_evaluation.hpp"
#include "open_transfer.hpp"
#include "pose_option.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "result_files.hpp"
#include "rig_arguments.hpp"
#include "sequence_evaluation.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"
#include "transfer_arguments.hpp"

#include <render/colour.hpp>
#include <view/page.hpp>

#include <npt/base/default_executor.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/proportions.hpp>
#include <npt/io/file.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/lab/clothes.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/family.hpp>
#include <npt/lab/family_file.hpp>
#include <npt/lab/pair_files.hpp>
#include <npt/lab/rig/rig_sampler.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace evaluate_command {

namespace fs = std::filesystem;

struct Options {
  program::TransferArguments transfer;
  std::optional<fs::path> body, list, family, page, write, results;
  bool protocol = false, json = false, proportions = false, clothes = false;
  std::size_t pairs = 0, first = 0, worst = 0;
  std::string shapes = "normal", poses = "paper";
  std::vector<std::string> held_out;
  std::vector<std::string> rigs, pose_rigs;
  std::vector<fs::path> motion;  ///< source, target
  std::optional<std::string> motion_clip;
  bool plain_motion = false;
  std::optional<fs::path> joint_names;
  double noise = 0;
  std::size_t sequences = 0, frames = 30;
  bool fresh_choices = false;
};

/// What the network is evaluated on, and how to say so.
struct Data {
  std::string name;
  std::vector<npt::EvaluationSet> sets;

  /// Pairs of the sets before number `set`; of all sets behind the last one.
  std::size_t pairs_before(std::size_t set) const {
    std::size_t pairs = 0;
    for (const npt::EvaluationSet& other : std::span(sets).first(set)) pairs += other.count;
    return pairs;
  }
};

std::shared_ptr<const npt::BodyModel> body_of(const Options& o) {
  return o.body ? std::make_shared<const npt::BodyModel>(npt::load_body(*o.body)) : npt::borrowed(npt::mannequin());
}
npt::ShapeDistribution distribution_of(const Options& o) {
  return o.shapes == "uniform" ? npt::ShapeDistribution::uniform : npt::ShapeDistribution::normal;
}
std::string body_name(const Options& o) { return o.body ? o.body->filename().string() : "mannequin"; }

/// The body with the proportions and clothes that are asked for.
std::shared_ptr<const npt::BodyModel> changed_body(std::shared_ptr<const npt::BodyModel> body, const Options& o) {
  if (o.proportions) body = std::make_shared<const npt::BodyModel>(npt::with_proportions(*body));
  if (o.clothes) body = std::make_shared<const npt::BodyModel>(npt::with_clothes(*body));
  return body;
}

Data body_data(const Options& o) {
  const auto body = body_of(o);
  const auto distribution = distribution_of(o);
  const std::string name = body_name(o);
  if (o.pairs == 0) return {"the paper's protocol on " + name, npt::protocol_sets(body, distribution)};
  const std::uint64_t seed = o.transfer.options.seed;
  const auto poses = program::pose_distribution(o.poses);
  const std::string of = (o.poses == "paper" ? "fresh pairs" : "fresh pairs in " + o.poses + " poses") +
                         (o.proportions ? " and random proportions of " : " of ");
  const std::size_t shapes = body->shape_count();
  std::vector<npt::BodyPair> pairs = o.proportions
                                         ? npt::fresh_character_pairs(o.pairs, seed, shapes, distribution, poses)
                                         : npt::fresh_pairs(o.pairs, seed, shapes, distribution, poses);
  return {of + (o.clothes ? "the dressed " : "") + name + ", seed " + std::to_string(seed),
          {npt::body_pairs(changed_body(body, o), std::move(pairs), "fresh pairs", seed)}};
}

/// Identities from --rig; pose meshes from --pose-rig, or from the same without.
Data rig_data(const Options& o) {
  std::vector<npt::WeightedRig> members;
  npt::RigRoles roles;
  /// Adds rigs and their places in `members` to `role`; their names.
  const auto add = [&](const std::vector<program::NamedRig>& rigs, std::vector<std::size_t>& role) {
    std::string names;
    for (const program::NamedRig& named : rigs) {
      names += (names.empty() ? "" : ", ") + named.name;
      role.push_back(members.size());
      members.push_back({std::make_shared<const npt::RigCharacter>(named.rig), named.weight});
    }
    return names;
  };
  std::vector<program::NamedRig> rigs = program::load_rigs(o.rigs),
                                 pose_rigs = program::load_rigs(o.pose_rigs, "--pose-rig");
  program::rename_joints(o.joint_names, {&rigs, &pose_rigs});
  Data data{add(rigs, roles.identities), {}};
  roles.poses = roles.identities;
  if (!o.pose_rigs.empty()) {
    roles.poses.clear();
    data.name += " in the poses of " + add(pose_rigs, roles.poses);
  }
  const auto mixture = std::make_shared<const npt::RigMixture>(std::move(members), o.held_out);
  constexpr std::size_t usual = 64;
  data.sets = {npt::rig_pairs(mixture, o.pairs == 0 ? usual : o.pairs, o.transfer.options.seed, roles)};
  return data;
}

Data load_data(const Options& o) {
  Data data;
  if (o.list) {
    data = {o.list->string(), {npt::file_pairs(*o.list)}};
  } else if (o.family) {
    const auto family = std::make_shared<const npt::Family>(npt::load_family(*o.family));
    data = {"species of " + o.family->string(),
            {npt::family_pairs(family, o.held_out, o.pairs, o.transfer.options.seed)}};
  } else if (!o.rigs.empty()) {
    data = rig_data(o);
  } else {
    data = body_data(o);
  }
  for (npt::EvaluationSet& set : data.sets) {
    set = npt::with_noise(std::move(set), o.noise, o.transfer.options.seed);
    if (o.first > 0) set.count = std::min(set.count, o.first);
  }
  return data;
}

/// Pairs run side by side, each on one thread: no barrier inside a network costs anything then. A single pair gets all
/// threads. Each running pair has a workspace of its own (112 MB at 6890 vertices and bottleneck 1024), hence the
/// limit.
int side_by_side(int threads, std::size_t pairs) {
  constexpr std::size_t most = 16;
  const std::size_t available =
      threads > 0 ? static_cast<std::size_t>(threads) : std::max(1U, std::thread::hardware_concurrency());
  return static_cast<int>(std::min({available, pairs, most}));
}

void transfer_pair(const program::PoseTransfer& transfer, const npt::EvaluationPair& pair, std::span<float> result) {
  try {
    transfer(npt::MeshView{pair.identity, pair.identity_triangles, "identity"},
             npt::MeshView{pair.pose, pair.pose_triangles, "pose"}, result);
  } catch (const npt::Error& error) {
    throw npt::Error({.file = pair.name, .place = error.what(), .code = error.code(), .remedy = error.remedy()});
  }
}

npt::Mesh mesh_of(std::span<const float> xyz, std::span<const npt::Triangle> triangles) {
  npt::Mesh mesh;
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) mesh.positions.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  npt::set_faces(mesh, triangles);
  return mesh;
}

/// Identity, pose, result by its error, and truth.
view::Group page_group(const std::string& set, const npt::PairErrors& errors, const npt::EvaluationPair& pair,
                       std::span<const float> result) {
  char pmd[32];
  std::snprintf(pmd, sizeof pmd, "%.2fe-4", 1e4 * errors.pmd);
  const auto mesh = [&](std::span<const float> xyz) { return mesh_of(xyz, pair.identity_triangles); };
  view::Group group{set + ", " + errors.name + ", PMD " + pmd, {}};
  group.panels = {view::mesh_panel("identity", mesh(pair.identity)),
                  view::mesh_panel("pose", mesh_of(pair.pose, pair.pose_triangles)),
                  view::mesh_panel("result", mesh(result)), view::mesh_panel("ground truth", mesh(pair.truth))};
  const char* colours[] = {"blue", "sand", "blue", "green"};
  for (std::size_t i = 0; i < group.panels.size(); ++i)
    group.panels[i].colour = render::parse_colour(colours[i], "view");
  group.panels[2].detail = std::string("PMD ") + pmd;
  view::add_errors(group.panels[2], mesh(pair.truth), "result", "ground truth");
  return group;
}

/// The pairs of all sets as files, and list.txt, which --list takes.
void write_pairs(const fs::path& folder, const Data& data) {
  program::expect_folder_name(folder, "a folder for the pairs");
  const program::OutputFolder made(folder);
  std::string list;
  std::size_t number = 0;
  for (const npt::EvaluationSet& set : data.sets) {
    list += "# " + set.name + '\n';
    for (std::size_t i = 0; i < set.count; ++i, ++number) {
      program::stop_if_interrupted();
      const npt::EvaluationPair pair = set.pair(i);
      const std::string stem = program::pair_number(number);
      const auto write = [&](const char* part, std::span<const float> xyz, std::span<const npt::Triangle> triangles) {
        const std::string name = stem + '_' + part + ".ply";
        npt::write_mesh(folder / name, mesh_of(xyz, triangles));
        list += name + (std::string_view(part) == "truth" ? '\n' : ' ');
      };
      write("identity", pair.identity, pair.identity_triangles);
      write("pose", pair.pose, pair.pose_triangles);
      write("truth", pair.truth, pair.identity_triangles);
    }
  }
  npt::write_file(folder / "list.txt", list);
}

/// The result of a pair, by its number in all sets.
using ResultOf = std::function<void(std::size_t number, const npt::EvaluationPair& pair, std::span<float> result)>;

/// The worst pairs of all sets as a page, each made or read once more.
void write_page(const Options& o, const Data& data, const std::vector<npt::Evaluation>& evaluations,
                const ResultOf& result_of) {
  view::Page page;
  page.title = "worst of " + data.name;
  for (std::size_t s = 0; s < evaluations.size(); ++s)
    for (const std::size_t i : evaluations[s].worst(o.worst)) {
      program::stop_if_interrupted();
      const npt::PairErrors& errors = evaluations[s].pairs[i];
      const npt::EvaluationPair pair = data.sets[s].pair(errors.number);
      std::vector<float> result(pair.identity.size());
      result_of(data.pairs_before(s) + errors.number, pair, result);
      page.groups.push_back(page_group(evaluations[s].name, errors, pair, result));
    }
  view::write_page(*o.page, page);
}

/// Errors of the results of all pairs, several at a time.
std::vector<npt::Evaluation> evaluate(const Data& data, const ResultOf& result_of,
                                      const npt::DefaultExecutor& executor) {
  program::catch_interrupts();
  program::Progress progress("pairs", data.pairs_before(data.sets.size()));
  std::mutex mutex;
  std::vector<npt::Evaluation> evaluations;
  for (std::size_t s = 0; s < data.sets.size(); ++s) {
    const auto made = [&result_of, before = data.pairs_before(s)](std::size_t i, const npt::EvaluationPair& pair,
                                                                  std::span<float> result) {
      program::stop_if_interrupted();
      result_of(before + i, pair, result);
    };
    evaluations.push_back(npt::evaluate(data.sets[s], made, executor, [&] {
      const std::lock_guard lock(mutex);
      progress.advance();
    }));
  }
  return evaluations;
}

/// Sequences instead of pairs: errors and jitter, result and truth.
void run_sequences(Options o) {
  const npt::SequenceSet set = npt::body_sequences(body_of(o), o.sequences, o.frames, o.transfer.options.seed,
                                                   distribution_of(o), program::pose_distribution(o.poses));
  const program::PoseTransfer transfer = program::open_transfer(o.transfer);
  program::catch_interrupts();
  program::Progress progress("frames", set.count * set.frames);
  const program::Stopwatch watch;
  const std::vector<npt::SequenceErrors> sequences =
      program::evaluate_sequences(set, transfer, o.fresh_choices, [&progress] {
        progress.advance();
        program::stop_if_interrupted();
      });
  progress.clear();
  const program::SequenceMeans means = program::means_of(sequences);
  const std::string data = std::to_string(set.count) + " sequences " +
                           (o.poses == "paper" ? "" : "in " + o.poses + " poses ") + "of " + body_name(o);
  if (o.json) {
    const program::Report report{{"network", transfer.description()},
                                 {"data", data},
                                 {"frames", set.frames},
                                 {"fresh_choices", o.fresh_choices},
                                 {"pmd", means.pmd},
                                 {"pmd_per_coordinate", means.pmd / 3},
                                 {"root_mm", npt::root_pmd_mm(means.pmd)},
                                 {"edge_error", means.edge_error},
                                 {"jitter_mm", 1000 * means.jitter},
                                 {"true_jitter_mm", 1000 * means.true_jitter},
                                 {"seconds", watch.seconds()}};
    std::cout << report.dump(-1, ' ', false, program::Report::error_handler_t::replace) << '\n';
    return;
  }
  std::printf("%s on %s, %zu frames each\n", transfer.description().c_str(), data.c_str(), set.frames);
  std::printf("%-18s %9s %11s %11s %10s %13s\n", "", "RMS mm", "PMD x 1e-4", "edge error", "jitter mm", "true jitter");
  std::printf("%-18s %9.2f %11.3f %11.4f %10.3f %13.3f\n", set.name.c_str(), npt::root_pmd_mm(means.pmd),
              1e4 * means.pmd, means.edge_error, 1000 * means.jitter, 1000 * means.true_jitter);
  std::printf("%.1f s\n", watch.seconds());
  std::fflush(stdout);
}

/// Errors    CLI::ExcludesError for options that change nothing about results of another method
void expect_no_transfer(const std::vector<CLI::Option*>& of_transfer) {
  for (const CLI::Option* option : of_transfer)
    if (option->count() > 0 && option->get_name() != "--threads")
      throw CLI::ExcludesError("--results", option->get_name());
}

void run(Options o) {
  if (!o.motion.empty())
    return program::evaluate_motions(o.motion[0], o.motion[1], o.motion_clip, o.plain_motion, o.json);
  if (!o.held_out.empty() && !o.family && o.rigs.empty()) throw CLI::RequiresError("--held-out", "--family or --rig");
  if (o.sequences > 0) return run_sequences(std::move(o));
  if (o.page) {
    static constexpr std::array<std::string_view, 2> html{".html", ".htm"};
    program::expect_extension(*o.page, html);
    std::vector<fs::path> inputs;
    for (const auto& file : {o.list, o.body})
      if (file) inputs.push_back(*file);
    program::check_output(*o.page, inputs);
  }
  const Data data = load_data(o);
  if (o.write) write_pairs(*o.write, data);
  const std::size_t pairs = data.pairs_before(data.sets.size());
  std::optional<program::PoseTransfer> transfer;
  std::optional<program::ResultFiles> results;
  const program::Stopwatch watch;
  const npt::DefaultExecutor executor(side_by_side(o.transfer.threads, pairs));
  if (executor.slots() > 1) o.transfer.threads = 1;
  if (o.results)
    results.emplace(*o.results, pairs);
  else
    transfer.emplace(program::open_transfer(o.transfer));
  const ResultOf result_of = [&](std::size_t number, const npt::EvaluationPair& pair, std::span<float> result) {
    if (results)
      results->read(number, pair, result);
    else
      transfer_pair(*transfer, pair, result);
  };
  const std::vector<npt::Evaluation> evaluations = evaluate(data, result_of, executor);
  if (results)
    for (const std::string& note : results->notes()) std::cerr << "npt: note: " << note << '\n';
  const std::string network = results ? "results in " + o.results->string() : transfer->description();
  if (o.page) write_page(o, data, evaluations, result_of);
  if (o.json) {
    program::Report report{{"network", network}, {"data", data.name}, {"noise", o.noise}};
    for (const npt::Evaluation& e : evaluations) report["sets"].push_back(program::report_of(e, o.worst));
    report["seconds"] = watch.seconds();
    std::cout << report.dump(-1, ' ', false, program::Report::error_handler_t::replace) << '\n';
    return;
  }
  std::printf("%s on %s\n", network.c_str(), data.name.c_str());
  program::print_table(evaluations, o.worst);
  std::printf("%.1f s\n", watch.seconds());
  std::fflush(stdout);
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  program::add_transfer_options(command, o->transfer);
  const std::vector<CLI::Option*> of_transfer = command.get_options();
  CLI::Option* body = command.add_option(
      "--body", o->body,
      "Make pairs of this body model (.safetensors, SMPL's layout) (default: the built-in mannequin)");
  CLI::Option* protocol =
      command.add_flag("--protocol", o->protocol,
                       "Measure on the paper's 72 pairs in seen and 72 in unseen poses, as without another set");
  CLI::Option* pairs = command
                           .add_option("--pairs", o->pairs,
                                       "Measure on this many fresh pairs of the body instead; with --family on at most "
                                       "this many; with --rig on this many (default: 64 with --rig)")
                           ->check(CLI::Range(1, 1000000))
                           ->excludes(protocol);
  CLI::Option* list =
      command
          .add_option(
              "--list", o->list,
              "Measure on the pairs of this list instead, with lines of: identity pose truth; names are relative to it")
          ->excludes(protocol)
          ->excludes(body)
          ->excludes("--pairs");
  command.add_option("--family", o->family, "Measure on this folder of species with labelled poses instead")
      ->excludes(protocol)
      ->excludes(body)
      ->excludes(list);
  CLI::Option* rig =
      command
          .add_option("--rig", o->rigs,
                      "Measure on rigged characters in frames of each other's clips instead (.glb, .gltf, .fbx, .dae; "
                      "may be repeated); errors are in squares of the longest side of the identity in its bind pose")
          ->type_name("PATH")
          ->excludes(protocol)
          ->excludes(body)
          ->excludes(list)
          ->excludes("--family");
  command
      .add_option("--pose-rig", o->pose_rigs, "Take the pose meshes from these characters instead (may be repeated)")
      ->type_name("PATH")
      ->needs(rig);
  command
      .add_option("--joint-names", o->joint_names,
                  "Rename joints by this file, with lines of: joint other_name, below [RIG] for one rig only, so that "
                  "rigs share poses")
      ->needs(rig);
  command
      .add_option("--held-out", o->held_out,
                  "Measure on this label of --family (or its part before _), or on this clip of the rigs (may be "
                  "repeated, or a list: Walk,Death)")
      ->type_name("LABEL")
      ->delimiter(',');
  command
      .add_option("--noise", o->noise,
                  "Add normal noise of this standard deviation, in metres, to the pose mesh's coordinates")
      ->capture_default_str();
  command.add_option("--first", o->first, "Measure on the first N pairs of each set only")
      ->check(CLI::Range(1, 1000000));
  CLI::Option* worst =
      command.add_option("--worst", o->worst, "Also list this many of the worst pairs")->check(CLI::Range(0, 1000000));
  command
      .add_option("--view", o->page,
                  "Also write a page that shows the worst pairs in a browser, errors as colours (.html)")
      ->needs(worst);
  command.add_option("--write", o->write, "Also write the pairs' meshes into this folder, with list.txt for --list");
  CLI::Option* results =
      command
          .add_option(
              "--results", o->results,
              "Score the meshes of this folder, the results of another method, instead of npt's: 0000_result.ply and "
              "so on, with the numbers of --write and the identity's vertices in its order, unit and place")
          ->excludes("--write");
  CLI::Option* sequences =
      command
          .add_option("--sequences", o->sequences,
                      "Measure errors and jitter on this many movements of the body instead, 72 at most")
          ->check(CLI::Range(1, 72))
          ->excludes(protocol)
          ->excludes("--pairs")
          ->excludes(list)
          ->excludes("--family")
          ->excludes(rig)
          ->excludes("--noise")
          ->excludes("--first")
          ->excludes("--worst")
          ->excludes("--write")
          ->excludes(results);
  command.add_option("--frames", o->frames, "Give each sequence this many frames")
      ->check(CLI::Range(3, 100000))
      ->needs(sequences)
      ->capture_default_str();
  command
      .add_flag("--fresh-choices", o->fresh_choices, "Choose points and pairings anew for every frame of a sequence")
      ->needs(sequences);
  CLI::Option* motion =
      command
          .add_option("--motion", o->motion,
                      "Measure the clips of the first file on the skeleton of the second instead: joints against its "
                      "own clips of the same names, feet that slide or sink, arms inside the trunk")
          ->type_name("PATH PATH")
          ->expected(2)
          ->excludes(protocol)
          ->excludes("--pairs")
          ->excludes(list)
          ->excludes("--family")
          ->excludes(rig)
          ->excludes(sequences);
  command.add_option("--motion-clip", o->motion_clip, "Measure this clip of --motion only")->needs(motion);
  command
      .add_flag("--plain-motion", o->plain_motion,
                "Leave out the corrections of --motion: rotations from joint to joint and scaled hips")
      ->needs(motion);
  command
      .add_option("--shapes", o->shapes,
                  "Draw the body's shape parameters from a normal distribution, or uniformly from -4 to 4")
      ->check(CLI::IsMember({"normal", "uniform"}))
      ->capture_default_str()
      ->excludes(list)
      ->excludes("--family")
      ->excludes(rig);
  command
      .add_option("--poses", o->poses,
                  "Draw poses of --pairs and --sequences from the paper's ranges (paper, its Table 6), from wider ones "
                  "(wide: running, sitting, reaching), or natural ones in any direction (natural)")
      ->check(CLI::IsMember({"paper", "wide", "natural"}))
      ->capture_default_str()
      ->excludes(list)
      ->excludes("--family")
      ->excludes(rig);
  command
      .add_flag("--proportions", o->proportions,
                "Give every mesh of --pairs proportions of its own, as characters have: heads, limbs, girths")
      ->needs(pairs)
      ->excludes("--family");
  command
      .add_flag("--clothes", o->clothes,
                "Dress every mesh of --pairs in a shirt, shorts, shoes and hair, each a separate component")
      ->needs(pairs)
      ->excludes("--family");
  command
      .add_option("--seed", o->transfer.options.seed,
                  "Draw pairs, noise, pairings, points and random weights from this seed")
      ->check(program::whole_number())
      ->capture_default_str();
  command.add_flag("--json", o->json, "Print one line of JSON");
  command.footer(
      "RMS mm is the root mean square distance of vertices in millimetres, with bounding boxes centred. PMD\n"
      "is its square in square metres (eq. 7 of the paper); per coordinate, a third of it, is what the\n"
      "paper's public evaluation computes. Edge error is the mean of |length / true length - 1|. In place\n"
      "is the PMD of results where the method puts them, uncentred. Jitter is the mean length of\n"
      "x(f + 1) - 2 x(f) + x(f - 1) over vertices and frames f.");
  command.callback([o, of_transfer, &command] {
    if (o->results) expect_no_transfer(of_transfer);
    if (command.count("--poses") > 0 && o->pairs == 0 && o->sequences == 0)
      throw CLI::RequiresError("--poses", "--pairs or --sequences: the protocol has poses of its own");
    run(*o);
  });
}

const program::Subcommand registered("evaluate", "Measure errors against a ground truth", add);

}  // namespace evaluate_command
