/// npt reproduce: the paper's tables by one command. Networks are trained equally long on equal data, every system is
/// measured on the same 72 + 72 pairs, and what is written says how it was made. It runs the program's other commands; a folder that was
/// begun is gone on with.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "precision_option.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "subcommand.hpp"

#include <reproduce/child.hpp>
#include <reproduce/systems.hpp>

#include <npt/core/error.hpp>
#include <npt/io/file.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

namespace fs = std::filesystem;
using program::Report;
using reproduce::Kind;
using reproduce::Measured;
using reproduce::System;

struct Options {
  std::vector<int> tables;
  double budget = 60;
  fs::path out;
  std::string body = "mannequin", precision = "fp32";
  int bottleneck = 128, threads = 0;
  std::vector<std::string> weights;  ///< SYSTEM=FILE
};

/// The part of the budget in which networks are trained and baselines run; the rest is for measuring the networks.
constexpr double share_of_training = 0.9;

class Reproduction {
 public:
  explicit Reproduction(Options options) : options_(std::move(options)), start_(std::chrono::steady_clock::now()) {
    for (const int number : options_.tables)
      for (const reproduce::Row& row : reproduce::table_of(number).rows) need(row.system);
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
    for (const char* folder : {"weights", "results"}) fs::create_directories(options_.out / folder);
    plan();
  }

  void run() {
    program::catch_interrupts();
    // What needs no training comes first: the networks share what it leaves of the budget.
    for (const System& system : reproduce::systems())
      if (needed(system) && system.kind != Kind::network && measures(system)) measure(system);
    train();
    for (const System& system : reproduce::systems())
      if (needed(system) && system.kind == Kind::network && measures(system)) measure(system);
    write_tables();
    std::printf("%s in %s\n", options_.out.string().c_str(), program::duration_text(elapsed()).c_str());
  }

 private:
  double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

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

  /// What a folder was begun with, so that its parts belong together.
  void plan() const {
    const fs::path path = options_.out / "plan.json";
    const Report plan{{"body", options_.body}, {"bottleneck", options_.bottleneck}, {"precision", options_.precision}};
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
    if (options_.threads > 0) arguments.insert(arguments.end(), {"--threads", std::to_string(options_.threads)});
    std::printf("%s\n", reproduce::command_line(arguments).c_str());
    std::fflush(stdout);
    reproduce::ChildResult result = reproduce::run_child(arguments);
    if (result.interrupted) throw program::Interrupted();
    program::stop_if_interrupted();
    return std::move(result.output);
  }

  std::vector<std::string> training_arguments(const System& system, double minutes) const {
    char length[32];
    std::snprintf(length, sizeof length, "%.3f", minutes);
    std::vector<std::string> arguments{"train",        "--body",
                                       options_.body,  "--protocol",
                                       "--bottleneck", std::to_string(options_.bottleneck),
                                       "--precision",  options_.precision,
                                       "--minutes",    length,
                                       "--stage",      "0:24x240",
                                       "--stage",      "0.6:12x600",
                                       "--stage",      "0.9:2xall",
                                       "--domain",     system.id,
                                       "--out",        weights_of(system).string()};
    arguments.insert(arguments.end(), system.arguments.begin(), system.arguments.end());
    return arguments;
  }

  void train() {
    std::vector<const System*> missing;
    for (const System& system : reproduce::systems())
      if (needs_training(system)) missing.push_back(&system);
    if (missing.empty()) return;
    // All networks of a folder train equally long, also those of a later run.
    const fs::path path = options_.out / "minutes";
    double minutes = (share_of_training * options_.budget - elapsed() / 60) / static_cast<double>(missing.size());
    if (fs::exists(path))
      minutes = std::stod(npt::read_file(path));
    else
      npt::write_file(path, std::to_string(minutes = std::max(minutes, least_minutes)) + "\n");
    for (const System* system : missing) {
      std::vector<std::string> arguments = training_arguments(*system, minutes);
      const fs::path checkpoint = options_.out / "weights" / (system->id + ".checkpoint.safetensors");
      if (fs::exists(checkpoint)) arguments = {"train", "--resume", "--out", weights_of(*system).string()};
      std::cout << run_child(arguments);
      npt::write_file(trained_mark(*system), reproduce::command_line(training_arguments(*system, minutes)) + "\n");
    }
  }

  void measure(const System& system) {
    const fs::path file = result_of(system);
    Report report;
    if (fs::exists(file)) report = Report::parse(npt::read_file(file), nullptr, false);
    if (report.is_null() || report.is_discarded()) {
      std::vector<std::string> arguments;
      if (system.kind == Kind::network) arguments = {"evaluate", "--weights", weights_of(system).string()};
      if (system.kind == Kind::deformation) arguments = {"deform"};
      if (system.kind == Kind::skeleton) arguments = {"skeleton"};
      if (system.kind != Kind::network)
        arguments.insert(arguments.end(), system.arguments.begin(), system.arguments.end());
      if (options_.body != "mannequin") arguments.insert(arguments.end(), {"--body", options_.body});
      arguments.insert(arguments.end(), {"--protocol", "--json"});
      report = Report::parse(run_child(arguments), nullptr, false);
      report["command"] = reproduce::command_line(arguments);
      npt::write_file(file, report.dump(2) + "\n");
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
        list.push_back({{"table", number},
                        {"system", row.system},
                        {"seen_pmd", ours->seen},
                        {"unseen_pmd", ours->unseen},
                        {"paper_seen", 1e-4 * row.paper_seen},
                        {"paper_unseen", 1e-4 * row.paper_unseen},
                        {"command", ours->how}});
      }
    npt::write_file(options_.out / "tables.json", list.dump(2) + "\n");
    std::cout << text;
  }

  static constexpr double least_minutes = 0.02;

  Options options_;
  std::chrono::steady_clock::time_point start_;
  std::vector<std::string> needed_;
  std::map<std::string, fs::path> given_;
  reproduce::Results results_;
};

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command.add_option("--table", o->tables, "1, 2 and 7; without: all of them")
      ->check(CLI::IsMember({1, 2, 7}))
      ->delimiter(',');
  command.add_option("--budget", o->budget, "Minutes for everything; the networks share what the others leave")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("-o,--out", o->out, "Folder for tables, results, weights; one that was begun is gone on with")
      ->required();
  command.add_option("--body", o->body, "Body model (.safetensors) or mannequin")->capture_default_str();
  command.add_option("--bottleneck", o->bottleneck, "Of the networks: 1024, 512, 256, 128 or 64")
      ->check(CLI::IsMember({1024, 512, 256, 128, 64}))
      ->capture_default_str();
  program::add_precision_option(command, o->precision);
  command.add_option("--weights", o->weights,
                     "SYSTEM=FILE: trained weights of full, without-edge, without-spadain, concat1 or compact");
  command.add_option("--threads", o->threads, "Threads; 0: all that the process may use")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command.footer(
      "Writes tables.md and tables.json, results/*.json (errors of each system with the command that "
      "measured\nthem), weights/*.safetensors with their logs. A folder keeps its body, bottleneck and minutes of "
      "training.");
  command.callback([o] {
    if (o->tables.empty()) o->tables = {1, 2, 7};
    Reproduction(*o).run();
  });
}

const program::Subcommand registered("reproduce", "Make the paper's tables", add);

}  // namespace
