#include "training_arguments.hpp"

#include "arguments.hpp"
#include "precision_option.hpp"
#include "subcommand.hpp"

#include <npt/base/error.hpp>
#include <npt/base/number_text.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

namespace program {

namespace {

constexpr std::string_view option_prefix = "option.";

/// Options that belong to a run and not to the training.
constexpr std::array<std::string_view, 5> run_options{"--help", "--threads", "--out", "--resume", "--overwrite"};
/// Options that a resumed run may change: the training becomes longer or shorter, goes on another machine, or reports
/// otherwise.
constexpr std::array<std::string_view, 2> length_options{"--steps", "--minutes"};
constexpr std::array<std::string_view, 5> report_options{"--checkpoint-every", "--log-every", "--validate-every",
                                                         "--domain", "--precision"};
/// Options that name files which a training reads.
constexpr std::array<std::string_view, 5> input_options{"--body", "--rig", "--joint-names", "--family", "--start"};

template <class List>
bool contains(const List& list, std::string_view name) {
  return std::ranges::find(list, name) != std::end(list);
}

std::string name_of(const CLI::Option& option) { return "--" + option.get_single_name(); }

/// Values on lines of their own.
std::string joined(const std::vector<std::string>& values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i) text += (i == 0 ? "" : "\n") + values[i];
  return text;
}

std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text)
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += c;
  return lines;
}

/// Numbers that are equal are the same text for comparisons.
bool same_value(const std::string& a, const std::string& b) {
  if (a == b) return true;
  double x = 0, y = 0;
  const auto number = [](const std::string& text, double& value) {
    const auto result = npt::number_from_chars(text.data(), text.data() + text.size(), value);
    return result.ec == std::errc() && result.ptr == text.data() + text.size();
  };
  return number(a, x) && number(b, y) && x == y;
}

std::size_t whole_number_of(const std::string& text, const std::string& argument, bool all_allowed) {
  std::size_t value = 0;
  if (all_allowed && text == "all") return 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() || value == 0)
    throw npt::Error(
        {argument, {}, "'" + text + "'", all_allowed ? "a whole number from 1, or all" : "a whole number from 1"});
  return value;
}

StageArguments parse_stage(const std::string& text) {
  const auto fail = [&] {
    throw npt::Error({"--stage", {}, "'" + text + "'", "BEGIN:BATCHxVERTICES, such as 0:60x96 or 0.7:2xall"});
  };
  const std::size_t colon = text.find(':'), cross = text.find('x', colon == std::string::npos ? 0 : colon);
  if (colon == std::string::npos || cross == std::string::npos) fail();
  StageArguments stage;
  const auto begin = std::from_chars(text.data(), text.data() + colon, stage.begin);
  if (begin.ec != std::errc() || begin.ptr != text.data() + colon || !(stage.begin >= 0 && stage.begin < 1)) fail();
  stage.batch = whole_number_of(text.substr(colon + 1, cross - colon - 1), "--stage " + text, false);
  stage.vertices = whole_number_of(text.substr(cross + 1), "--stage " + text, true);
  return stage;
}

CLI::Validator above(double least) {
  return CLI::Validator(
      [least](const std::string& text) {
        double value = 0;
        const auto result = npt::number_from_chars(text.data(), text.data() + text.size(), value);
        const bool good = result.ec == std::errc() && result.ptr == text.data() + text.size() && std::isfinite(value);
        return good && value > least ? std::string() : "'" + text + "' is not a number above " + std::to_string(least);
      },
      "");
}

