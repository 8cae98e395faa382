/// From a command's arguments to an open pose transfer, and what the user must know before trusting its results.
#pragma once

#include "networks.hpp"
#include "transfer_arguments.hpp"

#include <npt/transfer/character.hpp>

#include <filesystem>
#include <string>

namespace program {

/// Weights as named, or those shipped, or random ones where asked for. Notes go to the standard error output.
/// Errors    npt::Error for weights that are missing, broken, or of another network than asked for
PoseTransfer open_transfer(const TransferArguments& arguments);

/// Metres in a unit of an identity whose result is a GLB, where numbers are metres; else 1. `note`: what the user
/// should know of it
double metres_in(const PoseTransfer& transfer, const npt::Character& identity, const std::filesystem::path& file,
                 const std::filesystem::path& out, std::string& note);

}  // namespace program
