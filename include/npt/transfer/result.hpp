/// What a transfer gives: positions or a mesh, and how it was made.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/result_measures.hpp>
#include <npt/transfer/warning.hpp>

#include <optional>
#include <string_view>

namespace npt::inline NPT_ABI {

/// How a transfer was made.
struct TransferReport {
  Method method = Method::network;  ///< body or network
  /// Whose body made it, "person" or "four-legged animal"; empty: the network. As long as the program runs.
  std::string_view kind{};
  std::optional<double> confidence;  ///< the lower of both meshes', from 0 to 1; none where no body was estimated
  Warnings warnings;                 ///< empty: nothing needs to be said
  /// Where TransferOptions::measure asks for them and the identity has a surface.
  std::optional<ResultMeasures> measures{};
};

struct Result : TransferReport {
  Mesh mesh;  ///< the identity in the pose: its faces, order, unit and place
};

}  // namespace npt::inline NPT_ABI
