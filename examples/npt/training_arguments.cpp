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
                  "Draw shapes and poses from this body model, a file (.safetensors) or mannequin; several are mixed, "
                  "=WEIGHT behind one gives its share (default: mannequin)")
      ->type_name("BODY")
      ->group("Data");
  command
      .add_option(
          "--rig", a.rigs,
          "Draw samples from this rigged character (.glb, .gltf, .fbx) in the poses of its clips: people beside bodies "
          "or instead of them, anything else with its like; several are mixed, =WEIGHT behind one gives its share")
      ->type_name("PATH")
      ->group("Data");
  command
      .add_option("--joint-names", a.joint_names,
                  "Rename joints by this file, with lines of: joint other_name, below [RIG] for one rig only, so that "
                  "rigs share poses or are recognised as people")
      ->needs("--rig")
      ->group("Data");
  command
      .add_option("--family", a.family,
                  "Draw samples from this folder of species with labelled poses instead of bodies")
      ->excludes("--body")
      ->excludes("--rig")
      ->group("Data");
  command
      .add_option("--held-out", a.held_out,
                  "Keep this label of the family (or its part before _), or this clip of the rigs, for validation (may "
                  "be repeated, or a list: Walk,Death)")
      ->type_name("LABEL")
      ->delimiter(',')
      ->group("Data");
  command
      .add_option("--blend", a.blend,
                  "Put this fraction of the family's samples between the poses of two labels, vertex by vertex")
      ->check(CLI::Range(0.0, 1.0))
      ->needs("--family")
      ->group("Data");
  command.add_flag("--mirror", a.mirror, "Mirror half of the family's samples, left for right")
      ->needs("--family")
      ->group("Data");
  command
      .add_option("--shapes", a.shapes,
                  "Draw shape parameters from a normal distribution, or uniformly from -4 to 4 as in the released data")
      ->check(CLI::IsMember({"normal", "uniform"}))
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--wide-poses", a.wide_poses,
                  "Put this fraction of a body's meshes into wider ranges of poses than the paper's: running, sitting, "
                  "reaching")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--natural-poses", a.natural_poses,
                  "Put this fraction of a body's meshes into natural poses, in any direction")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--clip-poses", a.clip_poses,
                  "Put this fraction of people's meshes into poses of the rigs' clips, between two of them, and with "
                  "noise (default: 0.25 where there are clips)")
      ->check(CLI::Range(0.0, 1.0))
      ->group("Data");
  command
      .add_flag("--protocol", a.protocol,
                "Train on the paper's 16 identities in 400 poses instead of fresh ones at every step")
      ->excludes("--wide-poses")
      ->excludes("--natural-poses")
      ->group("Data");
  command.add_flag("--mix-bodies", a.mix_bodies, "Take identity and pose mesh from different bodies, too")
      ->group("Data");
  command.add_option("--yaw", a.yaw, "Turn identity and pose about the vertical axis by up to this many degrees")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str()
      ->group("Data");
  command.add_option("--scale-range", a.scale_range, "Scale meshes by a factor from this range: LOW,HIGH")
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--noise", a.noise,
                  "Add normal noise to the pose mesh: each mesh draws a standard deviation from 0 to this, in metres")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group("Data");
  command
      .add_option("--normalisation", a.normalisation,
                  "Bring meshes to the network's coordinates in this way (default: centre for bodies, sphere for "
                  "families and animals)")
      ->check(CLI::IsMember({"sphere", "centre", "none"}))
      ->group("Data");
}

