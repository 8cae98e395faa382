#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <reproduce/systems.hpp>

#include <set>
#include <string>

TEST_CASE("every row of a table is a system, and every system but the animals' stands in a table") {
  std::set<std::string> used;
  for (const reproduce::Table& table : reproduce::tables())
    for (const reproduce::Row& row : table.rows) {
      CHECK(reproduce::system_of(row.system).id == row.system);
      CHECK(row.paper.has_value() == (row.system != "bodies"));  // the paper has nothing of the kind
      used.insert(row.system);
    }
  CHECK_FALSE(used.contains("quadruped"));
  CHECK(used.size() + 1 == reproduce::systems().size());
}

TEST_CASE("unknown systems and tables are errors") {
  CHECK_THROWS_AS(reproduce::system_of("nonsense"), npt::Error);
  CHECK_THROWS_AS(reproduce::table_of(3), npt::Error);
}

TEST_CASE("tables show ours per coordinate beside the paper's, and leave out what was not measured") {
  const reproduce::Results results{{"full", {.seen = 6e-4, .unseen = 9e-4, .how = {}}},
                                   {"concat1", {.seen = 30e-4, .unseen = 33e-4, .how = {}}}};
  const std::string text = reproduce::markdown({2}, results);
  CHECK(text.find("| full model | 2.00 | 3.00 | 1.1 | 9.3 | 6.00 | 9.00 |") != std::string::npos);
  CHECK(text.find("| concat1 | 10.00 | 11.00 | 12.1 | 16.9 | 30.00 | 33.00 |") != std::string::npos);
  CHECK(text.find("SPAdaIN |") == std::string::npos);
}

TEST_CASE("what the paper hasn't leaves its columns empty") {
  const std::string text = reproduce::markdown({7}, {{"bodies", {.seen = 6e-4, .unseen = 9e-4, .how = {}}}});
  CHECK(text.find("| npt, by body estimation | 2.00 | 3.00 | | | 6.00 | 9.00 |") != std::string::npos);
}
