#include "reproduce/systems.hpp"

#include <npt/base/error.hpp>

#include <algorithm>
#include <cstdio>

namespace reproduce {

const std::vector<System>& systems() {
  static const std::vector<System> list{
      {"deformation-5", "deformation transfer, 5 control points", Kind::deformation, {"--control-points", "5"}},
      {"deformation-13", "deformation transfer, 13 control points", Kind::deformation, {"--control-points", "13"}},
      {"skeleton", "skeleton-driven", Kind::skeleton, {}},
      {"bodies", "npt, by body estimation", Kind::bodies, {}},
      {"full", "full model", Kind::network, {"--feature", "per-vertex", "--edge-loss", "length"}},
      {"without-edge", "w/o edge regularisation", Kind::network, {"--feature", "per-vertex"}},
      {"without-spadain", "w/o SPAdaIN", Kind::network, {"--net", "without-spadain", "--edge-loss", "length"}},
      {"concat1", "concat1", Kind::network, {"--net", "concat1", "--edge-loss", "length"}},
      {"compact", "compact pose feature", Kind::network, {"--feature", "pooled", "--edge-loss", "length"}},
      {"quadruped", "compact pose feature, animals", Kind::network, {"--feature", "pooled"}}};
  return list;
}

const System& system_of(const std::string& id) {
  const auto found = std::ranges::find(systems(), id, &System::id);
  if (found != systems().end()) return *found;
  std::string all;
  for (const System& s : systems()) all += (all.empty() ? "" : ", ") + s.id;
  throw npt::Error({.file = "system", .found = "'" + id + "'", .expected = "one of " + all});
}

const std::vector<Table>& tables() {
  static const std::vector<Table> list{
      {1,
       "Table 1: deformation transfer, which also gets the source's rest mesh and control points",
       {{"deformation-5", {{7.3, 7.2}}}, {"deformation-13", {{7.7, 6.7}}}, {"bodies"}, {"full", {{1.1, 9.3}}}}},
      {2,
       "Table 2: ablations",
       {{"concat1", {{12.1, 16.9}}},
        {"without-spadain", {{8.3, 13.7}}},
        {"without-edge", {{1.2, 10.1}}},
        {"full", {{1.1, 9.3}}}}},
      {7,
       "Table 7: skeleton-driven transfer and the compact feature",
       {{"skeleton", {{27.4, 31.1}}}, {"bodies"}, {"compact", {{2.1, 12.7}}}, {"full", {{1.1, 9.3}}}}}};
  return list;
}

const Table& table_of(int number) {
  const auto found = std::ranges::find(tables(), number, &Table::number);
  if (found == tables().end())
    throw npt::Error({.file = "--table", .found = std::to_string(number), .expected = "1, 2 or 7"});
  return *found;
}

std::optional<Measured> find(const Results& results, const std::string& system) {
  const auto found = std::ranges::find(results, system, &Results::value_type::first);
  return found == results.end() ? std::nullopt : std::optional(found->second);
}

std::string markdown(const std::vector<int>& numbers, const Results& results) {
  std::string text;
  for (const int number : numbers) {
    const Table& table = table_of(number);
    text += "### " + table.title +
            "\n\nPMD x 1e-4 in square metres, bounding boxes centred. Per coordinate as the paper's figures probably "
            "are; by eq. 7, "
            "three times as much.\n\n"
            "| system | seen | unseen | paper: seen | paper: unseen | seen, eq. 7 | unseen, eq. 7 |\n"
            "|---|---|---|---|---|---|---|\n";
    for (const Row& row : table.rows) {
      const std::optional<Measured> ours = find(results, row.system);
      if (!ours) continue;
      char paper[64] = "| | |", line[320];
      if (row.paper) std::snprintf(paper, sizeof paper, "| %.1f | %.1f |", row.paper->seen, row.paper->unseen);
      std::snprintf(line, sizeof line, "| %s | %.2f | %.2f %s %.2f | %.2f |\n", system_of(row.system).name.c_str(),
                    1e4 * ours->seen / 3, 1e4 * ours->unseen / 3, paper, 1e4 * ours->seen, 1e4 * ours->unseen);
      text += line;
    }
    text += '\n';
  }
  return text;
}

}  // namespace reproduce
