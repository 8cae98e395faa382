/// What the paper compares, in which of its tables, with which figures.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace reproduce {

enum class Kind { network, deformation, skeleton, bodies };

struct System {
  std::string id;    ///< names files: "without-spadain"
  std::string name;  ///< in tables
  Kind kind = Kind::network;
  std::vector<std::string> arguments;  ///< of `npt train` for networks, of `npt deform` for deformation transfer
};

/// All of them; networks in the order in which they are trained. The last, of animals, stands in no table.
const std::vector<System>& systems();
/// Errors  npt::Error for an id that none has
const System& system_of(const std::string& id);

/// A row of one of the paper's tables, PMD x 1e-4 as printed there, or nothing for a system that the paper hasn't.
struct Row {
  struct Printed {
    double seen, unseen;
  };
  std::string system;
  std::optional<Printed> paper{};
};
struct Table {
  int number;
  std::string title;
  std::vector<Row> rows;
};

/// Tables 1, 2 and 7.
const std::vector<Table>& tables();
/// Errors  npt::Error for another number
const Table& table_of(int number);

/// PMD by eq. 7 in square metres, bounding boxes centred.
struct Measured {
  double seen = 0, unseen = 0;
  double seconds = 0;  ///< that measuring took
  std::string how;     ///< commands
};

/// One system's figures, if it was measured.
using Results = std::vector<std::pair<std::string, Measured>>;
std::optional<Measured> find(const Results& results, const std::string& system);

/// The tables as Markdown: ours per coordinate, as the paper's are, and by eq. 7. Systems without figures are left out.
std::string markdown(const std::vector<int>& numbers, const Results& results);

}  // namespace reproduce