void add_network_options(CLI::App& command, TrainingArguments& a) {
  command
      .add_option("--net", a.variant.net,
                  "Train the paper's network (full); an ablation of it, with plain residual blocks (without-spadain) "
                  "or 1x1 convolutions only (concat1), both with --feature per-vertex --order conv_relu; or the "
                  "network that finds where points belong on a body at rest (correspondence)")
      ->check(CLI::IsMember({"full", "without-spadain", "concat1", "correspondence"}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--bottleneck", a.variant.bottleneck, "Give the pose feature this many channels")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--order", a.variant.order, "Order layers as the paper (conv_relu) or its code (relu_conv)")
      ->check(CLI::IsMember({"conv_relu", "relu_conv"}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--feature", a.variant.feature, "Use this pose feature")
      ->check(CLI::IsMember({"per-vertex", "pooled"}))
      ->capture_default_str()
      ->group("Network");
  command
      .add_option("--output-scale", a.output_scale,
                  "Multiply the network's last tanh by this: 1 in the paper, 2 in its code")
      ->check(above(0))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--init", a.init, "Draw the first weights from this distribution")
      ->check(CLI::IsMember({"small", "released", "he"}))
      ->capture_default_str()
      ->group("Network");
  command.add_option("--start", a.start, "Begin with the weights of this file (.safetensors)")->group("Network");
}

void add_course_options(CLI::App& command, TrainingArguments& a) {
  const char* group = "Course";
  command
      .add_option("--minutes", a.minutes,
                  "Train for this many minutes, over all runs; the learning rate follows the clock")
      ->check(above(0))
      ->group(group);
  command.add_option("--steps", a.steps, "Train for this many steps; a resumed training ends with the same bits")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 36))
      ->excludes("--minutes")
      ->group(group);
  command
      .add_option("--stage", a.stages,
                  "Train one part with BEGIN:BATCHxVERTICES: BEGIN is a fraction of the training, VERTICES of each "
                  "mesh are drawn at random, or all (may be repeated) (default: 0:60x96 0.6:24x240 0.85:12x600)")
      ->group(group);
  command.add_option("--batch", a.batch, "Put this many meshes into every step")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1} << 20))
      ->excludes("--stage")
      ->group(group);
  command.add_option("--vertices", a.vertices, "Draw this many vertices of each mesh at every use, or take all")
      ->excludes("--stage")
      ->group(group);
  command
      .add_option("--optimiser", a.optimiser,
                  "Optimise the matrices between layers with Muon and the rest with Adam (muon), or all with Adam, as "
                  "the paper (adam)")
      ->check(CLI::IsMember({"muon", "adam"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--matrix-rate", a.matrix_rate, "Give Muon this learning rate; it follows the same schedule")
      ->check(above(0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--matrix-momentum", a.matrix_momentum, "Give Muon this momentum")
      ->check(CLI::Range(0.0, 0.9999))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--rate", a.rate,
                  "Give Adam this learning rate; 5e-5 in the paper (default: 6e-3 beside Muon, else 3e-3; less for "
                  "bottlenecks above 128)")
      ->check(above(0))
      ->group(group);
  command
      .add_option("--schedule", a.schedule,
                  "Keep the learning rate (constant, the paper), or let it fall to the end (cosine)")
      ->check(CLI::IsMember({"constant", "cosine"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--warm-up", a.warm_up, "Let the cosine's rate rise in this fraction of the training")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--last-rate", a.last_rate, "Leave this fraction of the rate at the cosine's end")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  command.add_option("--clip", a.clip, "Clip the gradient to this norm; 0 turns clipping off")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--average", a.average,
                  "Keep a moving average of the weights with this decay, such as 0.999; 0 turns it off")
      ->check(CLI::Range(0.0, 0.999999))
      ->capture_default_str()
      ->group(group);
  command.add_option("--beta1", a.beta1, "Decay Adam's mean of gradients by this")
      ->check(CLI::Range(0.0, 0.999999))
      ->capture_default_str()
      ->group(group);
  command.add_option("--beta2", a.beta2, "Decay Adam's mean of squared gradients by this")
      ->check(CLI::Range(0.0, 0.9999999))
      ->capture_default_str()
      ->group(group);
  command.add_option("--epsilon", a.epsilon, "Add this to the root of Adam's mean of squared gradients")
      ->check(above(0))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--loss-scaling", a.loss_scaling,
                  "Sum the loss over vertices (sum, eq. 5 and 6) or average it (mean, the released code)")
      ->check(CLI::IsMember({"sum", "mean"}))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--edge-loss", a.edge_loss,
                  "Add the loss of edge lengths (length, eq. 6) or of their ratios (relative, the released code), "
                  "where samples are whole meshes")
      ->check(CLI::IsMember({"none", "length", "relative"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--edge-weight", a.edge_weight, "Weight the edge loss by this")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(group);
  command.add_option("--seed", a.seed, "Draw samples and first weights from this seed")
      ->check(whole_number())
      ->capture_default_str()
      ->group(group);
}

void add_run_options(CLI::App& command, TrainingArguments& a) {
  const char* group = "Run";
  command
      .add_option("-o,--out", a.out,
                  "Write the weights to this file, W.safetensors; W.checkpoint.safetensors, W.log.csv and W.log.png "
                  "come beside it")
      ->required()
      ->group(group);
  command
      .add_flag("--resume", a.resume, "Resume from the checkpoint beside --out, with the options that it began with")
      ->group(group);
  command.add_flag("--overwrite", a.overwrite, "Begin anew where a checkpoint of an earlier training stands")
      ->excludes("--resume")
      ->group(group);
  add_precision_option(command, a.precision)->group(group);
  command.add_option("--threads", a.threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--checkpoint-every", a.checkpoint_every, "Write a checkpoint every N steps; 0: about once a minute")
      ->capture_default_str()
      ->group(group);
  command.add_option("--validate-every", a.validate_every, "Validate every N steps; 0: twenty times in all")
      ->capture_default_str()
      ->group(group);
  command.add_option("--log-every", a.log_every, "Write a row of the log every N steps")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 36))
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--validation-pairs", a.validation_pairs,
                  "Validate on this many pairs of unseen identities and poses, four times as many at the end; 0: never")
      ->check(CLI::Range(std::size_t{0}, std::size_t{100000}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--domain", a.domain, "Say in the metadata what the weights are for, such as human")
      ->type_name("NAME")
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
