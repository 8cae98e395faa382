/// --protocol of the commands of transfer without networks: its options, and its errors as a table or JSON.
#pragma once

#include "evaluation_report.hpp"
#include "report.hpp"
#include "subcommand.hpp"

#include <npt/body/pose_sampler.hpp>
#include <npt/lab/evaluation.hpp>

#include <cstddef>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

namespace program {

/// --protocol and the options that belong to it.
struct ProtocolArguments {
  bool asked_for = false, json = false;
  std::string shapes = "normal";
  std::size_t first = 0, worst = 0;

  npt::ShapeDistribution distribution() const {
    return shapes == "uniform" ? npt::ShapeDistribution::uniform : npt::ShapeDistribution::normal;
  }
};

/// `single`: an option that only a transfer takes.
inline CLI::Option* add_protocol_options(CLI::App& command, ProtocolArguments& a, CLI::Option* single) {
  CLI::Option* protocol =
      command
          .add_flag("--protocol", a.asked_for,
                    "Measure the error on the paper's 72 pairs in seen and 72 in unseen poses instead")
          ->excludes(single);
  command
      .add_option("--shapes", a.shapes,
                  "Draw the protocol's shape parameters from a normal distribution, or uniformly from -4 to 4")
      ->check(CLI::IsMember({"normal", "uniform"}))
      ->capture_default_str()
      ->needs(protocol);
  command.add_option("--first", a.first, "Measure on the first N pairs of each set only")
      ->check(CLI::Range(1, 72))
      ->needs(protocol);
  command.add_option("--worst", a.worst, "Also list this many of the worst pairs")
      ->check(CLI::Range(0, 1000000))
      ->needs(protocol);
  command.add_flag("--json", a.json, "Print one line of JSON")->needs(protocol);
  return protocol;
}

/// The protocol's errors: a table below `title`, or JSON that begins with `head`.
inline void print_protocol(const ProtocolArguments& a, const std::vector<npt::Evaluation>& evaluations, Report head,
                           const std::string& title, double seconds) {
  if (a.json) {
    for (const npt::Evaluation& e : evaluations) head["sets"].push_back(report_of(e, a.worst));
    head["seconds"] = seconds;
    std::cout << head.dump(-1, ' ', false, Report::error_handler_t::replace) << '\n';
    return;
  }
  std::printf("%s\n", title.c_str());
  print_table(evaluations, a.worst, false);
  std::printf("%.1f s\n", seconds);
  std::fflush(stdout);
}

}  // namespace program