void add_data_options(CLI::App& command, TrainingArguments& a) {
  command
      .add_option("--body", a.bodies,
                  "Body model to draw shapes and poses from: a file (.safetensors) or mannequin, the default. Several "
                  "are mixed; =WEIGHT behind one gives its share")
      ->group("Data");
  command
      .add_option(
          "--rig", a.rigs,
          "Rigged character (.glb, .gltf, .fbx) in the poses of its clips: of a person beside bodies or instead "
          "of them, of anything else with its like. Several are mixed; =WEIGHT behind one gives its share")
      ->group("Data");
  command
      .add_option("--joint-names", a.joint_names,
                  "File with lines of: joint other_name, below [RIG] for one rig only, so that rigs share poses or are "
                  "known as people")
      ->needs("--rig")
      ->group("Data");
  command.add_option("--family", a.family, "Folder of species with labelled poses instead of bodies")
      ->excludes("--body")
      ->excludes("--rig")
      ->group("Data");
  command
      .add_option("--held-out", a.held_out,
                  "Label of the family (or its part before _), or clip of the rigs, that is kept for validation "
                  "(repeated, or a list: Walk,Death)")
      ->delimiter(',')
      ->group("Data");
  command
      .add_option("--blend", a.blend,
                  "Part of the family's samples whose pose lies between those of two labels, vertex by vertex")
      ->check(CLI::Range(0.0, 1.0))
      ->needs("--family")
      ->group("Data");
  command.add_flag("--mirror", a.mirror, "Mirror half of the family's samples, left for right")
      ->needs("--family")
      ->group("Data");
  command
      .add_option("--shapes", a.shapes,
                  "Distribution of shape parameters: normal, or uniform in -4 .. 4 as in the released data")
      ->check(CLI::IsMember({"normal", "uniform"}))
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--wide-poses", a.wide_poses,
                  "Part of a body's meshes in poses of wider ranges than the paper's: running, sitting, reaching")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--natural-poses", a.natural_poses,
                  "Part of a body's meshes in natural poses, from the prior that npt ships, in any direction")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--clip-poses", a.clip_poses,
                  "Part of people's meshes in poses of the rigs' clips, between two of them, and with noise; without: "
                  "0.25 where there are clips")
      ->check(CLI::Range(0.0, 1.0))
      ->group("Data");
  command
      .add_flag("--protocol", a.protocol, "The paper's 16 identities in 400 poses instead of fresh ones at every step")
      ->excludes("--wide-poses")
      ->excludes("--natural-poses")
      ->group("Data");
  command.add_flag("--mix-bodies", a.mix_bodies, "Identity and pose mesh may come from different bodies")
      ->group("Data");
  command.add_option("--yaw", a.yaw, "Turn identity and pose about the vertical axis by up to this many degrees")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str()
      ->group("Data");
  command.add_option("--scale-range", a.scale_range, "Grow meshes by a factor from this range: LOW,HIGH")
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--noise", a.noise,
                  "Noise on the pose mesh: standard deviation in metres, a draw from 0 to this a mesh")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--normalisation", a.normalisation,
                  "How meshes are brought to the network's frame: sphere, centre or none; without: centre for bodies, "
                  "sphere for families and animals")
      ->check(CLI::IsMember({"sphere", "centre", "none"}))
      ->group("Data");
}

