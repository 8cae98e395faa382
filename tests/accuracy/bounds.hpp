/// What accuracy is held against: bounds.txt and wrong.txt beside this file.
///   bounds.txt   lines of: set, pairs, mean, median, bound of the mean, bound of the median; in mm
///   wrong.txt    lines of "SET: PAIR": pairs that are wrong or refused today. A pair outside it may not be wrong
/// Errors    std::runtime_error that names the file and the line
#pragma once

#include <npt/lab/evaluation.hpp>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace accuracy {

/// A result is wrong from so many mm RMS on: a limb of a person who is 1.7 m tall lies elsewhere.
inline constexpr double wrong_mm = 100;
/// Bounds are what was measured first, times this.
inline constexpr double slack = 1.1;

struct Bounds {
  std::size_t pairs = 0;
  double mean = 0, median = 0;
};

/// Lines of a file without comments and blank lines.
inline std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": can't be read");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);)
    if (!line.empty() && !line.starts_with('#')) lines.push_back(line);
  return lines;
}

inline std::map<std::string, Bounds> read_bounds(const std::string& path) {
  std::map<std::string, Bounds> all;
  for (const std::string& line : lines_of(path)) {
    std::istringstream words(line);
    std::string set;
    double mean = 0, median = 0;
    Bounds bounds;
    if (!(words >> set >> bounds.pairs >> mean >> median >> bounds.mean >> bounds.median) ||
        !all.emplace(set, bounds).second)
      throw std::runtime_error(path + ": unreadable line '" + line + "'");
  }
  return all;
}

inline std::set<std::string> read_wrong(const std::string& path) {
  const std::vector<std::string> lines = lines_of(path);
  return {lines.begin(), lines.end()};
}

inline bool is_refused(const npt::PairErrors& pair) { return std::isnan(pair.pmd); }

/// A set's pairs, and those that are neither wrong now nor listed as wrong, of which mean and median are taken.
struct Outcome {
  std::string key, title;
  npt::Evaluation all, right;
  double seconds = 0;
  bool by_length = false;       ///< Set::by_length
  npt::Evaluation untouched{};  ///< of such a set: the identity as it is

  /// NaN, of a refused pair, is wrong.
  bool is_wrong(const npt::PairErrors& pair) const {
    return by_length ? is_refused(pair) : !(pair.root_mm() < wrong_mm);
  }

  std::string listed_name(const npt::PairErrors& pair) const { return key + ": " + pair.name; }
};

inline std::string line_of(const Outcome& outcome) {
  const double mean = outcome.right.mean_mm(), median = outcome.right.median_mm();
  char line[160];
  std::snprintf(line, sizeof line, "%-14s %5zu %8.2f %8.2f %8.2f %8.2f", outcome.key.c_str(), outcome.all.pairs.size(),
                mean, median, slack * mean, slack * median);
  return line;
}

/// What a set does that it must not.
inline std::vector<std::string> complaints_of(const Outcome& outcome, const std::map<std::string, Bounds>& bounds,
                                              const std::set<std::string>& wrong) {
  std::vector<std::string> complaints;
  char text[200];
  for (const npt::PairErrors& pair : outcome.all.pairs) {
    if (!outcome.is_wrong(pair) || wrong.contains(outcome.listed_name(pair))) continue;
    std::snprintf(text, sizeof text, "%.1f mm, expected less than %.0f", pair.root_mm(), wrong_mm);
    complaints.push_back(outcome.listed_name(pair) + ": " + (is_refused(pair) ? "is refused" : text));
  }
  const auto found = bounds.find(outcome.key);
  if (found == bounds.end() || found->second.pairs != outcome.all.pairs.size()) {
    complaints.push_back(outcome.key + ": bounds.txt has no line for its " + std::to_string(outcome.all.pairs.size()) +
                         " pairs");
    return complaints;
  }
  const auto expect = [&](const char* what, double measured, double bound) {
    if (measured <= bound) return;
    std::snprintf(text, sizeof text, ": %s of %.2f mm, expected at most %.2f", what, measured, bound);
    complaints.push_back(outcome.key + text);
  };
  expect("a mean", outcome.right.mean_mm(), found->second.mean);
  expect("a median", outcome.right.median_mm(), found->second.median);
  return complaints;
}

/// Entries of wrong.txt that should go: pairs of this set that are right now, and such as it doesn't have.
inline std::vector<std::string> stale_entries(const Outcome& outcome, const std::set<std::string>& wrong, bool right) {
  std::set<std::string> known, now_right;
  for (const npt::PairErrors& pair : outcome.all.pairs) {
    known.insert(outcome.listed_name(pair));
    if (!outcome.is_wrong(pair)) now_right.insert(outcome.listed_name(pair));
  }
  std::vector<std::string> stale;
  for (const std::string& entry : wrong)
    if (entry.starts_with(outcome.key + ": ") && (right ? now_right.contains(entry) : !known.contains(entry)))
      stale.push_back(entry);
  return stale;
}

}  // namespace accuracy
