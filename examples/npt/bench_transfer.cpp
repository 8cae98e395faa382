#include "bench_transfer.hpp"

#include "open_transfer.hpp"
#include "report.hpp"
#include "subcommand.hpp"
#include "transfer_arguments.hpp"

#include <bench/peak.hpp>
#include <host/host.hpp>

#include <npt/base/error.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/sequences.hpp>
#include <npt/mesh/subdivide.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/pose_tracker.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bench_transfer_command {

struct Options {
  program::TransferArguments transfer;
  std::optional<std::uint64_t> seed;
  std::size_t repeats = 5, frames = 10, large_repeats = 3;
  int subdivisions = 3;
  bool json = false;
};

struct Row {
  std::string name;
  std::size_t vertices = 0;
  std::vector<double> seconds;  ///< of each run
  double error = 0;             ///< mean over the runs, eq. 7 with boxes centred, square metres
  double memory_mb = 0;         ///< largest resident set of a process that does only this; 0: not measured

  double median() const {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
  double least() const { return *std::min_element(seconds.begin(), seconds.end()); }
};

/// Two shapes of the mannequin in natural poses, and the truth; vertices shuffled, as in an evaluation. Steps of
/// midpoint subdivision make large ones.
npt::EvaluationPair fresh_pair(std::uint64_t seed, std::size_t i, int subdivisions = 0) {
  const auto body = npt::borrowed(npt::mannequin());
  auto parameters = npt::fresh_pairs(i + 1, seed, body->shape_count(), npt::ShapeDistribution::normal,
                                     npt::PoseDistribution::natural);
  npt::EvaluationPair pair = npt::body_pairs(body, std::move(parameters), "bench", seed).pair(i);
  const auto refined = [subdivisions](std::vector<float>& xyz, const std::vector<npt::Triangle>& triangles) {
    npt::Mesh mesh;
    mesh.positions.resize(xyz.size() / 3);
    std::copy(xyz.begin(), xyz.end(), mesh.coordinates().begin());
    npt::set_faces(mesh, triangles);
    for (int s = 0; s < subdivisions; ++s) mesh = npt::subdivide(mesh);
    xyz.assign(mesh.coordinates().begin(), mesh.coordinates().end());
    return npt::triangulate(mesh);
  };
  if (subdivisions == 0) return pair;
  pair.pose_triangles = refined(pair.pose, pair.pose_triangles);
  refined(pair.truth, pair.identity_triangles);
  pair.identity_triangles = refined(pair.identity, pair.identity_triangles);
  pair.edges.clear();
  return pair;
}

npt::MeshView identity_of(const npt::EvaluationPair& pair) {
  return {pair.identity, pair.identity_triangles, "identity"};
}
npt::MeshView pose_of(const npt::EvaluationPair& pair) { return {pair.pose, pair.pose_triangles, "pose"}; }

double error_of(const npt::EvaluationPair& pair, const std::vector<float>& result) {
  const double error = npt::pair_errors(pair, result).pmd;
  if (std::isfinite(error)) return error;
  throw npt::Error({.file = "bench transfer", .found = "a result that is not finite", .expected = "vertices"});
}

/// From two meshes that were never seen to the result: every run has a pair and a transfer of its own, so that memory
/// is asked for as at a first call.
Row first_results(const Options& o, std::uint64_t seed, int subdivisions, std::size_t repeats) {
  Row row{.name = "first result", .vertices = 0, .seconds = {}};
  for (std::size_t i = 0; i < repeats; ++i) {
    const npt::EvaluationPair pair = fresh_pair(seed, i, subdivisions);
    const program::PoseTransfer transfer = program::open_transfer(o.transfer);
    std::vector<float> result(pair.identity.size());
    const double start = bench::seconds_now();
    transfer(identity_of(pair), pose_of(pair), result);
    row.seconds.push_back(bench::seconds_now() - start);
    row.error += error_of(pair, result) / static_cast<double>(repeats);
    row.vertices = result.size() / 3;
  }
  return row;
}

/// Frames of a movement between two natural poses, for one prepared identity. The first frame isn't counted.
Row further_frames(const Options& o, std::uint64_t seed) {
  // A twentieth of the way at most from frame to frame: a second at 20 frames.
  const npt::SequenceSet set =
      npt::body_sequences(npt::borrowed(npt::mannequin()), 1, std::max<std::size_t>(o.frames, 20) + 1, seed,
                          npt::ShapeDistribution::normal, npt::PoseDistribution::natural);
  npt::EvaluationPair frame = set.pair(0, 0);
  const program::PoseTransfer transfer = program::open_transfer(o.transfer);
  const npt::Character identity = transfer.character(identity_of(frame));
  npt::PoseTracker sequence(transfer);
  std::vector<float> result(frame.identity.size()), again(frame.identity.size());
  Row row{.name = "a further frame", .vertices = result.size() / 3, .seconds = {}};
  for (std::size_t f = 0; f <= o.frames; ++f) {
    if (f > 0) frame = set.pair(0, f);
    const double start = bench::seconds_now();
    transfer.apply(identity, sequence.next(pose_of(frame), result.size() / 3), result);
    const double seconds = bench::seconds_now() - start;
    if (f == 0) {
      transfer(identity_of(frame), pose_of(frame), again);
      if (result != again)
        throw npt::Error({.file = "bench transfer",
                          .found = "another result for prepared meshes",
                          .expected = "the same bits before timing"});
      continue;
    }
    row.seconds.push_back(seconds);
    row.error += error_of(frame, result) / static_cast<double>(o.frames);
  }
  return row;
}

/// In a process of its own, which must come before this one has threads.
Row large_pairs(const Options& o, std::uint64_t seed) {
  Row row{.name = "first result", .vertices = 0, .seconds = {}};
  host::Apart apart = host::run_apart([&]() -> std::vector<double> {
    Row measured = first_results(o, seed, o.subdivisions, o.large_repeats);
    std::vector<double> values{static_cast<double>(measured.vertices), measured.error};
    values.insert(values.end(), measured.seconds.begin(), measured.seconds.end());
    return values;
  });
  if (!apart.done || apart.values.size() < 3)
    throw npt::Error({.file = "bench transfer",
                      .found = "no result for meshes subdivided " + std::to_string(o.subdivisions) + " times",
                      .expected = "one: see the message above, or memory is short"});
  row.vertices = static_cast<std::size_t>(apart.values[0]);
  row.error = apart.values[1];
  row.seconds.assign(apart.values.begin() + 2, apart.values.end());
  row.memory_mb = apart.memory_mb;
  return row;
}

void run(const Options& o) {
  const std::uint64_t seed =
      o.seed.value_or(static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count()));
  std::vector<Row> rows;
  if (o.large_repeats > 0) rows.push_back(large_pairs(o, seed));
  rows.insert(rows.begin(), further_frames(o, seed));
  rows.insert(rows.begin(), first_results(o, seed, 0, o.repeats));
  const program::PoseTransfer transfer = program::open_transfer(o.transfer);
  const int threads = transfer.engine().executor().slots();
  if (o.json) {
    program::Report report{{"bench", "transfer"},
                           {"network", transfer.description()},
                           {"isa", npt::compiled_isa()},
                           {"threads", threads},
                           {"seed", seed}};
    for (const Row& row : rows) {
      program::Report entry{{"name", row.name},           {"vertices", row.vertices},
                            {"runs", row.seconds.size()}, {"seconds_median", row.median()},
                            {"seconds_min", row.least()}, {"pmd", row.error}};
      if (row.memory_mb > 0) entry["peak_memory_mb"] = row.memory_mb;
      report["rows"].push_back(std::move(entry));
    }
    std::cout << report.dump(-1, ' ', false, program::Report::error_handler_t::replace) << '\n';
    return;
  }
  std::printf("transfer, %s, %d thread%s, %s, seed %llu\n", transfer.description().c_str(), threads,
              threads == 1 ? "" : "s", npt::compiled_isa(), static_cast<unsigned long long>(seed));
  std::printf("%-18s %9s %6s %10s %10s %11s %10s\n", "", "vertices", "runs", "median s", "min s", "PMD x 1e-4",
              "memory MB");
  for (const Row& row : rows) {
    std::printf("%-18s %9zu %6zu %10.4f %10.4f %11.2f", row.name.c_str(), row.vertices, row.seconds.size(),
                row.median(), row.least(), 1e4 * row.error);
    if (row.memory_mb > 0) std::printf(" %10.0f", row.memory_mb);
    std::printf("\n");
  }
  std::fflush(stdout);
}

}  // namespace bench_transfer_command

namespace program {

void add_bench_transfer(CLI::App& bench) {
  auto o = std::make_shared<bench_transfer_command::Options>();
  CLI::App* transfer =
      bench.add_subcommand("transfer", "Time transfers in memory: a pair, a further frame, a large pair");
  add_transfer_options(*transfer, o->transfer);
  transfer->add_option("--repeats", o->repeats, "Time this many pairs of 6890 vertices, each with a first result")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  transfer->add_option("--frames", o->frames, "Time this many frames of a sequence after its first")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  transfer->add_option("--large-repeats", o->large_repeats, "Time this many pairs of large meshes; 0: none")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  transfer
      ->add_option("--subdivisions", o->subdivisions,
                   "Subdivide large meshes this many times; each time makes about four times as many vertices")
      ->check(CLI::Range(1, 5))
      ->capture_default_str();
  transfer->add_option("--seed", o->seed, "Draw the meshes from this seed (default: others each time)")
      ->check(whole_number());
  transfer->add_flag("--json", o->json, "Print one line of JSON");
  transfer->callback([o] { bench_transfer_command::run(*o); });
}

}  // namespace program
