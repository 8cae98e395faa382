/// Errors of transfers as a table for people and as JSON for programs.
#pragma once

#include "report.hpp"

#include <npt/lab/evaluation.hpp>
#include <npt/mesh/metrics.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace program {

/// A line for each set, and for each of its `worst` pairs. `in_place`: with the error of results left where they were
/// put.
inline void print_table(const std::vector<npt::Evaluation>& evaluations, std::size_t worst, bool in_place = true) {
  const auto end_line = [in_place](double error) {
    if (in_place) std::printf(" %10.3f", 1e4 * error);
    std::printf("\n");
  };
  std::printf("%-24s %6s %9s %9s %9s %11s %15s %11s", "", "pairs", "RMS mm", "median", "worst", "PMD x 1e-4",
              "per coordinate", "edge error");
  if (in_place) std::printf(" %10s", "in place");
  std::printf("\n");
  for (const npt::Evaluation& e : evaluations) {
    std::printf("%-24s %6zu %9.2f %9.2f %9.2f %11.3f %15.3f %11.4f", e.name.c_str(), e.pairs.size(), e.root_mm(),
                e.median_mm(), npt::root_pmd_mm(e.worst_pmd()), 1e4 * e.pmd(), 1e4 * e.per_coordinate(),
                e.edge_error());
    end_line(e.pmd_in_place());
  }
  for (const npt::Evaluation& e : evaluations) {
    if (e.refused.empty()) continue;
    std::printf("%s: %zu of %zu pairs refused, which count in no column%s\n", e.name.c_str(), e.refused.size(),
                e.refused.size() + e.pairs.size(), worst > 0 ? ":" : "");
    for (std::size_t i = 0; i < std::min(worst, e.refused.size()); ++i) std::printf("  %s\n", e.refused[i].c_str());
  }
  for (const npt::Evaluation& e : evaluations) {
    if (worst == 0) continue;
    std::printf("worst of %s\n", e.name.c_str());
    for (const std::size_t i : e.worst(worst)) {
      const npt::PairErrors& p = e.pairs[i];
      std::printf("  %-29s %9.2f %9s %9s %11.3f %15.3f %11.4f", p.name.c_str(), p.root_mm(), "", "", 1e4 * p.pmd,
                  1e4 * p.per_coordinate(), p.edge_error);
      end_line(p.pmd_in_place);
    }
  }
}

namespace internal {

template <class Errors>
Report report_of(const std::string& name, const Errors& errors, double pmd, double edge_error, double in_place) {
  return {{"name", name},
          {"pmd", pmd},
          {"pmd_per_coordinate", errors.per_coordinate()},
          {"root_mm", errors.root_mm()},
          {"edge_error", edge_error},
          {"pmd_in_place", in_place}};
}

}  // namespace internal

inline Report report_of(const npt::Evaluation& e, std::size_t worst) {
  Report report = internal::report_of(e.name, e, e.pmd(), e.edge_error(), e.pmd_in_place());
  report["pmd_median"] = e.median_pmd();
  report["pmd_worst"] = e.worst_pmd();
  report["pairs"] = e.pairs.size();
  report["refused"] = e.refused.size();
  if (worst == 0) return report;
  Report list = Report::array();
  for (const std::size_t i : e.worst(worst)) {
    const npt::PairErrors& p = e.pairs[i];
    list.push_back(internal::report_of(p.name, p, p.pmd, p.edge_error, p.pmd_in_place));
  }
  report["worst"] = std::move(list);
  return report;
}

}  // namespace program
