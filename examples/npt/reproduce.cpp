/// npt reproduce: the paper's tables and figures by one command. Networks are trained equally long on equal data, every
/// system is measured on the same 72 + 72 pairs, and what is written says how it was made. It runs the program's other
/// commands and resumes a folder that it began.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "precision_option.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "stopwatch.hpp"
#include "subcommand.hpp"

#include <reproduce/child.hpp>
#include <reproduce/figure_meshes.hpp>
#include <reproduce/figures.hpp>
#include <reproduce/systems.hpp>

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace reproduce_command {

namespace fs = std::filesystem;
using program::Report;
using reproduce::Kind;
using reproduce::Measured;
using reproduce::System;

struct Options {
  std::vector<std::string> table_texts, figure_texts;  ///< as given: "6..9"
  std::vector<int> tables, figures;
  double budget = 60;
  fs::path out;
  std::string body = "mannequin", precision = "auto";
  int bottleneck = 128, threads = 0;
  std::size_t first = 0;  ///< of each set's pairs; 0: all
  reproduce::FigureSources sources;
  std::vector<std::string> weights;  ///< SYSTEM=FILE
};

/// The part of the budget in which baselines run and networks are trained; the rest is for measuring the networks and
/// for figures: of the usual hour six minutes for about 400 meshes, each of which takes up to half a second of one core
/// to draw.
constexpr double share_of_training = 0.9;

class Reproduction {
 public:
  explicit Reproduction(Options options) : options_(std::move(options)) {
    for (const int number : options_.tables)
      for (const reproduce::Row& row : reproduce::table_of(number).rows) need(row.system);
    options_.sources.body = options_.body;
    for (const int number : options_.figures) {
      const reproduce::Figure& figure = reproduce::figure_of(number);
      if (reproduce::left_out_because(number, options_.sources).empty())
        for (const std::string& system : figure.systems) need(system);
    }
    take_weights();
    check_commands();
    if (options_.body != "mannequin" && !fs::is_regular_file(options_.body))
      throw npt::Error({.file = options_.body, .found = "no such file", .expected = "a body model, or mannequin"});
    for (const char* folder : {"weights", "results"}) fs::create_directories(options_.out / folder);
    plan();
    if (options_.figures.empty()) return;
    // Now, so that a mesh that can't be read is known before hours of training.
    for (const System& system : reproduce::systems())
      if (needed(system) && system.kind == Kind::network) options_.sources.weights[system.id] = weights_of(system);
    store_.emplace(options_.sources, options_.out / "meshes", run_silently());
    if (needed(reproduce::system_of("quadruped"))) (void)reproduce::held_out_labels(options_.sources.family);
  }

  void run() {
    program::catch_interrupts();
    // What needs no training comes first: the networks share what it leaves of the budget.
    for (const System& system : reproduce::systems())
      if (needed(system) && system.kind != Kind::network && measures(system)) measure(system);
    const double measured = watch_.seconds();
    train();
    const double trained = watch_.seconds();
    for (const System& system : reproduce::systems())
      if (needed(system) && system.kind == Kind::network && measures(system)) measure(system);
    write_tables();
    const std::size_t failures = draw_figures();
    std::printf("%s in %s: baselines %s, training %s, the rest %s\n", options_.out.string().c_str(),
                program::duration_text(watch_.seconds()).c_str(), program::duration_text(measured).c_str(),
                program::duration_text(trained - measured).c_str(),
                program::duration_text(watch_.seconds() - trained).c_str());
    std::fflush(stdout);
    if (failures > 0)
      throw npt::Error({.file = std::to_string(failures) + " of " + std::to_string(options_.figures.size()) +
                                " figures could not be drawn"});
  }

 private:
  void take_weights() {
    for (const std::string& given : options_.weights) {
      const std::size_t equals = given.find('=');
      if (equals == std::string::npos)
        throw npt::Error(
            {.file = "--weights", .found = "'" + given + "'", .expected = "SYSTEM=FILE, such as full=a.safetensors"});
      const System& system = reproduce::system_of(given.substr(0, equals));
      const fs::path file = given.substr(equals + 1);
      if (system.kind != Kind::network)
        throw npt::Error({.file = "--weights", .found = "'" + system.id + "'", .expected = "a network"});
      if (!fs::exists(file)) throw npt::Error({.file = file.string(), .found = "no such file", .expected = "weights"});
      given_[system.id] = fs::absolute(file);
    }
  }

  /// Builds without Eigen or liblbfgs have no baselines.
  void check_commands() const {
    for (const System& system : reproduce::systems()) {
      if (!needed(system) || system.kind == Kind::network || system.kind == Kind::bodies) continue;
      const std::string command = system.kind == Kind::deformation ? "deform" : "skeleton";
      if (std::ranges::none_of(program::Subcommand::all(), [&](const auto* known) { return known->name == command; }))
        throw npt::Error({.file = system.name,
                          .found = "a program built without Eigen or liblbfgs, hence without npt " + command,
                          .expected = "one with them, or other tables and figures"});
    }
  }

  void need(const std::string& id) {
    if (std::ranges::find(needed_, id) == needed_.end()) needed_.push_back(id);
  }
  bool needed(const System& system) const { return std::ranges::find(needed_, system.id) != needed_.end(); }
  /// Whether a table asks for it.
  bool measures(const System& system) const {
    return std::ranges::any_of(options_.tables, [&](int number) {
      return std::ranges::any_of(reproduce::table_of(number).rows,
                                 [&](const reproduce::Row& row) { return row.system == system.id; });
    });
  }

  fs::path weights_of(const System& system) const {
    const auto given = given_.find(system.id);
    return given != given_.end() ? given->second : options_.out / "weights" / (system.id + ".safetensors");
  }
  fs::path trained_mark(const System& system) const { return options_.out / "weights" / (system.id + ".trained"); }
  fs::path result_of(const System& system) const { return options_.out / "results" / (system.id + ".json"); }
  bool needs_training(const System& system) const {
    return needed(system) && system.kind == Kind::network && !given_.contains(system.id) &&
           !fs::exists(trained_mark(system));
  }

  std::size_t draw_figures() {
    std::size_t failures = 0;
    const auto shows = [this](std::initializer_list<int> numbers) {
      return std::ranges::any_of(options_.figures,
                                 [&](int f) { return std::ranges::find(numbers, f) != numbers.end(); });
    };
    if (options_.body == "mannequin" && ((options_.sources.identities.empty() && shows({10, 17, 18})) ||
                                         (options_.sources.poses.empty() && shows({11, 18}))))
      std::cerr
          << "npt: note: figures 10, 11, 17 and 18 show the mannequin, on which the networks were trained, where no "
             "--foreign-identities or --foreign-poses are given\n";
    for (const int number : options_.figures) {
      const std::string why = reproduce::left_out_because(number, options_.sources);
      if (!why.empty()) {
        std::cerr << "npt: note: figure " << number << " is left out: " << why << '\n';
        continue;
      }
      try {
        const auto outcome = reproduce::draw_figure(number, *store_, options_.out / "figures", run_silently());
        std::printf("figure %d, %s: %s\n", number, reproduce::figure_of(number).title.c_str(),
                    outcome == reproduce::Outcome::kept ? "there" : "drawn");
        std::fflush(stdout);
      } catch (const npt::Error& error) {
        // The others can be drawn all the same.
        std::cerr << "npt: error: " << error.what() << '\n';
        ++failures;
      }
    }
    return failures;
  }

  /// What a folder was begun with, so that its parts belong together.
  void plan() const {
    const fs::path path = options_.out / "plan.json";
    const bool built_in = options_.body == "mannequin";
    const Report plan{{"body", built_in ? options_.body : program::resolved(options_.body).string()},
                      {"bottleneck", options_.bottleneck},
                      {"precision", options_.precision},
                      {"first", options_.first}};
    if (!fs::exists(path)) {
      npt::write_file(path, plan.dump(2) + "\n");
      return;
    }
    const Report before = Report::parse(npt::read_file(path), nullptr, false);
    if (before.is_discarded() || before != plan)
      throw npt::Error({.file = path.string(),
                        .found = before.is_discarded() ? "no JSON" : before.dump(),
                        .expected = plan.dump() + ", or another --out"});
  }

  std::string run_child(std::vector<std::string> arguments) const {
    const bool takes_threads = arguments.front() != "render";
    if (options_.threads > 0 && takes_threads)
      arguments.insert(arguments.end(), {"--threads", std::to_string(options_.threads)});
    reproduce::ChildResult result = reproduce::run_child(arguments);
    if (result.interrupted) throw program::Interrupted();
    program::stop_if_interrupted();
    return std::move(result.output);
  }
  std::string run_loudly(const std::vector<std::string>& arguments) const {
    std::printf("%s\n", reproduce::command_line(arguments).c_str());
    std::fflush(stdout);
    return run_child(arguments);
  }
  /// For what is many and short; what a figure was drawn by stands beside it.
  reproduce::RunCommand run_silently() const {
    return [this](const std::vector<std::string>& arguments) { (void)run_child(arguments); };
  }

  std::vector<std::string> training_arguments(const System& system, double minutes) const {
    char length[32];
    std::snprintf(length, sizeof length, "%.3f", minutes);
    std::vector<std::string> arguments{"train"};
    const auto add = [&arguments](const std::vector<std::string>& more) {
      arguments.insert(arguments.end(), more.begin(), more.end());
    };
    if (system.id == "quadruped")
      add(reproduce::family_training_arguments(options_.sources.family));
    else
      add({"--body", options_.body, "--protocol", "--stage", "0:24x240", "--stage", "0.6:12x600"});
    add({"--stage", "0.9:2xall", "--bottleneck", std::to_string(options_.bottleneck), "--precision", options_.precision,
         "--minutes", length, "--domain", system.id, "--out", weights_of(system).string()});
    add(system.arguments);
    return arguments;
  }

  void train() {
    std::vector<const System*> missing;
    for (const System& system : reproduce::systems())
      if (needs_training(system)) missing.push_back(&system);
    if (missing.empty()) return;
    // All networks of a folder train equally long, also those of a later run.
    const fs::path path = options_.out / "minutes";
    double minutes =
        (share_of_training * options_.budget - watch_.seconds() / 60) / static_cast<double>(missing.size());
    if (fs::exists(path))
      minutes = std::stod(npt::read_file(path));
    else
      npt::write_file(
          path, std::to_string(minutes = std::max({minutes, least_share * options_.budget, least_minutes})) + "\n");
    for (const System* system : missing) {
      std::vector<std::string> arguments = training_arguments(*system, minutes);
      const fs::path checkpoint = options_.out / "weights" / (system->id + ".checkpoint.safetensors");
      if (fs::exists(checkpoint)) arguments = {"train", "--resume", "--out", weights_of(*system).string()};
      std::cout << run_loudly(arguments) << std::flush;
      npt::write_file(trained_mark(*system), reproduce::command_line(training_arguments(*system, minutes)) + "\n");
    }
  }

  std::vector<std::string> measuring_arguments(const System& system) const {
    std::vector<std::string> arguments;
    if (system.kind == Kind::network)
      arguments = {"evaluate", "--method", "network", "--weights", weights_of(system).string()};
    if (system.kind == Kind::deformation) arguments = {"deform"};
    if (system.kind == Kind::skeleton) arguments = {"skeleton"};
    if (system.kind == Kind::bodies) arguments = {"evaluate", "--method", "body"};
    if (system.kind != Kind::network)
      arguments.insert(arguments.end(), system.arguments.begin(), system.arguments.end());
    if (options_.body != "mannequin") arguments.insert(arguments.end(), {"--body", options_.body});
    arguments.insert(arguments.end(), {"--protocol", "--json"});
    if (options_.first > 0) arguments.insert(arguments.end(), {"--first", std::to_string(options_.first)});
    return arguments;
  }

  void measure(const System& system) {
    const fs::path file = result_of(system);
    const std::vector<std::string> arguments = measuring_arguments(system);
    const std::string command = reproduce::command_line(arguments),
                      hash = system.kind == Kind::network ? reproduce::content_hash(weights_of(system)) : std::string();
    Report report;
    if (fs::exists(file)) report = Report::parse(npt::read_file(file), nullptr, false);
    const auto says = [&report](const char* key, const std::string& value) {
      return report.contains(key) && report[key] == value;
    };
    if (!report.is_object() || !says("command", command) || !says("weights_hash", hash)) {
      report = Report::parse(run_loudly(arguments), nullptr, false);
      if (report.is_object()) {
        report["command"] = command;
        report["weights_hash"] = hash;
        npt::write_file(file, report.dump(2) + "\n");
      }
    }
    const auto wrong = [&] {
      throw npt::Error(
          {.file = file.string(), .found = "no errors on two sets of pairs", .expected = "them, or no such file"});
    };
    if (!report.is_object() || !report.contains("sets") || report["sets"].size() != 2) wrong();
    const Report &seen = report["sets"][0]["pmd"], &unseen = report["sets"][1]["pmd"];
    if (!seen.is_number() || !unseen.is_number()) wrong();
    results_.emplace_back(system.id, Measured{.seen = seen.get<double>(),
                                              .unseen = unseen.get<double>(),
                                              .seconds = report.value("seconds", 0.0),
                                              .how = report.value("command", std::string())});
  }

  void write_tables() const {
    if (options_.tables.empty()) return;
    const std::string text = reproduce::markdown(options_.tables, results_);
    npt::write_file(options_.out / "tables.md", text);
    Report list = Report::array();
    for (const int number : options_.tables)
      for (const reproduce::Row& row : reproduce::table_of(number).rows) {
        const auto ours = reproduce::find(results_, row.system);
        if (!ours) continue;
        Report entry{{"table", number},          {"system", row.system},
                     {"seen_pmd", ours->seen},   {"unseen_pmd", ours->unseen},
                     {"seconds", ours->seconds}, {"command", ours->how}};
        if (row.paper) {
          entry["paper_seen"] = 1e-4 * row.paper->seen;
          entry["paper_unseen"] = 1e-4 * row.paper->unseen;
        }
        list.push_back(std::move(entry));
      }
    npt::write_file(options_.out / "tables.json", list.dump(2) + "\n");
    std::cout << text;
  }

  /// What each network gets in any case, as a share of the budget: one that has learnt nothing is of no use, and its
  /// torn meshes take twenty times as long to draw. And minutes for any budget.
  static constexpr double least_share = 0.05, least_minutes = 0.02;

  Options options_;
  program::Stopwatch watch_;
  std::vector<std::string> needed_;
  std::map<std::string, fs::path> given_;
  reproduce::Results results_;
  std::optional<reproduce::MeshStore> store_;  ///< if there are figures
};

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command.add_option("--table", o->table_texts, "Make these tables: 1, 2, 7 (default: all tables and figures)")
      ->type_name("LIST")
      ->delimiter(',');
  command
      .add_option("--figure", o->figure_texts,
                  "Make these figures, 6 to 20, also ranges: 6..9,12 (default: all tables and figures)")
      ->type_name("LIST")
      ->delimiter(',');
  command
      .add_option("--budget", o->budget, "Take this many minutes for everything; trainings share what the rest leaves")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option("-o,--out", o->out,
                  "Write tables, figures and weights into this folder; a folder of an interrupted run resumes")
      ->required();
  command.add_option("--body", o->body, "Use this body model (.safetensors), or the mannequin")->capture_default_str();
  command.add_option("--bottleneck", o->bottleneck, "Give the networks' pose feature this many channels")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->capture_default_str();
  program::add_precision_option(command, o->precision);
  command
      .add_option("--weights", o->weights,
                  "Use trained weights instead of training: SYSTEM=FILE, for full, without-edge, without-spadain, "
                  "concat1, compact or quadruped (may be repeated)")
      ->type_name("SYSTEM=PATH");
  command
      .add_option("--foreign-identities", o->sources.identities,
                  "Use these meshes, in metres and not of the body model, as identities of figures 10, 17 and 18 "
                  "(default: the mannequin's)")
      ->type_name("PATH");
  command
      .add_option("--foreign-poses", o->sources.poses,
                  "Use these meshes as poses of figures 11 and 18 (default: the mannequin's)")
      ->type_name("PATH");
  command.add_option("--family", o->sources.family, "Draw figure 14 with this folder of species with labelled poses")
      ->type_name("PATH");
  command.add_option("--panel-height", o->sources.panel_height, "Make panels of figures this many pixels high")
      ->check(CLI::Range(32, 1000))
      ->capture_default_str();
  command.add_option("--first", o->first, "Measure on the first N pairs of each set only")->check(CLI::Range(1, 72));
  command.add_option("--threads", o->threads, "Use this many threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command.footer(
      "Writes tables.md and tables.json, figures/*.png with the commands that drew them, results/*.json\n"
      "(errors of each system with the command that measured them), weights/*.safetensors with their logs,\n"
      "and meshes/. A folder keeps its body, bottleneck, pairs and minutes of training.");
  command.callback([o] {
    o->tables = reproduce::parse_numbers(o->table_texts, "--table");
    o->figures = reproduce::parse_numbers(o->figure_texts, "--figure");
    if (o->tables.empty() && o->figures.empty()) {
      for (const reproduce::Table& table : reproduce::tables()) o->tables.push_back(table.number);
      for (const reproduce::Figure& figure : reproduce::figures()) o->figures.push_back(figure.number);
    }
    Reproduction(*o).run();
  });
}

const program::Subcommand registered("reproduce", "Make the paper's tables and figures", add);

}  // namespace reproduce_command