void add_network_options(CLI::App& command, TrainingArguments& a) {
  command
      .add_option(
          "--net", a.variant.net,
          "full; an ablation of the paper: without-spadain (plain residual blocks) or concat1 (1x1 convolutions "
          "only), both with --feature per-vertex --order conv_relu; correspondence: the network that finds where "
          "points belong on a resting body")
      ->check(CLI::IsMember({"full", "without-spadain", "concat1", "correspondence"}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--bottleneck", a.variant.bottleneck, "1024, 512, 256, 128 or 64")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--order", a.variant.order, "conv_relu (the paper) or relu_conv (its code)")
      ->check(CLI::IsMember({"conv_relu", "relu_conv"}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--feature", a.variant.feature, "per-vertex or pooled")
      ->check(CLI::IsMember({"per-vertex", "pooled"}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--output-scale", a.output_scale, "Factor of the final tanh: 1 in the paper, 2 in its code")
      ->check(above(0))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--init", a.init, "First weights: small, released or he")
      ->check(CLI::IsMember({"small", "released", "he"}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--start", a.start, "First weights: those of this file (.safetensors)")->group("Network");
}

void add_course_options(CLI::App& command, TrainingArguments& a) {
  const char* group = "Course";
  command
      .add_option("--minutes", a.minutes, "Length in minutes of training, over all runs; the rate follows the clock")
      ->check(above(0))
      ->group(group);
  command.add_option("--steps", a.steps, "Length in steps; a resumed training ends with the same bits")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 36))
      ->excludes("--minutes")
      ->group(group);
  command
      .add_option("--stage", a.stages,
                  "Part of the training, BEGIN:BATCHxVERTICES, BEGIN from 0 to 1, VERTICES of each mesh at random or "
                  "all; may be repeated. Without: 0:60x96 0.6:24x240 0.85:12x600")
      ->group(group);
  command.add_option("--batch", a.batch, "Meshes in a step, throughout")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1} << 20))
      ->excludes("--stage")
      ->group(group);
  command.add_option("--vertices", a.vertices, "Of each mesh, drawn at random at every use, throughout; or all")
      ->excludes("--stage")
      ->group(group);
  command
      .add_option("--optimiser", a.optimiser,
                  "muon: Muon for the matrices between layers and Adam for the rest; adam: Adam for all (the paper)")
      ->check(CLI::IsMember({"muon", "adam"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--matrix-rate", a.matrix_rate, "Muon's learning rate; follows the same schedule")
      ->check(above(0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--matrix-momentum", a.matrix_momentum, "Muon's")
      ->check(CLI::Range(0.0, 0.9999))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--rate", a.rate,
                  "Adam's learning rate (the paper: 5e-5); without: 6e-3 beside Muon, else 3e-3, for bottlenecks above "
                  "128 less "
                  "as their root grows")
      ->check(above(0))
      ->group(group);
  command.add_option("--schedule", a.schedule, "Of the rate: constant (the paper), or cosine, which falls to its end")
      ->check(CLI::IsMember({"constant", "cosine"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--warm-up", a.warm_up, "Part of the training in which the cosine's rate rises")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--last-rate", a.last_rate, "Part of the rate that is left at the cosine's end")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--clip", a.clip, "Longest gradient; 0: any")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(group);
  command.add_option("--average", a.average, "Decay of the weights' moving average, such as 0.999; 0: none is kept")
      ->check(CLI::Range(0.0, 0.999999))
      ->capture_default_str()
      ->group(group);
  command.add_option("--beta1", a.beta1, "Adam's")
      ->check(CLI::Range(0.0, 0.999999))
      ->capture_default_str()
      ->group(group);
  command.add_option("--beta2", a.beta2, "Adam's")
      ->check(CLI::Range(0.0, 0.9999999))
      ->capture_default_str()
      ->group(group);
  command.add_option("--epsilon", a.epsilon, "Adam's")->check(above(0))->capture_default_str()->group(group);
  command.add_option("--loss-scaling", a.loss_scaling, "sum (eq. 5 and 6) or mean (the released code)")
      ->check(CLI::IsMember({"sum", "mean"}))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--edge-loss", a.edge_loss,
                  "none, length (eq. 6) or relative (the released code); counts where samples are whole meshes")
      ->check(CLI::IsMember({"none", "length", "relative"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--edge-weight", a.edge_weight, "Weight of the edge loss")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(group);
  command.add_option("--seed", a.seed, "Of the samples and the first weights")
      ->check(whole_number())
      ->capture_default_str()
      ->group(group);
}

void add_run_options(CLI::App& command, TrainingArguments& a) {
  const char* group = "Run";
  command
      .add_option(
          "-o,--out", a.out,
          "Weights to write (W.safetensors); beside them come W.checkpoint.safetensors, W.log.csv and W.log.png")
      ->required()
      ->group(group);
  command.add_flag("--resume", a.resume, "Go on from the checkpoint beside --out, with the options it began with")
      ->group(group);
  command.add_flag("--overwrite", a.overwrite, "Begin anew where a checkpoint of an earlier training stands")
      ->excludes("--resume")
      ->group(group);
  add_precision_option(command, a.precision)->group(group);
  command.add_option("--threads", a.threads, "Threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str()
      ->group(group);
  command.add_option("--checkpoint-every", a.checkpoint_every, "Steps between checkpoints; 0: about a minute")
      ->capture_default_str()
      ->group(group);
  command.add_option("--validate-every", a.validate_every, "Steps between validations; 0: twenty in all")
      ->capture_default_str()
      ->group(group);
  command.add_option("--log-every", a.log_every, "Steps between rows of the log")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 36))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--validation-pairs", a.validation_pairs,
                  "Pairs of unseen identities and poses in a validation; four times as many at the end; 0: none")
      ->check(CLI::Range(std::size_t{0}, std::size_t{100000}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--domain", a.domain, "What the weights are for, such as human: goes into their metadata")
      ->group(group);
}

/// What an option is set to; nothing where it neither was given nor has a default.
std::vector<std::string> values_of(const CLI::Option& option) {
  if (option.count() > 0) {
    if (option.get_expected_max() == 0) return {"true"};  // a flag
    return option.results();
  }
  const std::string value = option.get_default_str();
  return value.empty() ? std::vector<std::string>{} : std::vector<std::string>{value};
}

}  // namespace

std::vector<StageArguments> parse_stages(const TrainingArguments& arguments) {
  std::vector<StageArguments> stages;
  if (arguments.batch || arguments.vertices) {
    const std::size_t vertices = arguments.vertices ? whole_number_of(*arguments.vertices, "--vertices", true) : 120;
    stages.push_back({0, arguments.batch.value_or(vertices == 0 ? 8 : 48), vertices});
    return stages;
  }
  if (arguments.stages.empty() && arguments.variant.net == "correspondence")
    return {{0, 48, 128}, {0.35, 20, 320}, {0.75, 6, 1000}};
  if (arguments.stages.empty()) return {{0, 60, 96}, {0.6, 24, 240}, {0.85, 12, 600}};
  for (const std::string& text : arguments.stages) stages.push_back(parse_stage(text));
  return stages;
}

double learning_rate(const TrainingArguments& arguments) {
  if (arguments.rate) return *arguments.rate;
  const double narrow = arguments.optimiser == "muon" ? 6e-3 : 3e-3;
  return narrow * std::sqrt(128.0 / std::max(128, arguments.variant.bottleneck));
}

void add_training_options(CLI::App& command, TrainingArguments& arguments) {
  add_data_options(command, arguments);
  add_network_options(command, arguments);
  add_course_options(command, arguments);
  add_run_options(command, arguments);
}

npt::Metadata stored_options(const CLI::App& command) {
  npt::Metadata stored;
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = name_of(*option);
    if (contains(run_options, name)) continue;
    if (const auto values = values_of(*option); !values.empty())
      stored[std::string(option_prefix) + name.substr(2)] = joined(values);
  }
  return stored;
}

void restore_options(CLI::App& command, const npt::Metadata& stored, const std::string& file) {
  for (CLI::Option* option : command.get_options()) {
    const std::string name = name_of(*option);
    if (contains(run_options, name)) continue;
    const auto found = stored.find(std::string(option_prefix) + name.substr(2));
    if (option->count() > 0) {
      if (contains(length_options, name) || contains(report_options, name)) continue;
      const std::string given = joined(values_of(*option));
      if (found == stored.end() || !same_value(given, found->second))
        throw npt::Error({name,
                          {},
                          "'" + given + "'",
                          (found == stored.end() ? "nothing" : "'" + found->second + "'") +
                              ", with which the training in " + file + " began (it may be left out)"});
      continue;
    }
    if (found == stored.end()) continue;
    // A length in steps replaces one in minutes and the other way round.
    if (contains(length_options, name) && std::ranges::any_of(length_options, [&](std::string_view other) {
          return other != name && command.get_option(std::string(other))->count() > 0;
        }))
      continue;
    try {
      for (const std::string& value : split_lines(found->second)) option->add_result(value);
      option->run_callback();
    } catch (const CLI::Error& error) {
      throw npt::Error({file, "metadata " + found->first, "'" + found->second + "' (" + error.what() + ")",
                        "what " + name + " takes"});
    }
  }
}

std::string command_text(const CLI::App& command) {
  std::string text = "npt train";
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = name_of(*option);
    if (option->count() == 0 || contains(run_options, name) || contains(report_options, name)) continue;
    if (option->get_expected_max() == 0) {
      text += " " + name;
      continue;
    }
    for (const std::string& value : option->results()) {
      const std::string shown =
          contains(input_options, name) ? std::filesystem::path(value).filename().string() : value;
      text += " " + name + " " + (shown.find(' ') == std::string::npos ? shown : "\"" + shown + "\"");
    }
  }
  return text;
}

}  // namespace program
