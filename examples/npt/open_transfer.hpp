/// From a command's arguments to an open pose transfer, and what the user must know before trusting its results.
#pragma once

#include "networks.hpp"
#include "transfer_arguments.hpp"

namespace program {

/// Weights as named, or those shipped, or random ones where asked for. Notes go to the standard error output.
/// Errors    npt::Error for weights that are missing, broken, or of another network than asked for
PoseTransfer open_transfer(const TransferArguments& arguments);

/// Prints a note where a mesh isn't taken for one in metres.
void note_unit(const PoseTransfer& transfer, const npt::MeshView& mesh);

}  // namespace program
