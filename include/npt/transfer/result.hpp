/// What a transfer gives: positions or a mesh, and how it was made.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/result_measures.hpp>
#include <npt/transfer/warning.hpp>

#include <optional>
#include <span>
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

/// One transfer of a batch, on borrowed memory.
struct TransferJob {
  MeshView identity, pose;
  std::span<float> result;           ///< [V, 3], in the identity's order, units and place
  TransferReport* report = nullptr;  ///< where to say how it was made, if anybody wants to know
};

}  // namespace npt::inline NPT_ABI
