/// From a command's arguments to an open pose transfer, and what the user must know before trusting its results.
#pragma once

#include "networks.hpp"
#include "transfer_arguments.hpp"

#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/transfer/notes.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace program {

/// Weights as named, or those shipped, or random ones where asked for. Notes go to the standard error output.
/// Errors    npt::Error for weights that are missing, broken, or of another network than asked for
PoseTransfer open_transfer(const TransferArguments& arguments);

using npt::method_notes, npt::with_confidence;

/// Metres in a unit of an identity whose result is a GLB, where numbers are metres, told from its size or by --unit; 1
/// where its own file says them in metres, and where its unit can't be told. `note`: what the user should know of it.
double metres_in(const PoseTransfer& transfer, const npt::MeshView& identity, const std::filesystem::path& file,
                 const std::filesystem::path& out, std::string& note);

/// The mesh with all positions multiplied.
npt::Mesh scaled(npt::Mesh mesh, double factor);

/// A note where a mesh isn't taken for one in metres; else empty.
std::string unit_note(const PoseTransfer& transfer, const npt::MeshView& mesh);

}  // namespace program
