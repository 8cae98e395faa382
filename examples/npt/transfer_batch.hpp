/// What a run over many pairs needs beside the transfers: parts of the list, the report, the table of failures.
#pragma once

#include "report.hpp"
#include "transfer_jobs.hpp"

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>
#include <npt/transfer/result_measures.hpp>
#include <npt/transfer/warning.hpp>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace program {

/// The first, the second ... of so many parts of a list.
struct Shard {
  std::size_t number = 1, count = 1;
};

/// "3/16".
/// Errors    npt::Error that names `argument`
inline Shard parse_shard(std::string_view text, const std::string& argument) {
  Shard shard{0, 0};
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.number);
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == '/') {
    const auto second = std::from_chars(first.ptr + 1, end, shard.count);
    if (second.ec == std::errc() && second.ptr == end && shard.number >= 1 && shard.number <= shard.count) return shard;
  }
  throw npt::Error({argument, {}, "'" + std::string(text) + "'", "a part and their number: 1/16 to 16/16"});
}

/// The jobs of a part: of `count` series as many as of any other part, give or take one, in the list's order.
/// Errors    npt::Error where one sequence would have to be split
inline std::vector<TransferJob> jobs_of(std::vector<TransferJob> jobs, Shard shard) {
  if (shard.count == 1) return jobs;
  std::size_t series = 0;
  std::vector<std::size_t> number(jobs.size());  // of the job's series, counted from 0
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (i > 0 && jobs[i].series != jobs[i - 1].series) ++series;
    number[i] = series;
  }
  ++series;
  if (series == 1 && jobs.size() > 1)
    throw npt::Error({"--shard",
                      {},
                      "one sequence of " + std::to_string(jobs.size()) + " frames",
                      "a list of pairs, several identities, or --each: frames of a sequence depend on each other"});
  const std::size_t first = (shard.number - 1) * series / shard.count, last = shard.number * series / shard.count;
  std::vector<TransferJob> part;
  for (std::size_t i = 0; i < jobs.size(); ++i)
    if (number[i] >= first && number[i] < last) part.push_back(std::move(jobs[i]));
  return part;
}

/// How a job ended, for the report and the table of failures.
struct JobOutcome {
  enum class Status { none, done, skipped, failed };
  Status status = Status::none;
  std::string method;                ///< "body" or "network"
  std::string kind;                  ///< whose body made it: "person", "four-legged animal"
  std::optional<double> confidence;  ///< where bodies were estimated
  std::optional<npt::ResultMeasures> measures;
  double seconds = 0;
  std::size_t frames = 0;  ///< of a sequence in one file
  std::vector<std::string> notes;
  std::string error;
};

/// "person by body estimation, confidence 97 %"
inline std::string by_body_text(std::string_view kind, double confidence) {
  return std::string(kind) + " by body estimation, confidence " + npt::percent_text(confidence);
}

inline Report report_of(const npt::ResultMeasures& measures) {
  Report report{{"common_stretch", measures.stretch.common},
                {"largest_stretch", measures.stretch.largest},
                {"stretched_vertex", measures.stretch.vertex},
                {"penetration", measures.penetration}};
  if (measures.identity_coverage) report["identity_coverage"] = *measures.identity_coverage;
  if (measures.pose_coverage) report["pose_coverage"] = *measures.pose_coverage;
  return report;
}

/// A line of JSON.
inline std::string report_line(const TransferJob& job, const JobOutcome& outcome) {
  static constexpr const char* names[] = {"none", "done", "skipped", "failed"};
  Report line{{"identity", job.identity.string()},
              {"pose", job.pose.string()},
              {"out", job.out.string()},
              {"status", names[static_cast<int>(outcome.status)]}};
  if (outcome.status == JobOutcome::Status::done) {
    line["method"] = outcome.method;
    if (!outcome.kind.empty()) line["kind"] = outcome.kind;
    if (outcome.confidence) line["confidence"] = *outcome.confidence;
    line["notes"] = outcome.notes;
    if (outcome.measures) line["measures"] = report_of(*outcome.measures);
    line["seconds"] = outcome.seconds;
    if (outcome.frames > 0) line["frames"] = outcome.frames;
  }
  if (outcome.status == JobOutcome::Status::failed) line["error"] = outcome.error;
  return line.dump(-1, ' ', false, Report::error_handler_t::replace) + "\n";
}

/// A line for each job that failed: its output and why.
inline void print_failures(std::ostream& out, const std::vector<TransferJob>& jobs,
                           const std::vector<JobOutcome>& outcomes) {
  std::size_t width = 0;
  for (std::size_t i = 0; i < jobs.size(); ++i)
    if (outcomes[i].status == JobOutcome::Status::failed) width = std::max(width, jobs[i].out.string().size());
  if (width == 0) return;
  out << "failed:\n";
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (outcomes[i].status != JobOutcome::Status::failed) continue;
    const std::string name = jobs[i].out.string();
    out << "  " << name << std::string(width + 2 - name.size(), ' ') << outcomes[i].error << '\n';
  }
}

/// Whether results that a run before left are all there: they were written as a whole, or not at all.
inline bool is_there(const TransferJob& job) {
  std::error_code code;
  return std::filesystem::is_regular_file(job.out, code) && std::filesystem::file_size(job.out, code) > 0;
}

/// The bytes that a job reads.
inline std::uint64_t bytes_of(const TransferJob& job) {
  std::uint64_t sum = 0;
  for (const auto& file : {job.identity, job.pose}) {
    std::error_code code;
    const std::uintmax_t size = std::filesystem::file_size(file, code);
    if (!code) sum += size;
  }
  return sum;
}

}  // namespace program
